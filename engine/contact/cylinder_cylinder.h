#pragma once
// Two cylinders, about the second one's centre. The exact gap and normal first (cylinder_gap.h); then, where caps or
// sides lie on each other, the points that span the contact.
//
// Slots of two caps: four points of a's rim within b's cap, the first toward b's axis, then four of b's rim within a's
// cap; where the rims cross, the crossings take the place of those that point away. Of sides: two.

#include "engine/contact/cylinder_gap.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct CylinderPairT {
  CylinderT<T> a, b;
  ClosestT<T> best;

  T gap(const Vec3T<T>& n) const { return dot(n, a.c - b.c) - reach_along(a, n) - reach_along(b, n); }
  void keep(const T& phi, const Vec3T<T>& n, const Vec3T<T>& p, const mask_of<T>& usable) {
    keep_if<T>(usable & (phi > best.phi + T(kSameGap)), phi, n, p, best);
  }
  /// With the point from a's rim (or b's).
  void keep_rim(const Vec3T<T>& n, bool of_a) { keep_rim(n, of_a, mask_from_bits<T>(~0u)); }
  void keep_rim(const Vec3T<T>& n, bool of_a, const mask_of<T>& usable) {
    const T phi = gap(n);
    const Vec3T<T> p = of_a ? axpy(T(-0.5) * phi, n, furthest(a, -n)) : axpy(T(0.5) * phi, n, furthest(b, n));
    keep(phi, n, p, usable);
  }

  void try_caps() {
    const Vec3T<T> from = a.c - b.c;
    keep_rim(sign(dot(b.u, from)) * b.u, true);
    keep_rim(sign(dot(a.u, from)) * a.u, false);
  }

  /// Side on side: crossed, or side by side. `across`: any unit vector across b's axis.
  void try_sides(const Vec3T<T>& across) {
    const Vec3T<T> from = a.c - b.c, normal = cross(a.u, b.u);
    const T length = sqrt(norm2(normal));
    const mask_of<T> crossed = length > T(1e-6);
    T distance;
    const Vec3T<T> apart = direction(axpy(-dot(from, b.u), b.u, from), across, distance);
    keep_side(apart, mask_from_bits<T>(~0u));
    const Vec3T<T> n = recip(select(crossed, length, T(1.0))) * normal;
    keep_side(sign(dot(n, from)) * n, crossed);
  }
  void keep_side(const Vec3T<T>& n, const mask_of<T>& usable) {
    const Vec3T<T> on_a = axpy(-a.r, unit_across(n, a.u), a.c), on_b = axpy(b.r, unit_across(n, b.u), b.c);
    const Vec3T<T> u = a.h * a.u, v = b.h * b.u;
    const SegmentPairT<T> at = nearest_of_segments(on_a - on_b, u, v);
    // Where a is tilted against b's side, its nearer rim touches.
    const T phi = gap(n);
    const Vec3T<T> crossing = T(0.5) * (axpy(at.s, u, on_a) + axpy(at.t, v, on_b));
    const Vec3T<T> end = axpy(T(-0.5) * phi, n, furthest(a, -n));
    keep(phi, n, select(abs(dot(n, a.u)) > T(1e-6), end, crossing), usable);
  }

  /// A rim of `rim` against the side of `post`; `toward` is +1 when the rim is a's.
  void try_rim_on_side(const CylinderT<T>& rim, const CylinderT<T>& post, const Vec3T<T>& across, double toward) {
    const RimViewT<T> view(rim.u, post.u, across);
    for (int end = 0; end < 2; ++end) {
      const Vec3T<T> w = axpy(end == 0 ? -rim.h : rim.h, rim.u, rim.c - post.c);
      const ArcT<T> arc{T(0.0), -view.normal(-(recip(rim.r) * w)), post.u, w};
      keep_rim(T(toward) * refined(arc, rim.u, rim.r), toward > 0);
    }
    // A cap that nearly lies along the side: from its normal on, which is near the best.
    const T along = T(toward) * dot(best.n, rim.u);
    const mask_of<T> flat = abs(along) > T(0.9);
    if (!any(flat)) return;
    const Vec3T<T> from = select(flat, sign(along) * unit_across(rim.u, post.u), view.major);
    const ArcT<T> arc{T(0.0), from, post.u, axpy(-(sign(along) * rim.h), rim.u, rim.c - post.c)};
    keep_rim(T(toward) * refined(arc, rim.u, rim.r), toward > 0, flat & (norm2(from) > T(0.5)));
  }

  /// Rim on rim: from the direction of nearest points (of a moved out of b, if they overlap), Newton steps on the
  /// sphere.
  void try_rims() {
    T distance;
    keep_rim(refined_rims(nearest_direction(best.n)), true);
    keep_rim(refined_rims(nearest_direction(direction(a.c - b.c, best.n, distance))), true);
    // Caps that nearly lie on each other: from between their normals.
    const T za = dot(best.n, a.u), zb = dot(best.n, b.u);
    const Vec3T<T> between = sign(za) * a.u + sign(zb) * b.u, again = nearest_direction(best.n);
    const mask_of<T> flat_a = abs(za) > T(0.9), flat_b = abs(zb) > T(0.9), flat = flat_a & flat_b;
    const Vec3T<T> start = select(flat, between, again);
    keep_rim(refined_rims(recip(sqrt(norm2(start))) * start), true);
    keep_rim(refined_rims(off_axes(best.n)), true);
    keep_rim(refined_rims(best.n, true), true);
  }

 private:
  /// From nearest points, a moved along `way` until it is out of b if they overlap.
  Vec3T<T> nearest_direction(const Vec3T<T>& way) const {
    CylinderT<T> moved = a;
    moved.c = axpy(max(T(0.0), fnma(T(-0.1), min(a.r, b.r), -gap(way))), way, a.c);
    Vec3T<T> x = moved.c, y = b.c;
    for (int i = 0; i < 12; ++i) {
      y = nearest_in(b, x);
      x = nearest_in(moved, y);
    }
    T length;
    return direction(x - y, best.n, length);
  }
  /// From the rim of b that is furthest along n to the rim of a that is furthest against it: their centres.
  /// `other`: of two rims that are nearly as far, the other one.
  Vec3T<T> between_rims(const Vec3T<T>& n, bool other) const {
    const auto end = [&](const CylinderT<T>& cylinder) {
      const T z = dot(n, cylinder.u), near = sign(z) * cylinder.h;
      return other ? select(abs(z) < T(0.05), -near, near) : near;
    };
    const T end_a = end(a), end_b = end(b);
    return axpy(-end_a, a.u, a.c) - axpy(end_b, b.u, b.c);
  }
  /// n off the axes, where the separation has a kink, to the side on which it is greater.
  Vec3T<T> off_axes(const Vec3T<T>& n) const {
    const Vec3T<T> w = between_rims(n, false), ra = unit_across(n, a.u), rb = unit_across(n, b.u);
    const T by_a = select(norm2(cross(n, a.u)) < T(1e-4), T(2e-3), T(0.0));
    const T by_b = select(norm2(cross(n, b.u)) < T(1e-4), T(2e-3), T(0.0));
    const Vec3T<T> away = axpy(by_a, unit_across(axpy(-b.r, rb, w), a.u), by_b * unit_across(axpy(-a.r, ra, w), b.u));
    const Vec3T<T> there = n + away;
    return recip(sqrt(norm2(there))) * there;
  }
  Vec3T<T> refined_rims(const Vec3T<T>& start, bool other = false) const {
    const T tiny(1e-20), zero(0.0);
    const Vec3T<T> w = between_rims(start, other);
    const auto value = [&](const Vec3T<T>& n) {
      return dot(n, w) - fma(a.r, sqrt(norm2(cross(n, a.u))), b.r * sqrt(norm2(cross(n, b.u))));
    };
    ClimbT<T> climb{start, value(start), T(0.5)};
    for (int i = 0; i < kClimbSteps; ++i) {
      const Vec3T<T>& n = climb.n;
      const Vec3T<T> ta = cross(a.u, n), tb = cross(b.u, n);
      const T inverse_a = recip(sqrt(max(norm2(ta), tiny))), inverse_b = recip(sqrt(max(norm2(tb), tiny)));
      const Vec3T<T> t1 = inverse_a * ta, t2 = cross(n, t1), other = inverse_b * tb;
      // s = n . w - r_a |n x u_a| - r_b |n x u_b| and its derivatives along t1 and t2.
      const Vec3T<T> pa = axpy(-dot(n, a.u), a.u, n), pb = axpy(-dot(n, b.u), b.u, n);
      const Vec3T<T> slope = axpy(-(a.r * inverse_a), pa, axpy(-(b.r * inverse_b), pb, w));
      const T s = dot(slope, n), g1 = dot(slope, t1), g2 = dot(slope, t2);
      const T k = b.r * inverse_b, c1 = dot(other, t1), c2 = dot(other, t2);
      const T m11 = fma(k * c1, c1, a.r * inverse_a), m22 = k * c2 * c2, m12 = k * c1 * c2;
      const T least = T(1e-3) * (a.r + b.r);
      const T plain = fnma(m12, m12, (m11 + s) * (m22 + s));
      const mask_of<T> convex = (m11 + s > zero) & (plain > least * least);
      const T shift = select(convex, s, max(s, least));
      const T inverse = recip(fnma(m12, m12, (m11 + shift) * (m22 + shift)));
      const T d1 = fnma(m12, g2, (m22 + shift) * g1) * inverse, d2 = fnma(m12, g1, (m11 + shift) * g2) * inverse;
      const T size = sqrt(fma(d1, d1, d2 * d2)), part = min(T(1.0), climb.limit * recip(max(size, tiny)));
      const Vec3T<T> there = axpy(part * d1, t1, axpy(part * d2, t2, n)), next = recip(sqrt(norm2(there))) * there;
      climb.take(next, value(next), part * size);
    }
    return climb.n;
  }
};

