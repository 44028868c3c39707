#include "engine/clearance/terrain_gap.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/contact/heightfield.h"

namespace graze {
namespace {

/// An axis-aligned box in the terrain's frame.
struct Bounds {
  Vec3 low, high;

  double distance(const Bounds& other) const {
    const Vec3 apart = (low - other.high).cwiseMax(other.low - high).cwiseMax(Vec3::Zero());
    return apart.norm();
  }
};

Bounds bounds_of(const Convex& shape) {
  Bounds out;
  for (int k = 0; k < 3; ++k) {
    out.high[k] = shape.reach(Vec3::Unit(k));
    out.low[k] = -shape.reach(-Vec3::Unit(k));
  }
  return out;
}

/// Two gaps that differ by less (m) are the same, so that flat ground asks for one triangle, not for all.
constexpr double kSame = 1e-12;

}  // namespace

TerrainGap gap_above_terrain(const Convex& shape, const HeightView& grid, const Vec3& size, const Pose& X_WT,
                             double below) {
  Convex local = shape;
  local.X = X_WT.inverse() * shape.X;
  const Bounds box = bounds_of(local);
  const Terrain terrain{&grid, {size.x(), size.y(), size.z()}};
  const Vec3 middle = 0.5 * (box.low + box.high), half = 0.5 * (box.high - box.low);
  const CellRange cells =
      cells_near(terrain, {middle.x(), middle.y(), middle.z()}, std::max(half.x(), half.y()) + std::max(below, 0.0));
  TerrainGap out{below, X_WT * middle};
  for (int iy = cells.y0; iy <= cells.y1; ++iy) {
    for (int ix = cells.x0; ix <= cells.x1; ++ix) {
      std::array<Vec3, 4> corner;
      for (int k = 0; k < 4; ++k) {
        const Point3 v = terrain.vertex(ix + (k & 1), iy + (k >> 1));
        corner[k] = {v.x, v.y, v.z};
      }
      for (const std::array<int, 3>& of : {std::array{0, 1, 2}, std::array{3, 2, 1}}) {
        const Vec3 &a = corner[of[0]], &b = corner[of[1]], &c = corner[of[2]];
        if (box.distance({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)}) >= out.gap - kSame) continue;
        const Vec3 centre = (a + b + c) / 3;
        const Corners corners({a - centre, b - centre, c - centre});
        Convex triangle{ShapeKind::mesh, Vec3::Ones(), Pose::Identity(), &corners};
        triangle.X.translation() = centre;
        const Gap gap = gap_between(local, triangle);
        if (gap.phi < out.gap - kSame) out = {std::max(gap.phi, 0.0), X_WT * gap.p_a};
      }
    }
  }
  return out;
}

}  // namespace graze
