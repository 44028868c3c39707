#pragma once
// A convex hull on a plane or on terrain: of the corners within reach those on which it may come to lie within the
// step. These are the corners that lie furthest in eight directions, each tilted from the ground by as much as the hull
// may turn, and the deepest. The directions belong to the hull's frame, so that slots stay while it rocks or slides.

#include "engine/contact/heightfield.h"
#include "engine/contact/reach.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline Vec3T<T> hull_corner(const ShapeT<T>& shape, int k) {
  const HullView& hull = *shape.hull;
  return {T(hull.x[k]) * shape.size.x, T(hull.y[k]) * shape.size.y, T(hull.z[k]) * shape.size.z};
}

/// Two axes across n that turn with R, by the one of its axes that lies most across. Turned by 19.3 degrees from that:
/// then no two corners of a box, a regular prism or the like are as far as each other in one of eight directions, where
/// rounding would choose.
template <class T>
struct AcrossT {
  Vec3T<T> x, y;

  AcrossT(const RotT<T>& R, const Vec3T<T>& n) {
    constexpr double kClearly = 0.1;  // so that the choice does not flicker
    constexpr double kCosine = 0.94380095158322937, kSine = 0.3305143927132231;
    Vec3T<T> axis = R.column(0);
    for (int k = 1; k < 3; ++k) {
      const Vec3T<T> other = R.column(k);
      axis = select(abs(dot(other, n)) < abs(dot(axis, n)) - T(kClearly), other, axis);
    }
    const Vec3T<T> across = axpy(-dot(n, axis), n, axis);
    const Vec3T<T> along = recip(sqrt(norm2(across))) * across, aside = cross(n, along);
    x = axpy(T(kSine), aside, T(kCosine) * along);
    y = axpy(T(-kSine), along, T(kCosine) * aside);
  }
};

/// A reach of nothing (m), beside which everything is steep.
inline constexpr double kLeastReach = 1e-6;

/// Chooses up to eight of the points that it is shown, one after another: each lies furthest in a direction that is
/// tilted from the contact's plane by what the smaller body may turn within the step. None of its points goes further
/// than the contact's reach, so that is the reach over its radius. A point that hovers beyond has no impulse.
template <class T>
class SpreadT {
 public:
  /// `radius`: of the smaller body; `reach`: within which points are shown, m.
  SpreadT(const AcrossT<T>& across, const T& radius, const T& reach)
      : across_(across), steep_(radius * recip(max(reach, T(kLeastReach)))), further_(T(kOnePoint) * radius) {
    for (int k = 0; k < kWays; ++k) most_[k] = T(-1e300), number_[k] = T(-1.0);
  }

  /// Point number `number` in the lanes of `near`; p lies in the middle between both surfaces.
  void show(int number, const mask_of<T>& near, const T& phi, const Vec3T<T>& p, const Vec3T<T>& n) {
    const PointAt point{phi, p, n};
    choose(number, near, phi, dot(across_.x, p), dot(across_.y, p),
           [&](const mask_of<T>& where, PointAt& to) { take(where, point, to); });
  }

  /// Chooses by numbers only: whoever shows points so fills them in before write(). x, y: along the axes across, m.
  void show_number(int number, const mask_of<T>& near, const T& phi, const T& x, const T& y) {
    choose(number, near, phi, x, y, [](const mask_of<T>&, PointAt&) {});
  }
  /// `fill(number, phi, p, n)` for those that were chosen, of which lanes may have different ones; -1: none.
  template <class Fill>
  void fill(const Fill& fill) {
    for (int k = 0; k < kWays; ++k) {
      if (any(is_fresh(k))) fill(number_[k], best_[k].phi, best_[k].p, best_[k].n);
    }
    if (any(deepest_number_ >= T(0.0))) fill(deepest_number_, deepest_.phi, deepest_.p, deepest_.n);
  }

