#pragma once
// How a robot whose URDF says nothing of it begins: bolted to the world, as arms are, or on bent legs.

#include <array>

#include "engine/dynamics/chain.h"
#include "engine/model/model.h"

namespace graze {

/// How many joints stand in a row on the root link before the chain branches, if the robot looks like an arm that is
/// bolted down: nothing else hangs on the root; the chain has at least three joints and does not hang below the root,
/// as a leg does, where the robot begins; and the root has no mass of its own, is called a base, or is what the chain
/// rises from. 0: it does not. `model`: compiled from `robot` with a floating base.
int joints_of_bolted_arm(const Robot& robot, const Model& model, const State& initial);

/// The last two of a leg's three angles, within limits, with its foot below its hip at 0.85 of what it reaches down to.
std::array<double, 2> bent_leg(const Chain& leg, Chain::Values angles, const std::array<double, 2>& low,
                               const std::array<double, 2>& high);

}  // namespace graze
