#pragma once
// Convex shapes as GJK sees them, on lanes: a core and a radius around it. A sphere's core is a point and a capsule's a
// segment, so that both are exact.

#include "engine/contact/heightfield.h"
#include "engine/contact/reach.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Number of the corner that lies furthest along n, of several the first; all lanes at a time.
template <class T>
inline T furthest_in_all_lanes(const HullView& hull, const Vec3T<T>& n) {
  constexpr int kSide = 4;  // sums side by side, as each waits for the one before it
  T most[kSide], number[kSide];
  for (int i = 0; i < kSide; ++i) most[i] = T(-1e300), number[i] = T(0.0);
  T at(0.0);  // number of the corner that side 0 looks at
  const auto look = [&](int k, int i) {
    const T along = fma(T(hull.z[k]), n.z, fma(T(hull.y[k]), n.y, T(hull.x[k]) * n.x));
    const mask_of<T> further = along > most[i];
    most[i] = select(further, along, most[i]);
    number[i] = select(further, at + T(i), number[i]);
  };
  int k = 0;
  for (; k + kSide <= hull.count; k += kSide, at += T(kSide)) {
    for (int i = 0; i < kSide; ++i) look(k + i, i);
  }
  for (; k < hull.count; ++k, at += T(1.0)) look(k, 0);
  for (int i = 1; i < kSide; ++i) {
    const mask_of<T> further = (most[i] > most[0]) | ((most[i] == most[0]) & (number[i] < number[0]));
    most[0] = select(further, most[i], most[0]);
    number[0] = select(further, number[i], number[0]);
  }
  return number[0];
}

/// The same number for one lane, many corners at a time: first how far the furthest lies, then which is the first that
/// lies there, as a number that is carried along would make each turn wait for the one before it.
inline int furthest_in_one_lane(const HullView& hull, const Vec3T<double>& n) {
  constexpr int kSide = HullView::kSide;
  using Side = Pack<kSide>;
  const Side nx(n.x), ny(n.y), nz(n.z);
  const auto along = [&](int k) {
    return fma(load<Side>(hull.z + k), nz, fma(load<Side>(hull.y + k), ny, load<Side>(hull.x + k) * nx));
  };
  Side most(-1e300);
  for (int k = 0; k < hull.count; k += kSide) most = max(along(k), most);
  double side[kSide];
  store(side, most);
  const double furthest =
      max(max(max(side[0], side[1]), max(side[2], side[3])), max(max(side[4], side[5]), max(side[6], side[7])));
  for (int k = 0; k < hull.count; k += kSide) {
    const unsigned there = bits(along(k) == Side(furthest));
    if (there != 0) return k + __builtin_ctz(there);
  }
  return 0;  // n is no direction
}

/// The corner of a hull that lies furthest along n (hull's frame, any length), in `lanes`; in others any corner. A few
/// lanes are looked at one by one: pairs of hulls are near each other in few at a time.
template <class T>
inline Vec3T<T> furthest_corner(const HullView& hull, const Vec3T<T>& size, const Vec3T<T>& n,
                                const mask_of<T>& lanes) {
  constexpr int W = kWidth<T>;
  const unsigned wanted = bits(lanes);
  const Vec3T<T> scaled{n.x * size.x, n.y * size.y, n.z * size.z};
  // What one lane costs beside its corners is about as much as 48 of them.
  if (W == 1 || __builtin_popcount(wanted) * (hull.count + 48) < HullView::kSide * hull.count) {
    double numbers[W];
    for (int lane = 0; lane < W; ++lane) {
      numbers[lane] = wanted >> lane & 1u ? furthest_in_one_lane(hull, lane_of(scaled, lane)) : 0;
    }
    return corners_at(hull, size, load<T>(numbers));
  }
  return corners_at(hull, size, furthest_in_all_lanes<T>(hull, scaled));
}

/// A shape where it stands, in the axes of the world and from an origin that both of a pair share.
template <class T>
struct CoreT {
  ShapeKind kind;
  ShapeT<T> shape;
  PoseT<T> X;

  /// Radius that surrounds the core, m.
  T rounding() const { return kind == kinds::sphere || kind == kinds::capsule ? shape.size.x : T(0.0); }

  /// Of a ball about the shape's origin that holds it, m.
  T radius() const { return radius_of_shape(kind, shape); }

  /// Point of the core that is furthest along n, of any length; in `lanes`, elsewhere some point.
  Vec3T<T> support(const Vec3T<T>& n, const mask_of<T>& lanes) const {
    const Vec3T<T>& s = shape.size;
    if (kind == kinds::sphere) return X.p;
    const Vec3T<T> local = transposed_times(X.R, n);
    if (kind == kinds::mesh) return X * furthest_corner(*shape.hull, s, local, lanes);
    const T half(0.5), end = half * s.y * sign(local.z);
    if (kind == kinds::capsule) return axpy(end, X.R.column(2), X.p);
    if (kind == kinds::cylinder) {
      const T across = sqrt(fma(local.x, local.x, local.y * local.y));
      const mask_of<T> some = across > T(1e-150);
      const T scale = select(some, s.x * recip(select(some, across, T(1.0))), T(0.0));
      return X * Vec3T<T>{scale * local.x, scale * local.y, end};
    }
    return X * Vec3T<T>{half * s.x * sign(local.x), half * s.y * sign(local.y), half * s.z * sign(local.z)};
  }
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
