#include "engine/model/dae_size.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <map>
#include <set>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using tinyxml2::XMLElement;

class DaeCount {
 public:
  explicit DaeCount(const std::string& file) : file_(file) {}

  void run(const std::string& bytes) {
    tinyxml2::XMLDocument document;
    if (document.Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS) {
      throw InputError(fmt::format("{}:{}: not XML ({}); a DAE file is an XML document <COLLADA>…</COLLADA>", file_,
                                   document.ErrorLineNum(), tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID())));
    }
    const XMLElement* root = document.RootElement();
    if (!root) return;
    collect(*root);
    std::size_t all = 0;
    for (const XMLElement* node : nodes_) all += parts_of(*node);
    if (all > kMaxMeshParts) fail(*root, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
  }

 private:
  [[noreturn]] void fail(const XMLElement& e, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_, e.GetLineNum(), message));
  }

  void collect(const XMLElement& e) {
    if (std::string_view(e.Name()) == "node") {
      nodes_.push_back(&e);
      if (nodes_.size() > kMaxMeshParts) fail(e, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
      if (const char* id = e.Attribute("id")) by_name_.emplace(id, &e);
    }
    for (const XMLElement* c = e.FirstChildElement(); c; c = c->NextSiblingElement()) collect(*c);
  }

  /// How many nodes and shapes come of a node, with all that it uses.
  std::size_t parts_of(const XMLElement& node) {
    const auto known = parts_.find(&node);
    if (known != parts_.end()) return known->second;
    if (!open_.insert(&node).second) fail(node, "a node that holds itself");
    std::size_t sum = 1;
    for (const XMLElement* c = node.FirstChildElement(); c; c = c->NextSiblingElement()) {
      const std::string_view tag = c->Name();
      if (tag == "node") sum += parts_of(*c);
      if (tag.substr(0, 9) != "instance_") continue;
      const char* url = c->Attribute("url");
      const auto target = by_name_.find(url && *url == '#' ? url + 1 : "");
      sum += tag == "instance_node" && target != by_name_.end() ? parts_of(*target->second) : 1;
      if (sum > kMaxMeshParts) fail(*c, fmt::format("more than {} nodes; simplify the mesh", kMaxMeshParts));
    }
    open_.erase(&node);
    return parts_[&node] = sum;
  }

  const std::string& file_;
  std::vector<const XMLElement*> nodes_;
  std::map<std::string, const XMLElement*> by_name_;
  std::map<const XMLElement*, std::size_t> parts_;
  std::set<const XMLElement*> open_;  // on the way from the root to where we are
};

}  // namespace

void check_dae_size(const std::string& bytes, const std::string& file) { DaeCount(file).run(bytes); }

}  // namespace graze
