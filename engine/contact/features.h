#pragma once
// Which part of a shape a point lies on, by name.

#include "engine/contact_record.h"
#include "engine/model/world.h"

namespace graze {

/// Feature of the point p_G (shape's frame) on the surface of `shape`. `top` and `bottom` are a box's faces along its
/// own +z and -z, `side` the other four; a point within `tolerance` of two faces is on an edge, of three on a vertex.
Feature feature_of(const Shape& shape, const Vec3& p_G, double tolerance = 1e-4);

}  // namespace graze
