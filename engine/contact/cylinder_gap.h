#pragma once
// What a cylinder's signed gap from a box or another cylinder is made of. The gap of two convex bodies is the greatest
// separation s(n) over all directions n, whether they are apart or overlap. So the kernels list directions that can be
// the greatest (normals of faces, caps and crossed edges; from corners to sides and rims; across an edge or side to a
// rim), refine those that have no closed form by a fixed number of Newton steps, and take the best.

#include "engine/contact/box_box.h"
#include "engine/contact/capsule.h"
#include "engine/contact/cylinder.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Sine up to which a side counts as lying along a face, an edge or a side.
inline constexpr double kAlongSine = 0.05;
/// Where caps or sides lie on each other, a point this much (m) deeper than those found is another point.
inline constexpr double kSameSupport = 1e-6;
/// So much of a size outside still counts as on the edge.
inline constexpr double kLoose = 1e-6;

/// A solid cylinder in whatever frame the kernel works in.
template <class T>
struct CylinderT {
  Vec3T<T> c, u;  // centre, axis (unit)
  T r, h;         // radius, half length
};

template <class T>
inline T reach_along(const CylinderT<T>& cylinder, const Vec3T<T>& n) {
  return fma(cylinder.r, sqrt(norm2(cross(n, cylinder.u))), cylinder.h * abs(dot(n, cylinder.u)));
}

/// Part of n across the unit vector u, with unit length; 0 where n lies along u.
template <class T>
inline Vec3T<T> unit_across(const Vec3T<T>& n, const Vec3T<T>& u) {
  const Vec3T<T> across = cross(u, cross(n, u));
  const T length = sqrt(norm2(across));
  const auto known = length > T(1e-9);
  return select(known, recip(select(known, length, T(1.0))), T(0.0)) * across;
}

/// Point of the cylinder that is furthest along n: on a rim, or a cap's centre where n lies along the axis.
template <class T>
inline Vec3T<T> furthest(const CylinderT<T>& cylinder, const Vec3T<T>& n) {
  const T end = sign(dot(n, cylinder.u)) * cylinder.h;
  return axpy(cylinder.r, unit_across(n, cylinder.u), axpy(end, cylinder.u, cylinder.c));
}

/// Nearest point of the solid cylinder.
template <class T>
inline Vec3T<T> nearest_in(const CylinderT<T>& cylinder, const Vec3T<T>& x) {
  const Vec3T<T> from = x - cylinder.c;
  const T along = dot(from, cylinder.u);
  const Vec3T<T> across = axpy(-along, cylinder.u, from);
  const T rho = sqrt(norm2(across));
  const T scale = min(T(1.0), cylinder.r * recip(max(rho, T(1e-12))));
  return axpy(clamp(along, -cylinder.h, cylinder.h), cylinder.u, axpy(scale, across, cylinder.c));
}

/// Outward unit normal (x, y) of the ellipse x^2 + (y / b)^2 = 1, 0 < b <= 1, at the boundary point nearest to p, which
/// may be inside. Three steps along circles of curvature (the error falls to some 1e-3 rad).
template <class T>
inline void ellipse_normal(const T& px, const T& py, const T& b, T& x, T& y) {
  const T one(1.0), zero(0.0), inverse_b = recip(b), bulge = fnma(b, b, one);
  const T ax = max(abs(px), T(1e-9)), ay = abs(py);  // the centre has no nearest point: take one
  T tx(0.7071067811865476), ty = tx;
  for (int i = 0; i < 3; ++i) {
    const T ex = bulge * tx * tx * tx, ey = -(bulge * inverse_b) * ty * ty * ty;  // centre of curvature
    const T rx = tx - ex, ry = fma(b, ty, -ey), qx = ax - ex, qy = ay - ey;
    const T ratio = sqrt(fma(rx, rx, ry * ry) * recip(max(fma(qx, qx, qy * qy), T(1e-30))));
    tx = clamp(fma(qx, ratio, ex), zero, one);
    ty = clamp(fma(qy, ratio, ey) * inverse_b, zero, one);
    const T scale = recip(sqrt(max(fma(tx, tx, ty * ty), T(1e-30))));
    tx *= scale;
    ty *= scale;
  }
  const T nx = b * tx, scale = recip(sqrt(max(fma(nx, nx, ty * ty), T(1e-30))));
  x = sign(px) * nx * scale;
  y = sign(py) * ty * scale;
}

