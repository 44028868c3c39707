#pragma once
// Manifolds of convex shapes by a way of their own, which the kernels of hulls are held against: up to eight points.
// The gap is that of convex_gap.h; where faces, sides or edges lie on each other, one is clipped to the other and the
// points that reach furthest in eight directions stay. The eight directions belong to a, so that slots stay.

#include <array>

#include "engine/contact/convex_gap.h"
#include "engine/contact/manifold.h"

namespace graze {

struct ManifoldPoint {
  bool valid = false;
  double phi = 0;
  Vec3 p = Vec3::Zero(), n = Vec3::UnitZ();  // as ContactPointT
};
using ConvexManifold = std::array<ManifoldPoint, 8>;

/// Points nearer than `margin`.
ConvexManifold touch_convex(const Convex& a, const Convex& b, double margin);

}  // namespace graze
