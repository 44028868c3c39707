#include "engine/model/dae_size.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "engine/model/limits.h"
#include "engine/model/mesh_size.h"
#include "engine/model/urdf_values.h"
#include "engine/model/xml_text.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using tinyxml2::XMLElement;

class DaeCount {
 public:
  explicit DaeCount(const std::string& file) : file_(file) {}

  void run(const std::string& bytes) {
    tinyxml2::XMLDocument document;
    if (const auto fault = read_xml(bytes, document)) {
      throw InputError(fmt::format("{}:{}: {}; a DAE file is an XML document <COLLADA>…</COLLADA>", file_, fault->line,
                                   fault->what));
    }
    const XMLElement* root = document.RootElement();
    if (!root) return;
    collect(*root);
    for (const XMLElement* accessor : accessors_) check_accessor(*accessor);
    std::size_t all = 0;
    for (const XMLElement* node : nodes_) all += size_of(*node).parts;
    if (all > kMaxMeshParts) fail(*root, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
  }

 private:
  /// Nodes and shapes that come of a node, and how deep they are in each other.
  struct Size {
    std::size_t parts, depth;
  };
  static constexpr std::size_t kDeepest = 100;  // the library walks down by calling itself

  [[noreturn]] void fail(const XMLElement& e, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_, e.GetLineNum(), message));
  }

  static std::string too_deep() {
    return fmt::format("nodes in nodes, more than {} deep; simplify the mesh", kDeepest);
  }

  void collect(const XMLElement& e) {
    if (std::string_view(e.Name()) == "node") {
      nodes_.push_back(&e);
      if (nodes_.size() > kMaxMeshParts) fail(e, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
      if (const char* id = e.Attribute("id")) by_name_.emplace(id, &e);
    }
    check_indices(e);
    check_counts(e);
    if (std::string_view(e.Name()) == "accessor") accessors_.push_back(&e);
    if (std::string_view(e.Name()) == "float_array") measure_array(e);
    for (const XMLElement* c = e.FirstChildElement(); c; c = c->NextSiblingElement()) collect(*c);
  }

  /// The library does not come to an end where an index is none.
  void check_indices(const XMLElement& e) const {
    const std::string_view tag = e.Name();
    if (tag != "p" && tag != "h" && tag != "v" && tag != "vcount") return;
    for (const tinyxml2::XMLNode* c = e.FirstChild(); c; c = c->NextSibling()) {
      const std::string_view text = c->ToText() ? c->Value() : "";
      const std::size_t odd = text.find_first_not_of("0123456789 \t\r\n");
      if (odd != std::string_view::npos) {
        fail(e,
             fmt::format("<{}>: '{}' is not an index; indices are whole numbers", tag, clipped(text.substr(odd), 20)));
      }
      if (const std::string_view large = large_index(text); !large.empty()) {
        fail(e, fmt::format("<{}>: no mesh has an index of {}", tag, clipped(large, 20)));
      }
    }
  }

  static std::size_t whole(const XMLElement& e, const char* attribute, std::size_t otherwise) {
    const char* text = e.Attribute(attribute);
    return text ? static_cast<std::size_t>(std::strtod(text, nullptr)) : otherwise;
  }

  void measure_array(const XMLElement& e) {
    std::size_t words = 0;
    for (const tinyxml2::XMLNode* c = e.FirstChild(); c; c = c->NextSibling()) {
      if (c->ToText()) words += words_of(c->Value()).size();
    }
    const std::size_t count = whole(e, "count", 0);
    if (count > words) fail(e, fmt::format("<float_array> count: {}: there are {} numbers", count, words));
    if (const char* id = e.Attribute("id")) arrays_.emplace(id, count);
  }

  /// It reads whatever an accessor reaches.
  void check_accessor(const XMLElement& e) const {
    const char* source = e.Attribute("source");
    const auto array = arrays_.find(source && *source == '#' ? source + 1 : "");
    if (array == arrays_.end()) return;  // of names
    std::size_t params = 0;
    for (const XMLElement* c = e.FirstChildElement("param"); c; c = c->NextSiblingElement("param")) ++params;
    const std::size_t stride = whole(e, "stride", 1), last = whole(e, "offset", 0) + whole(e, "count", 0) * stride;
    if (last > array->second || params > stride) {
      fail(e, fmt::format("<accessor> reaches beyond the {} numbers of its array", array->second));
    }
  }

  /// It makes room for what a file says that it has.
  void check_counts(const XMLElement& e) const {
    for (const char* attribute : {"count", "stride", "offset", "set"}) {
      const char* text = e.Attribute(attribute);
      const bool whole = !text || std::string_view(text).find_first_not_of("0123456789 ") == std::string_view::npos;
      if (whole && (!text || std::strtod(text, nullptr) <= double{kMaxMeshCorners})) continue;
      fail(e, fmt::format("<{}> {}: {}: a whole number, at most {}", e.Name(), attribute, clipped(text, 20),
                          kMaxMeshCorners));
    }
  }

  /// With all that the node uses.
  Size size_of(const XMLElement& node) {
    const auto known = sizes_.find(&node);
    if (known != sizes_.end()) return known->second;
    if (!open_.insert(&node).second) fail(node, "a node that holds itself");
    if (open_.size() > kDeepest) fail(node, too_deep());
    Size out{1, 1};
    for (const XMLElement* c = node.FirstChildElement(); c; c = c->NextSiblingElement()) {
      const std::string_view tag = c->Name();
      if (tag != "node" && tag.substr(0, 9) != "instance_") continue;
      const Size part = tag == "node" ? size_of(*c) : size_of_instance(*c);
      out.parts += part.parts;
      out.depth = std::max(out.depth, 1 + part.depth);
      if (out.parts > kMaxMeshParts) fail(*c, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
      if (out.depth > kDeepest) fail(*c, too_deep());
    }
    open_.erase(&node);
    return sizes_[&node] = out;
  }

  Size size_of_instance(const XMLElement& instance) {
    const char* url = instance.Attribute("url");
    const auto target = by_name_.find(url && *url == '#' ? url + 1 : "");
    const bool node = std::string_view(instance.Name()) == "instance_node" && target != by_name_.end();
    return node ? size_of(*target->second) : Size{1, 1};
  }

  const std::string& file_;
  std::vector<const XMLElement*> nodes_;
  std::map<std::string, const XMLElement*> by_name_;
  std::vector<const XMLElement*> accessors_;
  std::map<std::string, std::size_t> arrays_;  // numbers of a <float_array>, by id
  std::map<const XMLElement*, Size> sizes_;
  std::set<const XMLElement*> open_;  // on the way from the root to where we are
};

}  // namespace

void check_dae_size(const std::string& bytes, const std::string& file) { DaeCount(file).run(bytes); }

}  // namespace graze
