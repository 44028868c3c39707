#pragma once
// A capsule against plane, capsule, cylinder and box: the nearest points of its core segment, and a second point where
// it lies along a face, a side or another capsule. Exact while the cores are apart; a core inside a box is pushed out
// the shortest way, one inside a cylinder the shortest way for its deepest point.

#include "engine/contact/sphere.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// sin^2 of the angle (3 degrees) below which capsules count as side by side.
inline constexpr double kParallelSine2 = 2.7e-3;

/// Sets the deeper slot to the gap and normal of the nearest point, and the point itself if the slot did not have it.
/// An overlap along a face's normal (`by_face`) has its point from the clipping, if that found one.
template <class T>
inline void put_exact(ManifoldT<T>& out, const T& phi, const Vec3T<T>& p, const Vec3T<T>& n, const mask_of<T>& wanted,
                      const mask_of<T>& by_face) {
  const T far(1e300);
  const T first = select(out.point[0].valid, out.point[0].phi, far);
  const T second = select(out.point[1].valid, out.point[1].phi, far);
  const T deepest = min(first, second);
  const mask_of<T> on_first = first <= second, found = deepest < far;
  const mask_of<T> other = (phi < deepest - T(kSamePoint)) & !(by_face & found);
  for (int k = 0; k < 2; ++k) {
    const mask_of<T> here = k == 0 ? on_first : mask_of<T>(!on_first);
    put_where<T>(out, k, wanted & here, phi, select(other, p, out.point[k].p), n);
  }
}
/// As put_exact, but not where the slots have a lesser gap: for nearest points that are ill-conditioned (side by side).
template <class T>
inline void put_nearest(ManifoldT<T>& out, const T& phi, const Vec3T<T>& p, const Vec3T<T>& n, const T& margin) {
  mask_of<T> wanted = phi < margin;
  for (int k = 0; k < 2; ++k) wanted = wanted & !(out.point[k].valid & (out.point[k].phi < phi - T(kSamePoint)));
  put_exact<T>(out, phi, p, n, wanted, mask_from_bits<T>(0u));
}

template <class T>
inline void capsule_plane(const ShapeT<T>& a, const PoseT<T>& Xa, const PoseT<T>& Xb, const T& margin,
                          ManifoldT<T>& out) {
  out.count = 2;
  for (int k = 0; k < 2; ++k) {
    const Vec3T<T> x = axpy((k == 0 ? T(-0.5) : T(0.5)) * a.size.y, Xa.R.column(2), Xa.p);
    put_ball(out, k, x, a.size.x, nearest_on_plane(x, Xb), margin);
  }
}

template <class T>
inline void capsule_capsule(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                            const T& margin, ManifoldT<T>& out) {
  out.count = 2;
  const T one(1.0);
  const Vec3T<T> u = T(0.5) * a.size.y * Xa.R.column(2), v = T(0.5) * b.size.y * Xb.R.column(2), w = Xa.p - Xb.p;
  const SegmentPairT<T> nearest = nearest_of_segments(w, u, v);
  // Cores that cross are parted along their common normal.
  T unused;
  const Vec3T<T> across = direction(cross(u, v), Xa.R.column(0), unused);
  const auto ball = [&](const T& s, const T& t, T& phi, Vec3T<T>& p, Vec3T<T>& n) {
    T length;
    n = direction(axpy(s, u, axpy(-t, v, w)), across, length);
    phi = length - a.size.x - b.size.x;
    p = axpy(-fma(T(0.5), phi, a.size.x), n, axpy(s, u, Xa.p));
  };
  const T uu = recip(divisor(norm2(u))), vv = recip(divisor(norm2(v)));
  const T uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const T first = clamp((-uv - uw) * uu, -one, one), second = clamp((uv - uw) * uu, -one, one);
  const auto along = nearest.sine2 < T(kParallelSine2);
  for (int k = 0; k < 2; ++k) {
    const T s = k == 0 ? first : second;
    T phi;
    Vec3T<T> p, n;
    ball(s, clamp(fma(uv, s, vw) * vv, -one, one), phi, p, n);
    mask_of<T> valid = along & (phi < margin);
    if (k == 1) valid = valid & (abs(second - first) > T(1e-6));
    put<T>(out, k, phi, p, n, valid);
  }
  T phi;
  Vec3T<T> p, n;
  ball(nearest.s, nearest.t, phi, p, n);
  put_nearest(out, phi, p, n, margin);
}

/// The part of c + t u, t in [-1, 1], with |x| <= h along one axis, cut from [low, high].
template <class T>
inline void clip_to_slab(const T& c, const T& u, const T& h, T& low, T& high) {
  const T inverse = recip(divisor(u));
  const T from = (-h - c) * inverse, to = (h - c) * inverse;
  low = max(low, min(from, to));
  high = min(high, max(from, to));
}

/// A segment c + t u in the frame of a box of half edges h.
template <class T>
struct SegmentInBoxT {
  Vec3T<T> c, u, h;

