#pragma once
// What the robot weighs: thresholds of its controllers and readings of its sensors are shares of that, whatever else
// lies about in its world.

#include "engine/model/model.h"

namespace graze {

/// Mass of the robot's moving bodies, kg, without movable objects. What is welded to the world is in no body.
double robot_mass(const Model& model);

/// Its weight, N: robot_mass times the magnitude of gravity.
double robot_weight(const Model& model);

}  // namespace graze