  /// The point that lies furthest in direction k of 8 is in slot k, if it is not in one before; the deepest has its own
  /// gap in the slot of the deepest of these.
  void write(ManifoldT<T>& out) const {
    out.count = kWays;
    T least(1e300), slot(-1.0);
    for (int k = 0; k < kWays; ++k) {
      const mask_of<T> fresh = is_fresh(k);
      const Vec3T<T> up{T(0.0), T(0.0), T(1.0)};
      const PointAt& point = best_[k];
      put<T>(out, k, point.phi, point.p, select(fresh, point.n, up), fresh);
      const mask_of<T> deeper = fresh & (point.phi < least);
      least = select(deeper, point.phi, least);
      slot = select(deeper, T(k), slot);
    }
    // On faces that are parallel but for the tolerance the slot's place is as good, and steadier.
    constexpr double kSteep = 1e-3;
    for (int k = 0; k < kWays; ++k) {
      const mask_of<T> here = (slot == T(k)) & (deepest_.phi < least - T(kSamePoint));
      const Vec3T<T> own = best_[k].p;
      const mask_of<T> elsewhere = least - deepest_.phi > T(kSteep) * sqrt(norm2(deepest_.p - own));
      put_where<T>(out, k, here, deepest_.phi, select(elsewhere, deepest_.p, own), deepest_.n);
    }
  }

 private:
  static constexpr int kWays = 8;
  static constexpr double kOnePoint = 1e-3;  // share of the radius by which another point must lie further
  struct PointAt {
    T phi{1e300};
    Vec3T<T> p{T(0.0), T(0.0), T(0.0)}, n{T(0.0), T(0.0), T(1.0)};
  };
  /// `take(where, point)` puts what is shown in the place of a point.
  template <class Take>
  void choose(int number, const mask_of<T>& near, const T& phi, const T& x, const T& y, const Take& take) {
    constexpr double kDiagonal = 0.70710678118654752;
    const T plus = T(kDiagonal) * (x + y), minus = T(kDiagonal) * (y - x), hover = steep_ * phi;
    const T along[kWays] = {x, plus, y, minus, -x, -plus, -y, -minus};
    for (int k = 0; k < kWays; ++k) {
      const T far = along[k] - hover;
      const mask_of<T> further = near & (far > most_[k] + further_);
      most_[k] = select(further, far, most_[k]);
      number_[k] = select(further, T(number), number_[k]);
      take(further, best_[k]);
    }
    const mask_of<T> deeper = near & (phi < deepest_.phi);
    deepest_.phi = select(deeper, phi, deepest_.phi);
    deepest_number_ = select(deeper, T(number), deepest_number_);
    take(deeper, deepest_);
  }
  /// Whether the point of direction k is not in a slot before.
  mask_of<T> is_fresh(int k) const {
    mask_of<T> fresh = number_[k] >= T(0.0);
    for (int j = 0; j < k; ++j) fresh = fresh & !(number_[j] == number_[k]);
    return fresh;
  }
  static void take(const mask_of<T>& where, const PointAt& from, PointAt& to) {
    to.phi = select(where, from.phi, to.phi);
    to.p = select(where, from.p, to.p);
    to.n = select(where, from.n, to.n);
  }

  const AcrossT<T>& across_;
  T steep_, further_;
  T most_[kWays], number_[kWays], deepest_number_{-1.0};
  PointAt best_[kWays], deepest_;
};

template <class T>
inline void nothing(ManifoldT<T>& out) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)}, up{T(0.0), T(0.0), T(1.0)};
  out.count = 8;
  for (int k = 0; k < out.count; ++k) put<T>(out, k, T(0.0), zero, up, mask_from_bits<T>(0));
}

