#pragma once
// `gear` and `rotor_inertia` of `actuators`: what the drives' rotors add to the inertia of their joints.

#include <string>

#include "engine/model/world.h"
#include "engine/settings/settings.h"

namespace graze {

/// Fills Joint::gear and Joint::rotor_inertia of the robot's driven joints. Warns of gears without rotors, which do
/// nothing. Throws InputError, also where `physics`, the back end, knows no rotors, then with the place of any of these
/// keys and of their paths under `uncertain`.
void read_rotors(const Settings& scenario, const std::string& physics, World& world);

}  // namespace graze
