#pragma once
// The table of witnesses. To add one, write its class in a witness file and a row, with its description, in that file's
// list below; a program that has witnesses of its own registers them. Help, schema and docs follow from descriptions.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/settings/description.h"
#include "scenarios/registered.h"
#include "scenarios/task.h"

namespace graze {

/// A witness as read, with what tables say of it.
struct ReadWitness {
  std::shared_ptr<const Witness> witness;
  std::string description;                        // "tilt of BODY0 below 90 deg"
  std::string unit;                               // SI
  WitnessRange range = {};                        // of its value; by default it can be anything
  std::optional<double> at_start = std::nullopt;  // its value before the first step, if every trace begins with it
  /// The witness that counts from a window's begin on, s, for those that sum up what has been; by default they do not.
  std::function<std::shared_ptr<const Witness>(double from)> of_window = {};
  std::string kind = {};  // its key, "torque_limits"; the task's reader sets it

  std::shared_ptr<const Witness> within(const Window& window) const {
    return of_window ? of_window(window.from) : witness;
  }
};

/// Least margin of parts that touch and overlap by less, and of a gap where nothing touches, so that its sign is never
/// 0, m.
inline constexpr double kTouch = 1e-9;

/// Given what is written for a witness, whose keys are known to be described ones.
using WitnessReader = std::function<ReadWitness(const Described&, const Model& nominal)>;

struct WitnessKind {
  std::string name;
  Description text;
  std::string unit;  // of its margin, as docs tell it
  WitnessReader read;
};

/// Those of the files below, and behind them those that were registered.
const std::vector<WitnessKind>& witness_kinds();

using WitnessRegistration = Registration<WitnessKind>;

/// What may stand beside a witness: when it counts. Of requirements and measures, and of predicates, which may also be
/// made of others (task.cpp).
const Description& requirement_description();
const Description& predicate_description();

std::vector<WitnessKind> motion_witnesses();   // witness_motion.cpp
std::vector<WitnessKind> contact_witnesses();  // witness_contact.cpp
std::vector<WitnessKind> impulse_witnesses();  // witness_impulse.cpp
std::vector<WitnessKind> force_witnesses();    // witness_force.cpp
std::vector<WitnessKind> joint_witnesses();    // witness_joints.cpp

}  // namespace graze
