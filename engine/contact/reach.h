#pragma once
// How far shapes reach along a direction: support functions on lanes.

#include "engine/contact/cylinder_gap.h"
#include "engine/contact/manifold.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// max of n . x over the corners of a hull in its own frame; n of any length. Every corner is looked at, in all lanes
/// the same ones.
template <class T>
inline T reach_of_hull(const HullView& hull, const Vec3T<T>& size, const Vec3T<T>& n) {
  const T nx = n.x * size.x, ny = n.y * size.y, nz = n.z * size.z;
  const auto along = [&](int k) { return fma(T(hull.z[k]), nz, fma(T(hull.y[k]), ny, T(hull.x[k]) * nx)); };
  // Four sums side by side, as each waits for the one before it; the greatest of all does not depend on that.
  constexpr int kSide = 4;
  T most[kSide] = {T(-1e300), T(-1e300), T(-1e300), T(-1e300)};
  int k = 0;
  for (; k + kSide <= hull.count; k += kSide) {
    for (int i = 0; i < kSide; ++i) most[i] = max(along(k + i), most[i]);
  }
  for (; k < hull.count; ++k) most[0] = max(along(k), most[0]);
  return max(max(most[0], most[1]), max(most[2], most[3]));
}

/// The corner of a hull, in its own frame, whose number each lane has.
template <class T>
inline Vec3T<T> corners_at(const HullView& hull, const Vec3T<T>& size, const T& number) {
  constexpr int W = kWidth<T>;
  double numbers[W], x[W], y[W], z[W];
  store(numbers, number);
  for (int lane = 0; lane < W; ++lane) {
    const int corner = static_cast<int>(numbers[lane]);
    x[lane] = hull.x[corner], y[lane] = hull.y[corner], z[lane] = hull.z[corner];
  }
  return {load<T>(x) * size.x, load<T>(y) * size.y, load<T>(z) * size.z};
}

/// Radius of a ball about the shape's origin that holds it, m. Of a hull without a look at its corners: more than
/// needed where its scales differ. Not for planes and terrain.
template <class T>
inline T radius_of_shape(ShapeKind kind, const ShapeT<T>& shape) {
  const Vec3T<T>& s = shape.size;
  if (kind == kinds::sphere) return s.x;
  if (kind == kinds::capsule) return fma(T(0.5), s.y, s.x);
  if (kind == kinds::cylinder) return sqrt(fma(s.x, s.x, T(0.25) * s.y * s.y));
  if (kind == kinds::box) return T(0.5) * sqrt(norm2(s));
  return T(shape.hull->radius) * max(max(abs(s.x), abs(s.y)), abs(s.z));
}

/// How far a shape reaches from its origin along the unit vector n (world), m. Not for planes and terrain.
template <class T>
inline T reach_of_shape(ShapeKind kind, const ShapeT<T>& shape, const PoseT<T>& X, const Vec3T<T>& n) {
  const Vec3T<T>& s = shape.size;
  if (kind == kinds::sphere) return s.x;
  if (kind == kinds::mesh) return reach_of_hull(*shape.hull, s, transposed_times(X.R, n));
  if (kind == kinds::box) {
    const Vec3T<T> local = transposed_times(X.R, n);
    return T(0.5) * fma(abs(local.x), s.x, fma(abs(local.y), s.y, abs(local.z) * s.z));
  }
  const Vec3T<T> u = X.R.column(2);
  if (kind == kinds::capsule) return fma(T(0.5) * s.y, abs(dot(n, u)), s.x);
  return reach_along(CylinderT<T>{X.p, u, s.x, T(0.5) * s.y}, n);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
