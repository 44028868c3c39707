#pragma once
// Robot -> URDF: what a design has become, as a file that any program reads.

#include <string>

#include "engine/model/world.h"

namespace graze {

/// The robot as URDF. Read again it is the same robot: masses, inertias, sizes and limits to the last digit, places up
/// to rounding. Inertias stand at the centre of mass, along the link's axes. A link without pictures is shown by its
/// collision shapes. What URDF has no words for (encoder zeros, gears and rotors, friction of surfaces) is left out.
/// Throws InputError for what a URDF cannot say: collision meshes that were split into convex parts, terrain on a link.
std::string write_urdf(const Robot& robot);

}  // namespace graze