/// Two caps; m: b's axis, from b to a. `fixed`: unit vector across it.
template <class T>
inline void caps_on_caps(const CylinderT<T>& a, const CylinderT<T>& b, const Vec3T<T>& m, const Vec3T<T>& fixed,
                         const mask_of<T>& wanted, const T& margin, ManifoldT<T>& out) {
  const T zero(0.0), half(0.5);
  const T facing = dot(a.u, m);
  const Vec3T<T> disc_a = axpy(-(sign(facing) * a.h), a.u, a.c), disc_b = axpy(b.h, m, b.c), from = disc_a - disc_b;
  const Vec3T<T> apart = axpy(-dot(from, m), m, from);
  const T d = sqrt(norm2(apart)), rise = recip(facing), loose = T(kLoose) * (a.r + b.r);
  const mask_of<T> shifted = d > T(1e-3) * min(a.r, b.r);
  const Vec3T<T> l = select(shifted, recip(select(shifted, d, T(1.0))) * apart, fixed), q = cross(m, l);
  const T ax = dot(apart, l), ay = dot(apart, q);
  const auto put_at = [&](int slot, const T& x, const T& y, const mask_of<T>& mask) {
    const Vec3T<T> on_b = axpy(x, l, axpy(y, q, disc_b));
    const T phi = dot(disc_a - on_b, a.u) * rise;
    put_where<T>(out, slot, mask & (phi < margin), phi, axpy(half * phi, m, on_b), m);
  };
  const mask_of<T> crossing = wanted & shifted & (d > abs(a.r - b.r) + loose) & (d < a.r + b.r);
  const T within = b.r + select(crossing, -loose, select(shifted, loose, T(2e-3) * b.r));
  for (int k = 0; k < 4; ++k) {
    const double cx[4] = {-1, 0, 1, 0}, cy[4] = {0, 1, 0, -1};
    T x = fma(a.r, T(cx[k]), ax), y = fma(a.r, T(cy[k]), ay);
    const T rho = sqrt(fma(x, x, y * y)), pull = min(T(1.0), b.r * recip(max(rho, T(1e-12))));
    put_at(k, pull * x, pull * y, wanted & (rho <= within));
    x = b.r * T(-cx[k]), y = b.r * T(cy[k]);
    const T dx = x - ax, dy = y - ay;
    const T inside = a.r - select(shifted, loose, T(4e-3) * a.r);
    put_at(4 + k, x, y, wanted & (fma(dx, dx, dy * dy) < inside * inside) & (inside > zero));
  }
  const T foot = half * fma(d, d, (b.r - a.r) * (b.r + a.r)) * recip(select(shifted, d, T(1.0)));
  const T chord = sqrt(max(fnma(foot, foot, b.r * b.r), zero));
  put_at(2, foot, chord, crossing);
  put_at(6, foot, -chord, crossing & (chord > loose));
}

