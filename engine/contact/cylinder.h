#pragma once
// A cylinder on a plane: four points of each rim, the first of which is the lowest, so that the gap is exact, a lying
// cylinder has two points on its side and a standing one has four on its cap.

#include "engine/contact/sphere.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Unit vector across the axis that points furthest along `down`; a fixed one where all are alike.
template <class T>
inline Vec3T<T> lowest_across(const RotT<T>& R, const Vec3T<T>& down) {
  // From the components across, not by taking the axial part away: that would leave an axial rest for small slopes.
  const T x = dot(R.column(0), down), y = dot(R.column(1), down);
  const T length = sqrt(fma(x, x, y * y));
  const auto known = length > T(1e-9);
  const T scale = recip(select(known, length, T(1.0)));
  return axpy(select(known, scale * x, T(1.0)), R.column(0), select(known, scale * y, T(0.0)) * R.column(1));
}

/// Rim point k of 8: four per cap, quarter turns from the lowest.
template <class T>
inline Vec3T<T> rim_point(const ShapeT<T>& cylinder, const PoseT<T>& X, const Vec3T<T>& lowest, int k) {
  const Vec3T<T> axis = X.R.column(2);
  const Vec3T<T> across = k % 2 == 0 ? lowest : cross(axis, lowest);
  const T radius = k % 4 < 2 ? cylinder.size.x : -cylinder.size.x;
  const T half = (k < 4 ? T(-0.5) : T(0.5)) * cylinder.size.y;
  return axpy(radius, across, axpy(half, axis, X.p));
}

template <class T>
inline void cylinder_plane(const ShapeT<T>& a, const PoseT<T>& Xa, const PoseT<T>& Xb, const T& margin,
                           ManifoldT<T>& out) {
  out.count = 8;
  const Vec3T<T> lowest = lowest_across(Xa.R, -Xb.R.column(2));
  for (int k = 0; k < 8; ++k) {
    const Vec3T<T> x = rim_point(a, Xa, lowest, k);
    put_ball(out, k, x, T(0.0), nearest_on_plane(x, Xb), margin);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
