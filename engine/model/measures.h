#pragma once
// What the robot weighs and how large it is, whatever else lies about in its world: thresholds of its controllers are
// shares of its weight, and a length that is many times its size was hardly meant.

#include <string>

#include "engine/model/model.h"
#include "engine/model/world.h"

namespace graze {

/// Whether a body of the model is the robot's, not a movable object.
bool is_of_robot(const Model& model, std::size_t body);

/// Mass of the robot's moving bodies, kg, without movable objects. What is welded to the world is in no body.
double robot_mass(const Model& model);

/// Mass of all its links, kg: also of those that are welded to the world.
double whole_mass(const Robot& robot);

/// "1.2 kg", or "1.2 kg, 0.4 kg of it moving" where some of it is welded to the world.
std::string mass_text(const Robot& robot, const Model& model);

/// Its weight, N: robot_mass times the magnitude of gravity.
double robot_weight(const Model& model);

/// Edges of the box along the world's axes that holds the robot's collision shapes and the origins of its links, m; of
/// a robot without any shape, its centres of mass and those origins.
Vec3 robot_extent(const Model& model, const State& state);

}  // namespace graze
