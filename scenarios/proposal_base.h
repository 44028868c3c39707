#pragma once
// Whether a robot whose URDF says nothing of it is bolted to the world, as arms are.

#include "engine/model/model.h"

namespace graze {

/// How many joints stand in a row on the root link before the chain branches, if the robot looks like an arm that is
/// bolted down: nothing else hangs on the root; the chain has at least three joints and does not hang below the root,
/// as a leg does, where the robot begins; and the root has no mass of its own, is called a base, or is what the chain
/// rises from. 0: it does not. `model`: compiled from `robot` with a floating base.
int joints_of_bolted_arm(const Robot& robot, const Model& model, const State& initial);

}  // namespace graze
