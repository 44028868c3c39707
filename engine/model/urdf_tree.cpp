#include "engine/model/urdf_tree.h"

#include <fmt/format.h>

#include <map>

#include "engine/settings/settings.h"

namespace graze {

namespace {

class Tree {
 public:
  Tree(UrdfOutline& outline, const std::string& name) : outline_(outline), name_(name) {
    for (std::size_t i = 0; i < outline.links.size(); ++i) index_[outline.links[i].name] = i;
    parent_joint_.assign(outline.links.size(), nullptr);
    children_.resize(outline.links.size());
    for (const UrdfOutline::JointEntry& joint : outline.joints) connect(joint);
  }

  void order() {
    std::vector<UrdfOutline::LinkEntry> links;
    std::vector<UrdfOutline::JointEntry> joints;
    std::vector<std::size_t> stack{root()};
    std::vector<bool> reached(parent_joint_.size());
    while (!stack.empty()) {
      const std::size_t link = stack.back();
      stack.pop_back();
      reached[link] = true;
      links.push_back(outline_.links[link]);
      if (parent_joint_[link]) joints.push_back(*parent_joint_[link]);
      stack.insert(stack.end(), children_[link].rbegin(), children_[link].rend());
    }
    for (std::size_t i = 0; i < reached.size(); ++i) {
      if (!reached[i]) report_loop(i);
    }
    outline_.links = std::move(links);
    outline_.joints = std::move(joints);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", name_, line, message));
  }

  std::size_t link(const UrdfOutline::JointEntry& joint, const std::string& name, const char* role) const {
    const auto found = index_.find(name);
    if (found != index_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& entry : index_) names.push_back(entry.first);
    const std::string near = nearest(name, names);
    if (name == "world") {
      fail(joint.line,
           fmt::format(
               "joint '{}': {} link 'world' is not there; write <link name=\"world\"/> into the file, which fixes "
               "what is joined to it, or leave the joint out and say 'base: fixed' in the scenario",
               joint.name, role));
    }
    fail(joint.line, fmt::format("joint '{}': {} link '{}' is not there{}", joint.name, role, name,
                                 near.empty() ? "" : "; did you mean '" + near + "'?"));
  }

  void connect(const UrdfOutline::JointEntry& joint) {
    const std::size_t parent = link(joint, joint.parent, "parent"), child = link(joint, joint.child, "child");
    if (parent_joint_[child]) {
      fail(joint.line, fmt::format("joint '{}': link '{}' is already the child of joint '{}'; a URDF is a tree, every "
                                   "link has one parent (no loops)",
                                   joint.name, joint.child, parent_joint_[child]->name));
    }
    parent_joint_[child] = &joint;
    children_[parent].push_back(child);
  }

  std::size_t root() const {
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < parent_joint_.size(); ++i) {
      if (!parent_joint_[i]) roots.push_back(i);
    }
    if (outline_.links.empty()) fail(1, "the robot has no links");
    if (roots.empty()) report_loop(0);
    if (roots.size() > 1) {
      fail(outline_.links[roots[1]].line,
           fmt::format("links '{}' and '{}' both have no parent joint; a robot has exactly one root link",
                       outline_.links[roots[0]].name, outline_.links[roots[1]].name));
    }
    return roots[0];
  }

  /// From a link that hangs on no root, its ancestors lead around a loop.
  [[noreturn]] void report_loop(std::size_t start) const {
    std::vector<bool> seen(parent_joint_.size());
    std::size_t at = start;
    while (!seen[at]) {
      seen[at] = true;
      at = index_.at(parent_joint_[at]->parent);
    }
    const std::size_t first = at;
    std::string path = outline_.links[first].name;
    do {
      at = index_.at(parent_joint_[at]->parent);
      path = outline_.links[at].name + " > " + path;
    } while (at != first);
    fail(parent_joint_[first]->line,
         fmt::format("joint '{}' closes a loop of links ({}); a URDF is a tree", parent_joint_[first]->name, path));
  }

  UrdfOutline& outline_;
  const std::string& name_;
  std::map<std::string, std::size_t> index_;
  std::vector<const UrdfOutline::JointEntry*> parent_joint_;  // per link
  std::vector<std::vector<std::size_t>> children_;            // per link, in file order
};

}  // namespace

void order_as_tree(UrdfOutline& outline, const std::string& name) { Tree(outline, name).order(); }

}  // namespace graze
