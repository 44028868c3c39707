#pragma once
// What contact sees of a mesh: its convex hull, with so few corners that looking at all of them is quick.

#include <limits>
#include <memory>

#include "engine/model/world.h"

namespace graze {

/// How far a mesh's hull may be simplified. Corners are left out, none is moved: the simpler hull lies within the whole
/// one, so that the error has one side.
struct HullSettings {
  std::size_t vertices = 128;  // at most; so many may leave a larger error than the next line
  double error = std::numeric_limits<double>::quiet_NaN();  // m, at most; NaN: the smaller of 1 mm and 1 % of the size
  bool exact = false;                                       // all corners

  static constexpr std::size_t kFewest = 8;  // a bound below that is none
};

/// The hull for contact of a convex hull `whole` (convex_hull.h) at this scale. Corners are taken furthest-first from
/// what those before span, until the rest lies within the error; so extreme corners stay, and the faces on which a
/// thing rests. Hulls of up to 32 corners stay whole. The same input gives the same corners in the same order.
std::shared_ptr<const Hull> simplified_hull(const Mesh& whole, const Vec3& scale, const HullSettings& settings);

/// Of a mesh shape: its hull, or one of all corners where it has none. Never null: of a flat mesh all vertices.
std::shared_ptr<const Hull> hull_of(const Shape& shape);

}  // namespace graze