  Vec3T<T> at(const T& t) const { return axpy(t, u, c); }
  /// Half the derivative of the squared distance from the box; it never falls.
  T slope(const T& t) const {
    const Vec3T<T> x = at(t);
    const Vec3T<T> out{x.x - clamp(x.x, -h.x, h.x), x.y - clamp(x.y, -h.y, h.y), x.z - clamp(x.z, -h.z, h.z)};
    return dot(out, u);
  }
};

/// t of the nearest point; the middle of them where there are many. The slope is linear between the six parameters at
/// which the segment crosses the planes of the faces.
template <class T>
inline T nearest_to_box(const SegmentInBoxT<T>& segment) {
  const T one(1.0), zero(0.0);
  T low(-1.0), high(1.0);
  const auto at = [&](const T& c, const T& u, const T& h) {
    const T t = clamp((h - c) * recip(divisor(u)), -one, one);
    const T slope = segment.slope(t);
    low = select(slope <= zero, max(low, t), low);
    high = select(slope >= zero, min(high, t), high);
  };
  const Vec3T<T>&c = segment.c, &u = segment.u, &h = segment.h;
  at(c.x, u.x, h.x), at(c.x, u.x, -h.x);
  at(c.y, u.y, h.y), at(c.y, u.y, -h.y);
  at(c.z, u.z, h.z), at(c.z, u.z, -h.z);
  const T at_low = segment.slope(low), rise = segment.slope(high) - at_low;
  const auto level = (rise <= zero) | (low >= high);
  const T root = clamp(fma(high - low, -at_low * recip(select(level, one, rise)), low), low, high);
  return select(level, T(0.5) * (low + high), root);
}

/// Shortest way out of the box for a segment that meets it: along a face's normal, or across an edge and the segment.
template <class T>
inline NearestT<T> way_out_of_box(const SegmentInBoxT<T>& segment, T& t) {
  const T zero(0.0);
  const Vec3T<T>&c = segment.c, &u = segment.u, &h = segment.h;
  NearestT<T> best{T(-1e300), {zero, zero, zero}};
  const auto try_axis = [&](const Vec3T<T>& axis, const T& at, const mask_of<T>& usable) {
    const T toward = sign(dot(axis, c));
    const T reach = fma(abs(axis.x), h.x, fma(abs(axis.y), h.y, abs(axis.z) * h.z)) + abs(dot(axis, u));
    const T d = toward * dot(axis, c) - reach;
    const auto better = usable & (d > best.d + T(kSameGap));
    best.d = select(better, d, best.d);
    best.n = select(better, toward * axis, best.n);
    t = select(better, at, t);
  };
  const mask_of<T> yes = mask_from_bits<T>(~0u);
  for (int k = 0; k < 3; ++k) {
    const T ck = k == 0 ? c.x : k == 1 ? c.y : c.z, uk = k == 0 ? u.x : k == 1 ? u.y : u.z;
    const Vec3T<T> axis{T(k == 0 ? 1.0 : 0.0), T(k == 1 ? 1.0 : 0.0), T(k == 2 ? 1.0 : 0.0)};
    try_axis(axis, -sign(ck) * sign(uk), yes);
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3T<T> edge{T(k == 0 ? 1.0 : 0.0), T(k == 1 ? 1.0 : 0.0), T(k == 2 ? 1.0 : 0.0)};
    const Vec3T<T> across = cross(edge, u);
    const T length = sqrt(norm2(across));
    const mask_of<T> usable = length > T(1e-6) * sqrt(norm2(u));
    const Vec3T<T> axis = recip(select(usable, length, T(1.0))) * across;
    const Vec3T<T> n = sign(dot(axis, c)) * axis;
    const Vec3T<T> corner{sign(n.x) * h.x, sign(n.y) * h.y, sign(n.z) * h.z}, m = cross(n, edge);
    const T at = clamp(dot(corner - c, m) * recip(divisor(dot(u, m))), T(-1.0), T(1.0));
    try_axis(axis, at, usable);
  }
  return best;
}

