#pragma once
// Gap of two convex shapes: GJK while they are apart; where they overlap, Bullet's EPA, improved by moving one out of
// the other and looking back. Both see cores: a sphere is a point and a capsule a segment, each with its radius
// outside, so that round shapes are exact and rarely overlap as cores. Nothing is kept between calls. (Bullet's own GJK
// misses the distance of aligned boxes by centimetres now and then.)

#include <limits>

#include "engine/contact/corners.h"
#include "engine/model/world.h"

namespace graze {

/// A convex shape where it stands. `corners`: a mesh's hull, scaled, in the shape's frame.
struct Convex {
  ShapeKind kind;
  Vec3 size;
  Pose X;
  const Corners* corners = nullptr;

  /// Point of the core that is furthest along n (shape's frame, any length).
  Vec3 core_support(const Vec3& n_G) const;
  /// Radius that surrounds the core, m.
  double rounding() const { return kind == ShapeKind::sphere || kind == ShapeKind::capsule ? size.x() : 0; }
  /// max of n . x over the shape, world, |n| = 1.
  double reach(const Vec3& n_W) const;
};

/// Nearest points, or deepest; n unit, from b to a; p_a = p_b + phi n.
struct Gap {
  double phi;
  Vec3 n, p_a, p_b;
};
/// Where the gap is more than `enough`, `phi` may be a bound that is more than `enough`, too, and no more than the gap;
/// then n is the direction that proves it, and the points are some.
Gap gap_between(const Convex& a, const Convex& b, double enough = std::numeric_limits<double>::infinity());

/// n . x over a, least, minus n . x over b, greatest: no greater than the gap, for any unit n.
double separation(const Convex& a, const Convex& b, const Vec3& n);

}  // namespace graze
