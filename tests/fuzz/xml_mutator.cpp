#include "tests/fuzz/xml_mutator.h"

#include <tinyxml2.h>

#include <vector>

namespace graze::fuzz {
namespace {

using tinyxml2::XMLElement;

void collect(XMLElement* element, std::vector<XMLElement*>& all) {
  all.push_back(element);
  for (XMLElement* e = element->FirstChildElement(); e; e = e->NextSiblingElement()) collect(e, all);
}

const std::vector<std::string>& odd_values() {
  static const std::vector<std::string> all = {"0",          "-1",     "1",        "1e308",    "1e-320",
                                               "nan",        "inf",    "0 0 0",    "0 0 1",    "1 1",
                                               "",           "fixed",  "floating", "revolute", "prismatic",
                                               "continuous", "planar", "world",    "mesh.obj", "package://a/mesh.stl"};
  return all;
}

/// Some attribute of an element, or null.
const tinyxml2::XMLAttribute* some_attribute(const XMLElement& element, Dice& dice) {
  std::vector<const tinyxml2::XMLAttribute*> all;
  for (const auto* a = element.FirstAttribute(); a; a = a->Next()) all.push_back(a);
  return all.empty() ? nullptr : dice.of(all);
}

class Mutator {
 public:
  Mutator(tinyxml2::XMLDocument& document, Dice& dice) : document_(document), dice_(dice) {
    collect(document.RootElement(), all_);
  }

  void run() {
    XMLElement* const element = dice_.of(all_);
    XMLElement* const other = dice_.of(all_);
    switch (dice_.below(6)) {
      case 0:
      case 1:
        return change_attribute(*element, *other);
      case 2:
        if (element != document_.RootElement()) document_.DeleteNode(element);
        return;
      case 3:  // once more, elsewhere
        other->InsertEndChild(element->DeepClone(&document_));
        return;
      case 4:  // once more, under another name
        return repeat(*element);
      default:
        element->SetName(std::string(other->Name()).c_str());  // they may be the same
    }
  }

 private:
  void change_attribute(XMLElement& element, const XMLElement& other) {
    const tinyxml2::XMLAttribute* const attribute = some_attribute(element, dice_);
    const tinyxml2::XMLAttribute* const from = some_attribute(other, dice_);
    if (!attribute) return;
    const std::string name = attribute->Name(), value = attribute->Value();
    switch (dice_.below(4)) {
      case 0:
        element.SetAttribute(name.c_str(), dice_.of(odd_values()).c_str());
        break;
      case 1:
        if (from) element.SetAttribute(name.c_str(), std::string(from->Value()).c_str());
        break;
      case 2:
        element.SetAttribute(name.c_str(), ("-" + value).c_str());
        break;
      default:
        element.DeleteAttribute(name.c_str());
    }
  }

  void repeat(XMLElement& element) {
    tinyxml2::XMLNode* const parent = element.Parent();
    if (!parent || &element == document_.RootElement()) return;
    XMLElement* const copy = element.DeepClone(&document_)->ToElement();
    if (const char* name = copy->Attribute("name")) {
      copy->SetAttribute("name", (name + std::string(1, static_cast<char>('a' + dice_.below(26)))).c_str());
    }
    parent->InsertAfterChild(&element, copy);
  }

  tinyxml2::XMLDocument& document_;
  Dice& dice_;
  std::vector<XMLElement*> all_;
};

}  // namespace

std::string mutated_xml(const std::string& text, Dice& dice) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS || !document.RootElement()) return text;
  for (std::size_t i = 1 + dice.below(3); i > 0; --i) Mutator(document, dice).run();
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace graze::fuzz
