#pragma once
// A value per actuated joint from settings: one number for all, or a map of joint globs to numbers.

#include "engine/control/policy.h"

namespace graze {

/// `{"*_Y_*": 20, "LF_X_1": 25}`: in file order, later entries win; joints that no entry names get `fallback`. A glob
/// that matches no actuated joint is refused with the nearest name. na values, SI.
std::vector<double> read_joint_values(const Model& model, const Settings& settings, Quantity quantity, double fallback);
/// The same for an optional key of `settings`.
std::vector<double> read_joint_values_or(const Model& model, const Settings& settings, std::string_view key,
                                         Quantity quantity, double fallback);

/// Names of the actuated joints, in order.
std::vector<std::string> actuated_names(const Model& model);
/// Positions of the actuated joints in a state, in order.
std::vector<double> actuated_positions(const Model& model, const State& state);

/// Gains of a servo: stiffness and damping must not be negative.
std::vector<double> read_gains(const Model& model, const Settings& settings, std::string_view key, Quantity quantity);

/// Warns at `settings` of targets [low, high] of actuated joint k that lie beyond its position limits by a tenth of
/// their range or more, with the unit that may have been meant.
void doubt_targets(const Model& model, int k, double low, double high, const Settings& settings);

}  // namespace graze
