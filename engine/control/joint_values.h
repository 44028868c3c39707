#pragma once
// A value per actuated joint from settings: one number for all, or a map of joint globs to numbers.

#include "engine/control/policy.h"

namespace graze {

/// `{"*_Y_*": 20, "LF_X_1": 25}`: in file order, later entries win; joints that no entry names get `fallback`. A glob
/// that matches no actuated joint is refused with the nearest name. `sliding`: of prismatic joints, if that is another
/// quantity than of those that turn; a unit of the other is refused with the joint that it does not fit. na values, SI.
std::vector<double> read_joint_values(const Model& model, const Settings& settings, Quantity quantity, double fallback,
                                      std::optional<Quantity> sliding = std::nullopt);
/// The same for a key with a default value, which all joints have if it is not written.
std::vector<double> read_joint_values_or(const Model& model, const Described& settings, std::string_view key,
                                         std::optional<Quantity> sliding = std::nullopt);
/// The quantity of one number for several actuated joints, by their types; of joints of both types `turning`. Refuses a
/// unit that fits only some of them, with one that it does not fit.
Quantity quantity_of_joints(const Model& model, const Settings& value, const std::vector<int>& joints, Quantity turning,
                            Quantity sliding);

/// Names of the actuated joints, in order.
std::vector<std::string> actuated_names(const Model& model);
/// Positions of the actuated joints in a state, in order.
std::vector<double> actuated_positions(const Model& model, const State& state);

/// The keys kp and kd of a servo in each joint, required and 0.
Key servo_spring();
Key servo_damper();
/// Gains of a servo: stiffness and damping must not be negative.
std::vector<double> read_gains(const Model& model, const Described& settings, std::string_view key,
                               std::optional<Quantity> sliding = std::nullopt);

/// Warns of joints that a map of kp does not name: a robot that leans on them falls. `what` they do then: "are limp".
void doubt_unnamed(const Model& model, const Settings& kp, const std::string& what);

/// Of a map as read_joint_values() takes it: where the value of actuated joint k stands, the last entry that names it.
/// Else: `settings`.
Settings joint_entry(const Model& model, const Settings& settings, int k);

/// A joint that is to begin or to go somewhere.
struct JointRoom {
  std::string name;
  double lower, upper;  // position limits, rad or m
  bool turns;
};

/// Warns at `typed` of a position q that lies beyond the joint's limits by more than a hundredth of their range (and
/// 1e-3), with the unit that may have been meant if none was typed. All positions are doubted by this rule.
void doubt_position(const Settings& typed, const JointRoom& room, double q);
/// The same of targets [low, high] of actuated joint k. `typed`: the amplitude that they come from, or a table's name.
void doubt_targets(const Model& model, int k, double low, double high, const Settings& typed);

}  // namespace graze
