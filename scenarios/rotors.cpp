#include "scenarios/rotors.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "engine/model/limits.h"
#include "engine/settings/warnings.h"
#include "scenarios/names.h"

namespace graze {
namespace {

/// A key of `actuators` and the number of a joint that it gives.
struct RotorKey {
  const char* key;
  double Joint::*number;
  Quantity quantity;
  double most;
  bool positive;  // or at least 0
};

constexpr RotorKey kKeys[] = {{"gear", &Joint::gear, Quantity::dimensionless, kMaxGear, true},
                              {"rotor_inertia", &Joint::rotor_inertia, Quantity::inertia, kMaxRotor, false}};

class RotorReader {
 public:
  explicit RotorReader(Robot& robot) : robot_(robot) {
    for (Joint& joint : robot.joints) {
      if (joint.driven()) names_.push_back(joint.name), joints_.push_back(&joint);
    }
  }

  void read(const Settings& value, const RotorKey& key) {
    if (!value.is_map()) {
      const double number = checked(value, key);
      for (Joint* joint : joints_) joint->*key.number = number;
      return;
    }
    for (const auto& [pattern, one] : value.entries()) {
      refuse_follower(one, pattern);
      for (const int i : match_names(one, pattern, names_, "driven joint")) joints_[i]->*key.number = checked(one, key);
    }
  }

 private:
  static double checked(const Settings& value, const RotorKey& key) {
    const double number = key.positive ? value.positive(key.quantity) : value.non_negative(key.quantity);
    if (number > key.most) {
      const bool plain = key.quantity == Quantity::dimensionless;
      value.fail(fmt::format("{}: at most {:g}{}{}", value.text(), key.most, plain ? "" : " ",
                             plain ? "" : unit_of(key.quantity)));
    }
    return number;
  }

  /// Joints that follow others have no drive; globs pass over them.
  void refuse_follower(const Settings& value, const std::string& name) const {
    for (const Joint& joint : robot_.joints) {
      if (joint.name != name || joint.mimic.joint.empty()) continue;
      value.fail_key(
          fmt::format("'{}' follows '{}' (<mimic> of the URDF) and has no drive of its own; did you mean "
                      "'{}'?",
                      name, joint.mimic.joint, joint.mimic.joint));
    }
  }

  Robot& robot_;
  std::vector<std::string> names_;
  std::vector<Joint*> joints_;
};

bool is_rotor(const std::string& path) {
  return path.starts_with("robot.joint.") && (path.ends_with(".gear") || path.ends_with(".rotor_inertia"));
}

[[noreturn]] void refuse(const Settings& written, const std::string& physics) {
  written.fail_key(
      fmt::format("the inertia of rotors is not known to physics: {}, whose joints have none; take it "
                  "out, or did you mean physics: lanes?",
                  physics));
}

}  // namespace

void read_rotors(const Settings& scenario, const std::string& physics, World& world) {
  const auto actuators = scenario.find("actuators"), uncertain = scenario.find("uncertain");
  std::vector<Settings> drawn;
  if (uncertain && uncertain->is_map()) {
    for (const auto& [pattern, value] : uncertain->entries()) {
      if (is_rotor(pattern)) drawn.push_back(value);
    }
  }
  if (!world.knows_rotors && !drawn.empty()) refuse(drawn.front(), physics);
  const bool fixed = actuators && actuators->is_map();
  RotorReader reader(world.robot);
  for (const RotorKey& key : kKeys) {
    const auto written = fixed ? actuators->find(key.key) : std::nullopt;
    if (!written) continue;
    if (!world.knows_rotors) refuse(*written, physics);
    reader.read(*written, key);
  }
  const auto is_inertia = [](const Settings& one) { return one.path().ends_with(".rotor_inertia"); };
  if ((fixed && actuators->has("rotor_inertia")) || std::any_of(drawn.begin(), drawn.end(), is_inertia)) return;
  if (const auto gear = fixed ? actuators->find("gear") : std::nullopt) drawn.push_back(*gear);
  for (const Settings& gear : drawn) {
    warn(gear, "does nothing without rotor_inertia; limits of torque and speed are those of the joint");
  }
}

}  // namespace graze
