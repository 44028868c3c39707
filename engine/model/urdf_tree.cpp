#include "engine/model/urdf_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "engine/settings/settings.h"

namespace graze {

namespace {

class Tree {
 public:
  Tree(UrdfOutline& outline, UrdfProblems& problems) : outline_(outline), problems_(problems) {
    for (std::size_t i = 0; i < outline.links.size(); ++i) index_[outline.links[i].name] = i;
    parent_joint_.assign(outline.links.size(), nullptr);
    children_.resize(outline.links.size());
    for (const UrdfOutline::JointEntry& joint : outline.joints) connect(joint);
    if (broken_) problems_.raise();
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
  [[noreturn]] void fail(int line, const std::string& message) const { problems_.stop(line, message); }

  /// Index of the link of this name, or none.
  std::optional<std::size_t> link(const UrdfOutline::JointEntry& joint, const std::string& name, const char* role) {
    const auto found = index_.find(name);
    if (found != index_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& entry : index_) names.push_back(entry.first);
    const std::string near = nearest(name, names);
    refuse(joint.line, fmt::format("joint '{}': {} link '{}' is not there{}", joint.name, role, name,
                                   near.empty() ? "" : "; did you mean '" + near + "'?"));
    return std::nullopt;
  }

  void refuse(int line, const std::string& what) {
    problems_.refuse(line, what);
    broken_ = true;
  }

  void connect(const UrdfOutline::JointEntry& joint) {
    const auto parent = link(joint, joint.parent, "parent"), child = link(joint, joint.child, "child");
    if (!parent || !child) return;
    if (parent_joint_[*child]) {
      return refuse(joint.line,
                    fmt::format("joint '{}': link '{}' is already the child of joint '{}'; a URDF is a tree, every "
                                "link has one parent (no loops)",
                                joint.name, joint.child, parent_joint_[*child]->name));
    }
    parent_joint_[*child] = &joint;
    children_[*parent].push_back(*child);
  }

  std::size_t root() const {
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < parent_joint_.size(); ++i) {
      if (!parent_joint_[i]) roots.push_back(i);
    }
    if (outline_.links.empty()) fail(1, "the robot has no links");
    if (roots.empty()) report_loop(0);
    for (std::size_t i = 1; i < roots.size(); ++i) {
      problems_.refuse(outline_.links[roots[i]].line,
                       fmt::format("links '{}' and '{}' both have no parent joint; a robot has exactly one root link",
                                   outline_.links[roots[0]].name, outline_.links[roots[i]].name));
    }
    if (roots.size() > 1) problems_.raise();
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
  UrdfProblems& problems_;
  bool broken_ = false;  // not all joints stand between two links
  std::map<std::string, std::size_t> index_;
  std::vector<const UrdfOutline::JointEntry*> parent_joint_;  // per link
  std::vector<std::vector<std::size_t>> children_;            // per link, in file order
};

/// A root that is there only to be joined to.
bool is_frame(const UrdfOutline::LinkEntry& link) {
  return link.name == "world" || (!link.inertial_line && link.collisions.empty() && link.visuals.empty());
}

/// What there is no joint for: six or three degrees of freedom. Between a root that is a mere frame and the robot they
/// say that the base is free.
void settle_free_joints(UrdfOutline& outline, UrdfProblems& problems) {
  const UrdfOutline::LinkEntry root = outline.links.front();
  const auto at_root = [&](const UrdfOutline::JointEntry& joint) { return joint.parent == root.name; };
  bool removed = false;
  const bool base = is_frame(root) && std::count_if(outline.joints.begin(), outline.joints.end(), at_root) == 1;
  for (const UrdfOutline::JointEntry& joint : outline.joints) {
    const bool planar = joint.type == "planar";
    if (!planar && joint.type != "floating") continue;
    const std::string what =
        planar ? fmt::format("joint '{}': planar joints are not supported; use two prismatic joints and a revolute one",
                             joint.name)
               : fmt::format(
                     "joint '{}': a floating joint may only stand between the root link 'world' and the robot; "
                     "a robot's base floats without one",
                     joint.name);
    if (!base || !at_root(joint)) {
      problems.refuse(joint.line, what);
    } else if (planar || root.name != "world") {
      problems.repair(joint.line, what, fmt::format("removes it and link '{}': the base floats", root.name));
      for (tinyxml2::XMLElement* e : {joint.element, root.element}) e->GetDocument()->DeleteNode(e);
      removed = true;
    }
  }
  if (!removed) return;
  outline.links.erase(outline.links.begin());  // the root's only joint is the first
  outline.joints.erase(outline.joints.begin());
}

}  // namespace

void order_as_tree(UrdfOutline& outline, UrdfProblems& problems) {
  Tree(outline, problems).order();
  settle_free_joints(outline, problems);
}

}  // namespace graze
