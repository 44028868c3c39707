#pragma once
// The inner loop of the collision benchmark, compiled once per instruction set.

#include "engine/contact/manifold.h"

namespace graze {

/// Doubles per block of 8 lanes: size (3) and pose (12) of a, then of b.
inline constexpr int kCollideRows = 30;

/// Collides all blocks once; returns the number of valid points of all lanes. `terrain`: one for each lane.
long collide_blocks_portable(ShapeKind a, ShapeKind b, const HeightView* terrain, const double* data, int blocks);
long collide_blocks_avx2(ShapeKind a, ShapeKind b, const HeightView* terrain, const double* data, int blocks);
long collide_blocks_avx512(ShapeKind a, ShapeKind b, const HeightView* terrain, const double* data, int blocks);

}  // namespace graze
