#pragma once
// Signed distance of a point from a shape, with the outward normal at the surface point that is nearest. Exact inside
// and outside. Where the nearest point is not unique (a centre, an axis) the choice is fixed.

#include "engine/contact/manifold.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct NearestT {
  T d;         // m, negative inside
  Vec3T<T> n;  // unit, outward; world or shape's frame as the function says
};

/// Half space below the plane z = 0 of X; world.
template <class T>
inline NearestT<T> nearest_on_plane(const Vec3T<T>& x, const PoseT<T>& X) {
  const Vec3T<T> n = X.R.column(2);
  return {dot(n, x - X.p), n};
}

/// Box of half edges h, in its frame.
template <class T>
inline NearestT<T> nearest_on_box(const Vec3T<T>& x, const Vec3T<T>& h) {
  const T zero(0.0);
  const Vec3T<T> beyond{abs(x.x) - h.x, abs(x.y) - h.y, abs(x.z) - h.z};
  const Vec3T<T> s{sign(x.x), sign(x.y), sign(x.z)};
  const Vec3T<T> out{s.x * max(beyond.x, zero), s.y * max(beyond.y, zero), s.z * max(beyond.z, zero)};
  const T length = sqrt(norm2(out));
  const auto outside = length > T(kNoDirection);
  const auto x_face = (beyond.x >= beyond.y) & (beyond.x >= beyond.z);
  const auto y_face = (!x_face) & (beyond.y >= beyond.z);
  const Vec3T<T> inner{select(x_face, s.x, zero), select(y_face, s.y, zero), select(x_face | y_face, zero, s.z)};
  const T depth = max(max(beyond.x, beyond.y), beyond.z);
  const T scale = recip(select(outside, length, T(1.0)));
  return {select(outside, length, depth), select(outside, scale * out, inner)};
}

/// Cylinder of radius r and half length h about z, in its frame.
template <class T>
inline NearestT<T> nearest_on_cylinder(const Vec3T<T>& x, const T& r, const T& h) {
  const T zero(0.0);
  const T rho = sqrt(fma(x.x, x.x, x.y * x.y));
  const auto off_axis = rho > T(kNoDirection);
  const T scale = recip(select(off_axis, rho, T(1.0)));
  const T cx = select(off_axis, scale * x.x, T(1.0)), cy = select(off_axis, scale * x.y, zero), cz = sign(x.z);
  const T beyond_side = rho - r, beyond_cap = abs(x.z) - h;
  const T side = max(beyond_side, zero), cap = max(beyond_cap, zero);
  const T length = sqrt(fma(side, side, cap * cap));
  const auto outside = length > T(kNoDirection);
  const T inverse = recip(select(outside, length, T(1.0)));
  const auto by_side = beyond_side > beyond_cap;
  const T radial = select(outside, side * inverse, select(by_side, T(1.0), zero));
  const T axial = select(outside, cap * inverse, select(by_side, zero, T(1.0)));
  return {select(outside, length, max(beyond_side, beyond_cap)), {radial * cx, radial * cy, axial * cz}};
}

/// Parameters in [-1, 1] of the nearest points of two segments c + s u (Ericson, Real-Time Collision Detection, 2005,
/// §5.1.9). `w` is the first centre minus the second.
template <class T>
struct SegmentPairT {
  T s, t;
  T sine2;  // of the angle between the segments, squared; 1 when one of them is a point
};
template <class T>
inline SegmentPairT<T> nearest_of_segments(const Vec3T<T>& w, const Vec3T<T>& u, const Vec3T<T>& v) {
  const T one(1.0);
  const T uu = norm2(u), vv = norm2(v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const Vec3T<T> normal = cross(u, v);
  const T area2 = norm2(normal), product = uu * vv;
  const auto points = product < T(1e-40);
  const auto crossing = area2 > T(1e-16) * product;  // else parallel: any s will do for a start
  const T first = fma(uv, vw, -(uw * vv)) * recip(select(crossing, area2, one));
  T s = select(crossing, clamp(first, -one, one), T(0.0));
  const T t = clamp(fma(uv, s, vw) * recip(divisor(vv)), -one, one);
  s = clamp(fma(uv, t, -uw) * recip(divisor(uu)), -one, one);
  return {s, t, select(points, one, area2 * recip(select(points, one, product)))};
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