template <class T>
inline void capsule_box(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb, const T& margin,
                        ManifoldT<T>& out) {
  out.count = 2;
  const Vec3T<T> half = T(0.5) * b.size;
  const Vec3T<T> u = T(0.5) * a.size.y * transposed_times(Xb.R, Xa.R.column(2));
  const SegmentInBoxT<T> segment{transposed_times(Xb.R, Xa.p - Xb.p), u, half};
  T t = nearest_to_box(segment);
  NearestT<T> exact = nearest_on_box(segment.at(t), half);
  const mask_of<T> deep = exact.d <= T(kNoDirection);
  if (any(deep)) {
    T deepest(0.0);
    const NearestT<T> way = way_out_of_box(segment, deepest);
    exact = {select(deep, way.d, exact.d), select(deep, way.n, exact.n)};
    t = select(deep, deepest, t);
  }
  // The part of the segment over the face whose normal is near.
  const T cosine(kFaceCosine);
  const mask_of<T> face_x = abs(exact.n.x) > cosine, face_y = abs(exact.n.y) > cosine, face_z = abs(exact.n.z) > cosine;
  T low(-1.0), high(1.0);
  const T wide(1e100);
  clip_to_slab(segment.c.x, u.x, select(face_x, wide, half.x), low, high);
  clip_to_slab(segment.c.y, u.y, select(face_y, wide, half.y), low, high);
  clip_to_slab(segment.c.z, u.z, select(face_z, wide, half.z), low, high);
  const Vec3T<T> face{select(face_x, sign(exact.n.x), T(0.0)), select(face_y, sign(exact.n.y), T(0.0)),
                      select(face_z, sign(exact.n.z), T(0.0))};
  const T height = fma(abs(face.x), half.x, fma(abs(face.y), half.y, abs(face.z) * half.z));
  const mask_of<T> lies = (face_x | face_y | face_z) & (high >= low);
  const mask_of<T> spread = (high - low) * sqrt(norm2(u)) > T(1e-6);
  for (int k = 0; k < 2; ++k) {
    const Vec3T<T> x = segment.at(k == 0 ? low : high);
    const NearestT<T> over{dot(face, x) - height, face};
    put_ball<T>(out, k, Xb * x, a.size.x, to_world(Xb, over), margin, k == 0 ? lies : mask_of<T>(lies & spread));
  }
  const T steepest = max(max(abs(exact.n.x), abs(exact.n.y)), abs(exact.n.z));
  const mask_of<T> by_face = deep & (steepest > T(1.0 - 1e-12));
  const T phi = exact.d - a.size.x;
  const Vec3T<T> n = Xb.R * exact.n;
  put_exact<T>(out, phi, axpy(-fma(T(0.5), phi, a.size.x), n, Xb * segment.at(t)), n, phi < margin, by_face);
}

/// t in [-1, 1] of the segment's point that is deepest in a cylinder (in its frame): the distance of a point from a
/// convex body is a convex function, so the sign of its slope is bisected, to 2^-50.
template <class T>
inline T nearest_to_cylinder(const Vec3T<T>& c, const Vec3T<T>& u, const T& r, const T& h) {
  T low(-1.0), high(1.0);
  for (int i = 0; i < 50; ++i) {
    const T middle = T(0.5) * (low + high);
    const auto falls = dot(nearest_on_cylinder<T>(axpy(middle, u, c), r, h).n, u) < T(0.0);
    low = select(falls, middle, low);
    high = select(falls, high, middle);
  }
  return high;
}

template <class T>
inline void capsule_cylinder(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                             const T& margin, ManifoldT<T>& out) {
  out.count = 2;
  const T r = b.size.x, h = T(0.5) * b.size.y, one(1.0);
  const Vec3T<T> c = transposed_times(Xb.R, Xa.p - Xb.p);
  const Vec3T<T> u = T(0.5) * a.size.y * transposed_times(Xb.R, Xa.R.column(2));
  const T t = nearest_to_cylinder(c, u, r, h);
  const NearestT<T> exact = nearest_on_cylinder(axpy(t, u, c), r, h);
  const T uu = norm2(u), across2 = fma(u.x, u.x, u.y * u.y);
  // Along the side: between the caps. Flat on a cap: the chord of the disc.
  const mask_of<T> along = (across2 < T(kParallelSine2) * uu) & (abs(exact.n.z) < T(0.05));
  const mask_of<T> flat = (u.z * u.z < T(kParallelSine2) * uu) & (abs(exact.n.z) > T(kFaceCosine));
  T side_low = -one, side_high = one;
  clip_to_slab(c.z, u.z, h, side_low, side_high);
  const T inverse = recip(divisor(across2));
  const T middle = -fma(c.x, u.x, c.y * u.y) * inverse;
  const T room = fma(middle, middle, (r * r - fma(c.x, c.x, c.y * c.y)) * inverse);
  const T chord = sqrt(max(room, T(0.0)));
  const T low = select(along, side_low, max(-one, middle - chord));
  const T high = select(along, side_high, min(one, middle + chord));
  const mask_of<T> lies = (along | flat) & (high >= low), spread = (high - low) * sqrt(uu) > T(1e-6);
  for (int k = 0; k < 2; ++k) {
    const Vec3T<T> x = axpy(k == 0 ? low : high, u, c);
    put_ball<T>(out, k, Xb * x, a.size.x, to_world(Xb, nearest_on_cylinder(x, r, h)), margin,
                k == 0 ? lies : mask_of<T>(lies & spread));
  }
  const T phi = exact.d - a.size.x;
  const Vec3T<T> n = Xb.R * exact.n;
  put_nearest(out, phi, axpy(-fma(T(0.5), phi, a.size.x), n, Xb * axpy(t, u, c)), n, margin);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
