#pragma once
// Which legs have a closed form of inverse kinematics (leg_ik.h).

#include <optional>

#include "engine/control/leg_ik.h"
#include "engine/dynamics/chain.h"

namespace graze {

/// The geometry of a leg whose first axis is perpendicular to two further, parallel ones; nothing if the chain is not
/// of this shape. Branches (side of the hip, direction of the knee) and the turn in which angles are given are those of
/// `reference`.
std::optional<HipKneeView> detect_hip_knee(const Chain& chain, const Chain::Values& reference);

}  // namespace graze
