#pragma once
// What inverse dynamics can be told, but hardly meant to be.

#include <vector>

#include "engine/model/model.h"
#include "engine/settings/description.h"

namespace graze {

/// Warns of gains with which joints that move as they are asked to, v += h (kp error - kd v), swing up from control
/// step to control step: stable are kd h < 2 and kp h^2 + 2 kd h < 4. kp, kd: per actuated joint, 1/s^2 and 1/s;
/// period: h, s.
void doubt_gains(const Model& model, const Described& own, const std::vector<double>& kp, const std::vector<double>& kd,
                 double period);
/// Warns of joints without a limit of torque: where contacts contradict what they are told, nothing else bounds it.
void doubt_efforts(const Model& model, const Described& own);

}  // namespace graze
