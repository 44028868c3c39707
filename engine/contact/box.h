#pragma once
// A box on a plane: its eight corners.

#include "engine/contact/sphere.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Corner k of 8: bit j of k chooses the face along axis j.
template <class T>
inline Vec3T<T> box_corner(const Vec3T<T>& half, int k) {
  return {k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y, k & 4 ? half.z : -half.z};
}

template <class T>
inline void box_plane(const ShapeT<T>& a, const PoseT<T>& Xa, const PoseT<T>& Xb, const T& margin, ManifoldT<T>& out) {
  out.count = 8;
  const Vec3T<T> half = T(0.5) * a.size;
  for (int k = 0; k < 8; ++k) {
    const Vec3T<T> x = Xa * box_corner(half, k);
    put_ball(out, k, x, T(0.0), nearest_on_plane(x, Xb), margin);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