template <class T>
inline void hull_plane(const ShapeT<T>& a, const PoseT<T>& Xa, const PoseT<T>& Xb, const T& margin, ManifoldT<T>& out) {
  const Vec3T<T> n = Xb.R.column(2), down = -transposed_times(Xa.R, n);
  const T height = dot(n, Xa.p - Xb.p);
  constexpr double kRounding = 1e-12;  // of the bound against the corners' own gaps, of the lengths
  const T least = height - reach_of_hull(*a.hull, a.size, down);
  if (bits(least - T(kRounding) * (abs(height) + abs(least)) < margin) == 0) return nothing(out);
  const AcrossT<T> across(Xa.R, n);
  SpreadT<T> spread(across, radius_of_shape(kinds::mesh, a), margin);
  const Vec3T<T> x = transposed_times(Xa.R, across.x), y = transposed_times(Xa.R, across.y);
  for (int k = 0; k < a.hull->count; ++k) {
    const Vec3T<T> corner = hull_corner(a, k);
    const T phi = height - dot(down, corner);
    const mask_of<T> near = phi < margin;
    if (any(near)) spread.show_number(k, near, phi, dot(x, corner), dot(y, corner));
  }
  spread.fill([&](const T& number, T& phi, Vec3T<T>& p, Vec3T<T>& normal) {
    const Vec3T<T> corner = corners_at(*a.hull, a.size, max(number, T(0.0)));
    const T gap = height - dot(down, corner);
    const mask_of<T> known = number >= T(0.0);
    phi = select(known, gap, phi);
    p = select(known, axpy(T(-0.5) * gap, n, Xa * corner), p);
    normal = n;
  });
  spread.write(out);
}

/// Greatest height of the terrain under a ball, terrain's frame.
inline double highest_under(const Terrain& terrain, const Point3& x, double radius) {
  const CellRange cells = cells_near(terrain, x, radius);
  double highest = -1e300;
  for (int iy = cells.y0; iy <= cells.y1 + 1; ++iy) {
    for (int ix = cells.x0; ix <= cells.x1 + 1; ++ix) highest = max(highest, terrain.vertex(ix, iy).z);
  }
  return highest;
}

/// Of a ball about the hull's origin.
template <class T>
inline T radius_of_hull(const ShapeT<T>& shape) {
  T most(0.0);
  for (int k = 0; k < shape.hull->count; ++k) most = max(norm2(hull_corner(shape, k)), most);
  return sqrt(most);
}

/// Each corner has the normal of the triangle that it is nearest to.
template <class T>
inline void hull_heightfield(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                             const T& margin, ManifoldT<T>& out) {
  constexpr int W = kWidth<T>;
  const PoseT<T> X_TA{transposed_times(Xb.R, Xa.R), transposed_times(Xb.R, Xa.p - Xb.p)};
  const T reach = max(margin, T(0.0)), radius = radius_of_hull(a) + reach;
  double top[W];
  for (int lane = 0; lane < W; ++lane) {
    top[lane] = highest_under(terrain_of(b, lane), lane_of(X_TA.p, lane), lane_of(radius, lane));
  }
  const T highest = load<T>(top) + reach;
  const AcrossT<T> across(Xa.R, Xb.R.column(2));
  SpreadT<T> spread(across, radius_of_shape(kinds::mesh, a), reach);
  for (int k = 0; k < a.hull->count; ++k) {
    const Vec3T<T> corner = hull_corner(a, k), x = X_TA * corner;
    const unsigned low = bits(x.z <= highest);
    if (low == 0) continue;
    LaneNearestT<T> nearest;
    for (int lane = 0; lane < W; ++lane) {
      nearest.clear(lane);
      if (!(low >> lane & 1u)) continue;
      const BallOnTerrain found = nearest_on_terrain(terrain_of(b, lane), lane_of(x, lane), lane_of(reach, lane));
      if (found.count > 0) nearest.set(lane, found.found[0]);
    }
    const NearestT<T> at = to_world(Xb, nearest.all());
    const mask_of<T> near = mask_from_bits<T>(nearest.known) & (at.d < margin);
    if (bits(near) != 0) spread.show(k, near, at.d, axpy(T(-0.5) * at.d, at.n, Xa * corner), at.n);
  }
  spread.write(out);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
