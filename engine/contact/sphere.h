#pragma once
// A sphere against plane, sphere, capsule, cylinder and box: one point, exact.

#include "engine/contact/nearest.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Slot k from a ball of radius r at x and what is nearest to x (world).
template <class T>
inline void put_ball(ManifoldT<T>& out, int k, const Vec3T<T>& x, const T& r, const NearestT<T>& nearest,
                     const T& margin, const mask_of<T>& wanted) {
  const T phi = nearest.d - r;
  put<T>(out, k, phi, axpy(-fma(T(0.5), phi, r), nearest.n, x), nearest.n, wanted & (phi < margin));
}
template <class T>
inline void put_ball(ManifoldT<T>& out, int k, const Vec3T<T>& x, const T& r, const NearestT<T>& nearest,
                     const T& margin) {
  put_ball<T>(out, k, x, r, nearest, margin, mask_from_bits<T>(~0u));
}

template <class T>
inline NearestT<T> to_world(const PoseT<T>& X, const NearestT<T>& local) {
  return {local.d, X.R * local.n};
}

template <class T>
inline void sphere_plane(const ShapeT<T>& a, const PoseT<T>& Xa, const PoseT<T>& Xb, const T& margin,
                         ManifoldT<T>& out) {
  out.count = 1;
  put_ball(out, 0, Xa.p, a.size.x, nearest_on_plane(Xa.p, Xb), margin);
}

template <class T>
inline void sphere_sphere(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                          const T& margin, ManifoldT<T>& out) {
  out.count = 1;
  T length;
  const Vec3T<T> up{T(0.0), T(0.0), T(1.0)};
  const Vec3T<T> n = direction(Xa.p - Xb.p, up, length);
  put_ball(out, 0, Xa.p, a.size.x, NearestT<T>{length - b.size.x, n}, margin);
}

template <class T>
inline void sphere_capsule(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                           const T& margin, ManifoldT<T>& out) {
  out.count = 1;
  const Vec3T<T> axis = Xb.R.column(2), from = Xa.p - Xb.p;
  const T half = T(0.5) * b.size.y;
  const T along = clamp(dot(axis, from), -half, half);
  T length;
  const Vec3T<T> n = direction(axpy(-along, axis, from), Xb.R.column(0), length);
  put_ball(out, 0, Xa.p, a.size.x, NearestT<T>{length - b.size.x, n}, margin);
}

template <class T>
inline void sphere_cylinder(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                            const T& margin, ManifoldT<T>& out) {
  out.count = 1;
  const Vec3T<T> x = transposed_times(Xb.R, Xa.p - Xb.p);
  put_ball(out, 0, Xa.p, a.size.x, to_world(Xb, nearest_on_cylinder<T>(x, b.size.x, T(0.5) * b.size.y)), margin);
}

template <class T>
inline void sphere_box(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb, const T& margin,
                       ManifoldT<T>& out) {
  out.count = 1;
  const Vec3T<T> x = transposed_times(Xb.R, Xa.p - Xb.p);
  put_ball(out, 0, Xa.p, a.size.x, to_world(Xb, nearest_on_box<T>(x, T(0.5) * b.size)), margin);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
