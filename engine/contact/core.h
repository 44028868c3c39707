#pragma once
// Convex shapes as GJK sees them, on lanes: a core and a radius around it. A sphere's core is a point and a capsule's a
// segment, so that both are exact.

#include "engine/contact/heightfield.h"
#include "engine/contact/reach.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// The corner of a hull that lies furthest along n (hull's frame, any length), of several always the same one.
template <class T>
inline Vec3T<T> furthest_corner(const HullView& hull, const Vec3T<T>& size, const Vec3T<T>& n) {
  const T nx = n.x * size.x, ny = n.y * size.y, nz = n.z * size.z;
  constexpr int kSide = 4;  // sums side by side, as each waits for the one before it
  T most[kSide], number[kSide];
  for (int i = 0; i < kSide; ++i) most[i] = T(-1e300), number[i] = T(0.0);
  T at(0.0);  // number of the corner that side 0 looks at
  const auto look = [&](int k, int i) {
    const T along = fma(T(hull.z[k]), nz, fma(T(hull.y[k]), ny, T(hull.x[k]) * nx));
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
    const mask_of<T> further = most[i] > most[0];
    most[0] = select(further, most[i], most[0]);
    number[0] = select(further, number[i], number[0]);
  }
  constexpr int W = kWidth<T>;
  double numbers[W], x[W], y[W], z[W];
  store(numbers, number[0]);
  for (int lane = 0; lane < W; ++lane) {
    const int corner = static_cast<int>(numbers[lane]);
    x[lane] = hull.x[corner], y[lane] = hull.y[corner], z[lane] = hull.z[corner];
  }
  return {load<T>(x) * size.x, load<T>(y) * size.y, load<T>(z) * size.z};
}

/// A shape where it stands, in the axes of the world and from an origin that both of a pair share.
template <class T>
struct CoreT {
  ShapeKind kind;
  ShapeT<T> shape;
  PoseT<T> X;

  /// Radius that surrounds the core, m.
  T rounding() const { return kind == kinds::sphere || kind == kinds::capsule ? shape.size.x : T(0.0); }

  /// Point of the core that is furthest along n, of any length.
  Vec3T<T> support(const Vec3T<T>& n) const {
    const Vec3T<T>& s = shape.size;
    if (kind == kinds::sphere) return X.p;
    const Vec3T<T> local = transposed_times(X.R, n);
    if (kind == kinds::mesh) return X * furthest_corner(*shape.hull, s, local);
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
