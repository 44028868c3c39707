#pragma once
// What graze check says of a robot: its mass, shapes, joints and their limits.

#include <nlohmann/json.hpp>
#include <string>

#include "scenarios/scenario.h"

namespace graze {

/// "12 capsules, 5 spheres, 1 plane", of the robot and its environment.
std::string shapes_text(const Model& model);

/// name, mass (kg), floating, links, size (m, of the box about it as it begins), joints (of each: name, kind, lower,
/// upper, effort, velocity, damping, gear, rotor_inertia (kg m^2), reflected_inertia (of the rotor, as the joint feels
/// it), initial; in rad or m and what follows from them; null: no limit), shapes (how many of each kind, with those of
/// the environment), pairs (that may touch).
nlohmann::json robot_as_json(const Scenario& scenario);

}  // namespace graze