/// A cap with centre `disc` and radius r on a side's line x + t way, t in [-1, 1]; m: the cap's normal, toward the
/// line.
template <class T>
inline void cap_on_side(const Vec3T<T>& disc, const T& r, const Vec3T<T>& line, const Vec3T<T>& way, const Vec3T<T>& m,
                        double toward, const mask_of<T>& wanted, const T& margin, ManifoldT<T>& out) {
  T low(-1.0), high(1.0);
  const mask_of<T> some = wanted & cut_by_disc(line - disc, way, m, r, low, high);
  const mask_of<T> spread = (high - low) * sqrt(norm2(way)) > T(1e-6);
  for (int k = 0; k < 2; ++k) {
    const Vec3T<T> x = axpy(k == 0 ? low : high, way, line);
    const T phi = dot(m, x - disc);
    put_where<T>(out, k, (k == 0 ? some : mask_of<T>(some & spread)) & (phi < margin), phi, axpy(T(-0.5) * phi, m, x),
                 T(toward) * m);
  }
}

/// Sides that are parallel; n: the exact normal.
template <class T>
inline void side_on_side(const CylinderT<T>& a, const CylinderT<T>& b, const Vec3T<T>& n, const mask_of<T>& wanted,
                         const T& margin, ManifoldT<T>& out) {
  const T facing = dot(a.u, b.u), start = dot(a.c - b.c, b.u), gone = a.r + b.r;
  // Shorter by what a normal across b's axis reaches beyond a's end.
  const T half = fnma(a.r, sqrt(norm2(cross(a.u, b.u))), a.h * abs(facing));
  const T low = max(-b.h, start - half), high = min(b.h, start + half), inverse = recip(divisor(facing));
  for (int k = 0; k < 2; ++k) {
    // Across b's axis at either end of the common length: there the axes may be further apart than elsewhere.
    const T t = k == 0 ? low : high;
    const Vec3T<T> on_b = axpy(t, b.u, b.c), on_a = axpy((t - start) * inverse, a.u, a.c);
    T distance;
    const Vec3T<T> m = direction(on_a - on_b, n, distance);
    const T phi = distance - gone;
    mask_of<T> some = wanted & (low <= high) & (phi < margin);
    if (k == 1) some = some & (high - low > T(1e-6));
    put_where<T>(out, k, some, phi, axpy(fma(T(0.5), phi, b.r), m, on_b), m);
  }
}

