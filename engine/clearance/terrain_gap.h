#pragma once
// The exact gap of a convex shape above terrain. The contact kernels meet terrain with corners, rims and grid points,
// which misses two edges that cross.

#include "engine/contact/convex_gap.h"
#include "engine/contact/manifold.h"

namespace graze {

/// A gap above the terrain with its point on the shape (world); the terrain's frame is X_WT.
struct TerrainGap {
  double gap;  // m; 0 where a triangle cuts the shape
  Vec3 p_W;
};

/// The gap, if it is less than `below`; else `below`. `size`: as Shape::size of a heightfield.
TerrainGap gap_above_terrain(const Convex& shape, const HeightView& grid, const Vec3& size, const Pose& X_WT,
                             double below);

}  // namespace graze
