#pragma once
// What the robot weighs and how large it is, whatever else lies about in its world: thresholds of its controllers are
// shares of its weight, and a length that is many times its size was hardly meant.

#include "engine/model/model.h"

namespace graze {

/// Mass of the robot's moving bodies, kg, without movable objects. What is welded to the world is in no body.
double robot_mass(const Model& model);

/// Its weight, N: robot_mass times the magnitude of gravity.
double robot_weight(const Model& model);

/// Edges of the box along the world's axes that holds the robot's collision shapes and the origins of its links, m.
Vec3 robot_extent(const Model& model, const State& state);

}  // namespace graze
