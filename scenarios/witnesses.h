#pragma once
// The table of witnesses. To add one, write its class in a witness file, give it a row in witnesses.cpp and a
// definition in data/scenario.schema.json.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenarios/task.h"

namespace graze {

/// A witness as read, with what tables say of it.
struct ReadWitness {
  std::shared_ptr<const Witness> witness;
  std::string description;                        // "tilt of BODY0 below 90 deg"
  std::string unit;                               // SI
  WitnessRange range = {};                        // of its value; by default it can be anything
  std::optional<double> at_start = std::nullopt;  // its value before the first step, if every trace begins with it
};

/// Least margin of parts that touch and overlap by less, and of a gap where nothing touches, so that its sign is never
/// 0, m.
inline constexpr double kTouch = 1e-9;

using WitnessReader = std::function<ReadWitness(const Settings&, const Model& nominal)>;

struct WitnessKind {
  std::string name;
  std::string help;  // what it asks for, in one line, for `graze help witnesses`
  WitnessReader read;
};

const std::vector<WitnessKind>& witness_kinds();

// witness_motion.cpp
ReadWitness read_tilt(const Settings& settings, const Model& nominal);
ReadWitness read_height(const Settings& settings, const Model& nominal);
ReadWitness read_position(const Settings& settings, const Model& nominal);
ReadWitness read_speed(const Settings& settings, const Model& nominal);
// witness_contact.cpp
ReadWitness read_contact(const Settings& settings, const Model& nominal);
ReadWitness read_no_contact(const Settings& settings, const Model& nominal);
ReadWitness read_self_collision(const Settings& settings, const Model& nominal);
// witness_impulse.cpp
ReadWitness read_contact_impulse(const Settings& settings, const Model& nominal);
// witness_joints.cpp
ReadWitness read_joint_limits(const Settings& settings, const Model& nominal);
ReadWitness read_torque_limits(const Settings& settings, const Model& nominal);
ReadWitness read_torque_speed(const Settings& settings, const Model& nominal);
ReadWitness read_joint_speed(const Settings& settings, const Model& nominal);

}  // namespace graze