/// A rim that is seen along a direction e: its separation n . w - r |n x u| from the point that the rest of both bodies
/// makes there, for n across e.
template <class T>
struct ArcT {
  T gap;          // s(n), of the whole bodies
  Vec3T<T> n, e;  // unit
  Vec3T<T> w;     // from the point to the rim's centre
};

/// Takes a step only if it gains, and shortens the next one if not.
template <class T>
struct ClimbT {
  Vec3T<T> n;
  T value, limit;

  void take(const Vec3T<T>& next, const T& value_there, const T& length) {
    const auto gains = value_there >= value;
    n = select(gains, next, n);
    value = select(gains, value_there, value);
    limit = select(gains, limit, T(0.25) * length);
  }
};
inline constexpr int kClimbSteps = 12;

/// n of the arc moved to its greatest separation: Newton steps in the angle about e.
template <class T>
inline Vec3T<T> refined(const ArcT<T>& arc, const Vec3T<T>& u, const T& r) {
  const auto value = [&](const Vec3T<T>& n) { return fnma(r, sqrt(norm2(cross(n, u))), dot(n, arc.w)); };
  ClimbT<T> climb{arc.n, value(arc.n), T(0.5)};
  for (int i = 0; i < kClimbSteps; ++i) {
    const Vec3T<T>& n = climb.n;
    const Vec3T<T> t = cross(arc.e, n);
    const T z = dot(n, u), dz = dot(t, u);
    const T inverse = recip(sqrt(max(norm2(cross(n, u)), T(1e-20)))), pull = r * inverse, turn = z * dz * inverse;
    const T slope = fma(pull, z * dz, dot(t, arc.w));
    const T bend = fma(pull, fma(turn, turn, fnma(z, z, dz * dz)), -dot(n, arc.w));
    const auto top = bend < T(-1e-12);
    const T wish = select(top, -slope * recip(select(top, bend, T(-1.0))), sign(slope) * climb.limit);
    const T step = clamp(wish, -climb.limit, climb.limit);
    const Vec3T<T> there = axpy(step, t, n), next = recip(sqrt(norm2(there))) * there;
    climb.take(next, value(next), abs(step));
  }
  return climb.n;
}

/// A cylinder's rim as seen along the unit vector e: an ellipse with these axes, the minor one `ratio` times the major.
template <class T>
struct RimViewT {
  Vec3T<T> major, minor;
  T ratio;

  /// `across`: a unit vector across e, for a rim that is seen as a circle.
  RimViewT(const Vec3T<T>& u, const Vec3T<T>& e, const Vec3T<T>& across) {
    T length;
    const Vec3T<T> normal = cross(u, e);
    length = sqrt(norm2(normal));
    const auto known = length > T(1e-6);
    major = select(known, recip(select(known, length, T(1.0))) * normal, across);
    minor = cross(e, major);
    ratio = max(abs(dot(u, e)), T(0.02));
  }
  /// Outward normal where the rim is nearest to a point, `from` its centre in radii.
  Vec3T<T> normal(const Vec3T<T>& from) const {
    T x, y;
    const T px = dot(from, major), py = dot(from, minor), tip = abs(px) - T(1.0);
    ellipse_normal(px, py, ratio, x, y);
    // A flat one is nearly a segment: from beyond its tip, the direction from the tip.
    const auto beyond = (ratio < T(0.1)) & (tip > T(1e-9));
    const T scale = recip(sqrt(max(fma(tip, tip, py * py), T(1e-30))));
    x = select(beyond, sign(px) * tip * scale, x);
    y = select(beyond, py * scale, y);
    return axpy(x, major, y * minor);
  }
};

/// The part [low, high] of c + t way (both taken across the unit vector m) within radius r about 0; false if none.
template <class T>
inline mask_of<T> cut_by_disc(const Vec3T<T>& c, const Vec3T<T>& way, const Vec3T<T>& m, const T& r, T& low, T& high) {
  const Vec3T<T> from = axpy(-dot(c, m), m, c), u = axpy(-dot(way, m), m, way);
  const T inverse = recip(divisor(norm2(u))), middle = -dot(from, u) * inverse;
  const T room = fma(middle, middle, fnma(T(1.0), norm2(from), r * r) * inverse);
  const T half = sqrt(max(room, T(0.0)));
  low = max(low, middle - half);
  high = min(high, middle + half);
  return (room >= T(0.0)) & (low <= high);
}

template <class T>
inline void clear(ManifoldT<T>& out) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  out.count = ManifoldT<T>::kMax;
  for (int k = 0; k < out.count; ++k) put<T>(out, k, T(0.0), zero, zero, mask_from_bits<T>(0u));
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