template <class T>
inline void spread_cylinders(const CylinderPairT<T>& pair, const Vec3T<T>& fixed, const T& margin, ManifoldT<T>& out) {
  const CylinderT<T>&a = pair.a, &b = pair.b;
  const Vec3T<T>& n = pair.best.n;
  const T za = dot(n, a.u), zb = dot(n, b.u), one(1.0);
  const mask_of<T> near = pair.best.phi < margin;
  const mask_of<T> cap_a = near & (abs(za) > T(kFaceCosine)), cap_b = near & (abs(zb) > T(kFaceCosine));
  const mask_of<T> side_a = near & (abs(za) < T(kAlongSine)), side_b = near & (abs(zb) < T(kAlongSine));
  const mask_of<T> parallel = side_a & side_b & (norm2(cross(a.u, b.u)) < T(kParallelSine2));
  const Vec3T<T> axis_a = select(za < T(0.0), -one, one) * a.u, axis_b = select(zb < T(0.0), -one, one) * b.u;
  if (any(cap_a & cap_b)) caps_on_caps<T>(a, b, axis_b, fixed, cap_a & cap_b, margin, out);
  if (any(parallel)) side_on_side<T>(a, b, n, parallel, margin, out);
  if (any(cap_b & side_a)) {
    const Vec3T<T> line = axpy(-a.r, unit_across(axis_b, a.u), a.c);
    cap_on_side<T>(axpy(b.h, axis_b, b.c), b.r, line, a.h * a.u, axis_b, 1.0, cap_b & side_a, margin, out);
  }
  if (any(cap_a & side_b)) {
    const Vec3T<T> line = axpy(b.r, unit_across(axis_a, b.u), b.c);
    cap_on_side<T>(axpy(-a.h, axis_a, a.c), a.r, line, b.h * b.u, -axis_a, -1.0, cap_a & side_b, margin, out);
  }
}

template <class T>
inline void cylinder_cylinder(const ShapeT<T>& sa, const PoseT<T>& Xa, const ShapeT<T>& sb, const PoseT<T>& Xb,
                              const T& margin, ManifoldT<T>& out) {
  clear(out);
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)}, fixed = Xb.R.column(0);
  CylinderPairT<T> pair{{Xa.p - Xb.p, Xa.R.column(2), sa.size.x, T(0.5) * sa.size.y},
                        {zero, Xb.R.column(2), sb.size.x, T(0.5) * sb.size.y},
                        {T(-1e300), zero, zero}};
  pair.try_caps();
  pair.try_sides(fixed);
  if (!any(pair.best.phi < margin)) return;  // apart in all lanes: no lane has a point
  pair.try_rim_on_side(pair.a, pair.b, fixed, 1.0);
  pair.try_rim_on_side(pair.b, pair.a, Xa.R.column(0), -1.0);
  pair.try_rims();
  spread_cylinders(pair, fixed, margin, out);
  put_exact<T>(pair.best, mask_from_bits<T>(0u), margin, out, kSameSupport);
  for (int k = 0; k < out.count; ++k) out.point[k].p += Xb.p;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
