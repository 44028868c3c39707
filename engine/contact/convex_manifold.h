#pragma once
// Manifolds of convex shapes without a kernel: up to eight points, so that a hull or a cylinder can stand on anything.
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

/// `seen` (may be null) becomes the gap; where that is more than the margin, perhaps a bound of it (gap_between).
ConvexManifold touch_convex(const Convex& a, const Convex& b, double margin, Gap* seen = nullptr);

}  // namespace graze
