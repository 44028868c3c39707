#pragma once
// <mimic>: joints that follow others.

#include "engine/model/urdf_outline.h"

namespace graze {

/// Leads what each joint is written to follow to a joint that follows none: of a joint that follows one that follows a
/// third, multiplier and offset are put together. Tells `problems` where there is no such joint (an unknown, fixed or
/// free one, a ring of joints), where the multiplier is 0 or out of range, and where the limits of both leave no
/// position; a repair removes the <mimic>.
void settle_mimics(UrdfOutline& outline, UrdfProblems& problems);

}  // namespace graze
