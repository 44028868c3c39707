#include "engine/model/urdf_mimics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

using JointEntry = UrdfOutline::JointEntry;

/// Gears between joints of one robot; far beyond them one of the two joints would stand still.
constexpr double kLeastMultiplier = 1e-6, kMostMultiplier = 1e6;
/// Limits that are written to be the same may miss each other by rounding, rad or m.
constexpr double kRounding = 1e-9;

class Mimics {
 public:
  Mimics(std::vector<JointEntry>& joints, UrdfProblems& problems) : joints_(joints), problems_(problems) {
    for (JointEntry& joint : joints) {
      index_[joint.name] = &joint;
      names_.push_back(joint.name);
    }
  }

  void run() {
    for (JointEntry& joint : joints_) {
      if (follows(joint)) check(joint);
    }
    for (JointEntry& joint : joints_) {
      if (follows(joint)) open_ring(joint);
    }
    std::vector<std::pair<JointEntry*, Mimic>> led;
    for (JointEntry& joint : joints_) {
      if (follows(joint)) led.emplace_back(&joint, led_to_end(joint));
    }
    for (auto& [joint, mimic] : led) joint->mimic = mimic;
    for (auto& [joint, mimic] : led) {
      if (check_multiplier(*joint)) check_limits(*joint);
    }
    if (led.size() > kMaxMimics) {
      problems_.stop(led[kMaxMimics].first->mimic_line,
                     fmt::format("more than {0} joints with <mimic>; a robot has at most {0}", kMaxMimics));
    }
  }

 private:
  static bool follows(const JointEntry& joint) { return joint.mimic_line != 0; }

  JointEntry* other(const JointEntry& joint) const {
    const auto found = index_.find(joint.mimic.joint);
    return found == index_.end() ? nullptr : found->second;
  }

  void leave_out(JointEntry& joint, const std::string& what) {
    problems_.repair(joint.mimic_line, fmt::format("joint '{}': <mimic> {}", joint.name, what),
                     "removes <mimic>: the joint moves on its own");
    while (auto* mimic = joint.element->FirstChildElement("mimic")) joint.element->DeleteChild(mimic);
    joint.mimic = {};
    joint.mimic_line = 0;
  }

  /// What can be seen of a joint and the one that it names.
  void check(JointEntry& joint) {
    const JointEntry* leader = other(joint);
    if (joint.mimic.joint.empty()) return leave_out(joint, "names no joint; it needs joint=\"NAME\"");
    if (!leader) {
      std::vector<std::string> others = names_;
      std::erase(others, joint.name);
      const std::string near = nearest(joint.mimic.joint, others);
      return leave_out(joint, fmt::format("names the joint '{}', which is not there{}", clipped(joint.mimic.joint, 80),
                                          near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    if (leader->type == "fixed" || leader->type == "floating" || leader->type == "planar") {
      return leave_out(joint, fmt::format("names the joint '{}', which is {}; it must be one that turns or slides",
                                          leader->name, leader->type));
    }
    if (check_multiplier(joint) && !(std::abs(joint.mimic.offset) <= kMaxLength)) {
      leave_out(joint, fmt::format("offset: {:g} is out of range; at most {:g}", joint.mimic.offset, kMaxLength));
    }
  }

  bool check_multiplier(JointEntry& joint) {
    const double size = std::abs(joint.mimic.multiplier);
    if (size >= kLeastMultiplier && size <= kMostMultiplier) return true;
    leave_out(joint, size == 0 ? "multiplier: 0 lets the joint stand still; a joint that never moves is a fixed one"
                               : fmt::format("multiplier: {:g} is out of range; its size must be {:g} to {:g}",
                                             joint.mimic.multiplier, kLeastMultiplier, kMostMultiplier));
    return false;
  }

  /// A joint that follows itself by way of others.
  void open_ring(JointEntry& joint) {
    std::string way = joint.name;
    const JointEntry* at = &joint;
    for (std::size_t steps = 0; steps < joints_.size() && follows(*at); ++steps) {
      at = other(*at);
      way += " > " + at->name;
      if (at == &joint)
        return leave_out(joint, fmt::format("closes a ring of joints that follow each other ({})", way));
    }
  }

  Mimic led_to_end(const JointEntry& joint) const {
    Mimic out = joint.mimic;
    for (const JointEntry* at = other(joint); follows(*at); at = other(*at)) {
      out = {at->mimic.joint, out.multiplier * at->mimic.multiplier,
             std::fma(out.multiplier, at->mimic.offset, out.offset)};
    }
    return out;
  }

  /// Some position of the other joint must suit all that follow it.
  void check_limits(JointEntry& joint) {
    const JointEntry& leader = *other(joint);
    auto& [low, high] = room_.try_emplace(leader.name, leader.lower, leader.upper).first->second;
    const double a = (joint.lower - joint.mimic.offset) / joint.mimic.multiplier;
    const double b = (joint.upper - joint.mimic.offset) / joint.mimic.multiplier;
    const double least = std::max(low, std::min(a, b)), most = std::min(high, std::max(a, b));
    if (least > most + kRounding) {
      return leave_out(
          joint, fmt::format("leaves no position: within its limits, {:g} to {:g}, '{}' would have to be from {:g} to "
                             "{:g}, which has {:g} to {:g}",
                             joint.lower, joint.upper, leader.name, std::min(a, b), std::max(a, b), low, high));
    }
    low = least, high = most;
  }

  std::vector<JointEntry>& joints_;
  UrdfProblems& problems_;
  std::map<std::string, JointEntry*> index_;
  std::vector<std::string> names_;
  std::map<std::string, std::pair<double, double>> room_;  // of joints that others follow, rad or m
};

}  // namespace

void settle_mimics(UrdfOutline& outline, UrdfProblems& problems) { Mimics(outline.joints, problems).run(); }

}  // namespace graze
