#pragma once
// A cylinder and a box, in the box's frame. The exact gap and normal first (cylinder_gap.h); then, where a cap lies on
// the box or the side lies along a face or an edge, the points that span the contact.
//
// Slots: a cap has two per edge of the box's face, where the edge enters and leaves the cap, or one, where the rim
// reaches furthest toward that edge; a side has two, the first toward the lower cap.

#include "engine/contact/cylinder_gap.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline T axis_of(const Vec3T<T>& v, int k) {
  return k == 0 ? v.x : k == 1 ? v.y : v.z;
}
template <class T>
inline Vec3T<T> unit_axis(int k) {
  return {T(k == 0 ? 1.0 : 0.0), T(k == 1 ? 1.0 : 0.0), T(k == 2 ? 1.0 : 0.0)};
}

/// Greatest separation of a cylinder from the box of half edges h about 0; normals from box to cylinder.
template <class T>
struct CylinderBoxT {
  CylinderT<T> a;
  Vec3T<T> h;
  ClosestT<T> best;

  T gap(const Vec3T<T>& n) const {
    const T box = fma(abs(n.x), h.x, fma(abs(n.y), h.y, abs(n.z) * h.z));
    return dot(n, a.c) - reach_along(a, n) - box;
  }
  Vec3T<T> corner(const Vec3T<T>& n) const { return {sign(n.x) * h.x, sign(n.y) * h.y, sign(n.z) * h.z}; }
  void keep(const T& phi, const Vec3T<T>& n, const Vec3T<T>& p, const mask_of<T>& usable) {
    keep_if<T>(usable & (phi > best.phi + T(kSameGap)), phi, n, p, best);
  }

  /// Where the best is the greatest: two points of the bodies are no farther apart. No other direction would be kept
  /// then, so that lanes may stop looking together.
  mask_of<T> is_met() const {
    const auto in_box = [&](const Vec3T<T>& x) {
      return Vec3T<T>{clamp(x.x, -h.x, h.x), clamp(x.y, -h.y, h.y), clamp(x.z, -h.z, h.z)};
    };
    const Vec3T<T> x = nearest_in(a, in_box(axpy(T(-0.5) * best.phi, best.n, best.p)));
    return sqrt(norm2(x - in_box(x))) <= best.phi + T(0.5 * kSameGap);
  }

  /// Normals of the box's faces and of the cap.
  void try_flats() {
    const mask_of<T> yes = mask_from_bits<T>(~0u);
    for (int k = 0; k < 3; ++k) {
      const Vec3T<T> n = sign(axis_of(a.c, k)) * unit_axis<T>(k);
      const T phi = gap(n);
      // Where the side lies along the face, its point nearest to the box's middle, not the end that rounding says.
      const T z = dot(n, a.u), at = clamp(-dot(a.c, a.u), -a.h, a.h);
      const Vec3T<T> lying = axpy(a.r, unit_across(-n, a.u), axpy(at, a.u, a.c));
      keep(phi, n, axpy(T(-0.5) * phi, n, select(abs(z) < T(1e-9), lying, furthest(a, -n))), yes);
    }
    const Vec3T<T> n = sign(dot(a.u, a.c)) * a.u;
    const T phi = gap(n);
    keep(phi, n, axpy(T(0.5) * phi, n, corner(n)), yes);
  }

  /// The side across an edge.
  void try_crossings() {
    for (int k = 0; k < 3; ++k) {
      const Vec3T<T> e = unit_axis<T>(k), across = cross(e, a.u);
      const T length = sqrt(norm2(across));
      const mask_of<T> usable = length > T(1e-6);
      Vec3T<T> n = recip(select(usable, length, T(1.0))) * across;
      n = sign(dot(n, a.c)) * n;
      const T phi = gap(n);
      const Vec3T<T> middle = corner(n) - axis_of(corner(n), k) * e, line = axpy(-a.r, n, a.c);
      const Vec3T<T> u = a.h * a.u, v = axis_of(h, k) * e;
      const SegmentPairT<T> at = nearest_of_segments(line - middle, u, v);
      keep(phi, n, T(0.5) * (axpy(at.s, u, line) + axpy(at.t, v, middle)), usable);
    }
  }

  /// Corners against side and rims. `across` is any unit vector across the axis.
  void try_corners(const Vec3T<T>& across) {
    for (int k = 0; k < 8; ++k) {
      const Vec3T<T> x = box_corner(h, k), from = a.c - x;
      const T along = dot(from, a.u);
      T rho;
      const Vec3T<T> radial = direction(axpy(-along, a.u, from), across, rho);
      const T side = max(rho - a.r, T(0.0)), cap = max(abs(along) - a.h, T(0.0));
      const T length = sqrt(fma(side, side, cap * cap));
      const mask_of<T> outside = length > T(kNoDirection);
      const T scale = recip(select(outside, length, T(1.0)));
      const Vec3T<T> apart = axpy(side * scale, radial, (sign(along) * cap * scale) * a.u);
      const Vec3T<T> n = select(outside, apart, radial);
      const T phi = gap(n);
      keep(phi, n, axpy(T(0.5) * phi, n, x), mask_from_bits<T>(~0u));
    }
  }

  /// The edges along axis i against rims: the best guess of eight, refined.
  void try_rims(int i) {
    const T inverse = recip(a.r);
    const Vec3T<T> e = unit_axis<T>(i);
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const RimViewT<T> view(a.u, e, unit_axis<T>(j));
    ArcT<T> arc{T(-1e300), unit_axis<T>(j), e, e};
    for (int choice = 0; choice < 8; ++choice) {
      const T at_j = choice & 1 ? axis_of(h, j) : -axis_of(h, j), at_k = choice & 2 ? axis_of(h, k) : -axis_of(h, k);
      const Vec3T<T> edge = axpy(at_j, unit_axis<T>(j), at_k * unit_axis<T>(k));
      const Vec3T<T> w = axpy(choice & 4 ? a.h : -a.h, a.u, a.c - edge);
      const Vec3T<T> n = -view.normal(-(inverse * w));
      const T phi = gap(n);
      const mask_of<T> better = phi > arc.gap;
      arc = {select(better, phi, arc.gap), select(better, n, arc.n), e, select(better, w, arc.w)};
    }
    arc.n = refined(arc, a.u, a.r);
    // The guess may have been the wrong edge or rim; the direction then tells the right one.
    const Vec3T<T> at = corner(arc.n), edge = axpy(-axis_of(at, i), e, at);
    arc.w = axpy(-(sign(dot(arc.n, a.u)) * a.h), a.u, a.c - edge);
    keep_rim(arc.n, mask_from_bits<T>(~0u));
    keep_rim(refined(arc, a.u, a.r), mask_from_bits<T>(~0u));
  }

  /// Edges against rims while a cap nearly lies on a face: from the cap's normal on, which is near the best.
  void try_flat_rims() {
    const T steepest = max(max(abs(best.n.x), abs(best.n.y)), abs(best.n.z)), along = dot(best.n, a.u);
    const mask_of<T> flat = (steepest > T(0.9)) & (abs(along) > T(0.9));
    if (!any(flat)) return;
    for (int i = 0; i < 3; ++i) {
      const Vec3T<T> e = unit_axis<T>(i), from = sign(along) * unit_across(a.u, e);
      const mask_of<T> level = flat & (abs(axis_of(a.u, i)) < T(0.5));
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const mask_of<T> by_j = abs(axis_of(from, j)) > abs(axis_of(from, k));
      for (int choice = 0; choice < 2; ++choice) {
        // The edge is one of the two of the face toward the cap.
        const T way = choice == 0 ? T(-1.0) : T(1.0);
        const T at_j = select(by_j, sign(axis_of(from, j)), way) * axis_of(h, j);
        const T at_k = select(by_j, way, sign(axis_of(from, k))) * axis_of(h, k);
        const Vec3T<T> edge = axpy(at_j, unit_axis<T>(j), at_k * unit_axis<T>(k));
        const Vec3T<T> w = axpy(-(sign(along) * a.h), a.u, a.c - edge);
        keep_rim(refined(ArcT<T>{T(0.0), from, e, w}, a.u, a.r), level);
      }
    }
  }

 private:
  void keep_rim(const Vec3T<T>& n, const mask_of<T>& usable) {
    const T phi = gap(n);
    keep(phi, n, axpy(T(-0.5) * phi, n, furthest(a, -n)), usable);
  }
};

/// A face of the box about 0 that points along `m`.
template <class T>
struct BoxFaceT {
  Vec3T<T> centre, normal, e1, e2;  // e1, e2: half edges
};
template <class T>
inline BoxFaceT<T> face_along(const Vec3T<T>& h, const Vec3T<T>& m) {
  const T x = abs(m.x), y = abs(m.y), z = abs(m.z), zero(0.0);
  const mask_of<T> is_x = (x >= y) & (x >= z), is_y = (!is_x) & (y >= z), is_z = !(is_x | is_y);
  const Vec3T<T> normal{select(is_x, sign(m.x), zero), select(is_y, sign(m.y), zero), select(is_z, sign(m.z), zero)};
  return {{normal.x * h.x, normal.y * h.y, normal.z * h.z},
          normal,
          {select(is_z, h.x, zero), select(is_x, h.y, zero), select(is_y, h.z, zero)},
          {select(is_y, h.x, zero), select(is_z, h.y, zero), select(is_x, h.z, zero)}};
}

/// The cap toward the box, against the box's face toward the cap. m: cap's normal, from box to cylinder.
template <class T>
inline void cap_on_box(const CylinderT<T>& a, const Vec3T<T>& h, const Vec3T<T>& m, const mask_of<T>& wanted,
                       const T& margin, ManifoldT<T>& out) {
  const Vec3T<T> cap = axpy(-a.h, m, a.c);
  const BoxFaceT<T> face = face_along(h, m);
  const T rise = recip(dot(m, face.normal));  // at least 1 / sqrt 3
  for (int k = 0; k < 4; ++k) {
    const T s = k < 2 ? T(1.0) : T(-1.0);
    const Vec3T<T> toward = s * (k % 2 == 0 ? face.e1 : face.e2), along = s * (k % 2 == 0 ? face.e2 : -face.e1);
    const Vec3T<T> from = face.centre + toward - along, way = along + along;
    T low(0.0), high(1.0);
    const mask_of<T> some = wanted & cut_by_disc(from - cap, way, m, a.r * T(1.0 + kLoose), low, high);
    const auto put_edge = [&](int slot, const T& t, const mask_of<T>& mask) {
      const Vec3T<T> x = axpy(t, way, from);
      const T phi = dot(m, cap - x);
      put<T>(out, slot, phi, axpy(T(0.5) * phi, m, x), m, mask & (phi < margin));
    };
    put_edge(2 * k, low, some);
    put_edge(2 * k + 1, high, some & (high < T(1.0 - kLoose)) & (high - low > T(kLoose)));
    // No edge here: the rim's point toward it, if that is over the face.
    const Vec3T<T> rim = axpy(a.r, unit_across(toward, m), cap);
    const T phi = dot(rim - face.centre, face.normal) * rise;
    const Vec3T<T> x = axpy(-phi, m, rim), on_face = x - face.centre;
    const T at_1 = abs(dot(on_face, face.e1)), at_2 = abs(dot(on_face, face.e2)), inside(1.0 - kLoose);
    const mask_of<T> over_1 = at_1 < inside * norm2(face.e1), over_2 = at_2 < inside * norm2(face.e2);
    const mask_of<T> over = over_1 & over_2;
    const mask_of<T> here = wanted & (!some) & over & (phi < margin);
    put_where<T>(out, 2 * k, here, phi, axpy(T(0.5) * phi, m, x), m);
  }
}

/// The side along a face or an edge. n: the exact normal.
template <class T>
inline void side_on_box(const CylinderT<T>& a, const Vec3T<T>& h, const Vec3T<T>& n, const mask_of<T>& wanted,
                        const T& margin, ManifoldT<T>& out) {
  const T zero(0.0), one(1.0), wide(1e100), small(kAlongSine);
  // The box reaches with a face across one axis, with an edge across two.
  const mask_of<T> by_x = abs(n.x) >= small, by_y = abs(n.y) >= small, by_z = abs(n.z) >= small;
  const Vec3T<T> across{select(by_x, n.x, zero), select(by_y, n.y, zero), select(by_z, n.z, zero)};
  const Vec3T<T> m = recip(sqrt(norm2(across))) * across;
  const Vec3T<T> rest{select(by_x, zero, a.u.x), select(by_y, zero, a.u.y), select(by_z, zero, a.u.z)};
  const mask_of<T> lies = wanted & (norm2(rest) > T(1.0 - kParallelSine2));
  const Vec3T<T> line = axpy(-a.r, unit_across(m, a.u), a.c), way = a.h * a.u;
  const mask_of<T> by_edge = (by_x & by_y) | (by_y & by_z) | (by_z & by_x);
  // Along an edge shorter by what a normal across the edge reaches beyond the caps.
  const T beyond = a.r * sqrt(max(T(0.0), fnma(one, norm2(rest), one))) * recip(a.h);
  T high = select(by_edge, one - beyond, one), low = -high;
  const Vec3T<T> clipped = select(by_edge, a.c, line);
  clip_to_slab(clipped.x, way.x, select(by_x, wide, h.x), low, high);
  clip_to_slab(clipped.y, way.y, select(by_y, wide, h.y), low, high);
  clip_to_slab(clipped.z, way.z, select(by_z, wide, h.z), low, high);
  const T height = fma(abs(m.x), h.x, fma(abs(m.y), h.y, abs(m.z) * h.z));
  for (int k = 0; k < 2; ++k) {
    const T t = k == 0 ? low : high;
    const Vec3T<T> x = axpy(t, way, line), axis = axpy(t, way, a.c),
                   at = {sign(m.x) * h.x, sign(m.y) * h.y, sign(m.z) * h.z};
    // Across the edge, which may be further from the axis here than where they cross.
    const Vec3T<T> edge{select(by_x, at.x, axis.x), select(by_y, at.y, axis.y), select(by_z, at.z, axis.z)};
    T distance;
    const Vec3T<T> apart = direction(axis - edge, m, distance), normal = select(by_edge, apart, m);
    const T phi = select(by_edge, distance - a.r, dot(m, x) - height);
    const Vec3T<T> p = select(by_edge, axpy(T(0.5) * phi, apart, edge), axpy(T(-0.5) * phi, m, x));
    const mask_of<T> some = lies & (low <= high) & (phi < margin);
    put_where<T>(out, k, k == 0 ? some : mask_of<T>(some & ((high - low) * a.h > T(1e-6))), phi, p, normal);
  }
}

template <class T>
inline void cylinder_box(const ShapeT<T>& sa, const PoseT<T>& Xa, const ShapeT<T>& sb, const PoseT<T>& Xb,
                         const T& margin, ManifoldT<T>& out) {
  clear(out);
  const Vec3T<T> u = transposed_times(Xb.R, Xa.R.column(2)), zero{T(0.0), T(0.0), T(0.0)};
  CylinderBoxT<T> pair{{transposed_times(Xb.R, Xa.p - Xb.p), u, sa.size.x, T(0.5) * sa.size.y},
                       T(0.5) * sb.size,
                       {T(-1e300), zero, zero}};
  pair.try_flats();
  pair.try_crossings();
  if (!any(pair.best.phi < margin)) return;  // apart in all lanes: no lane has a point
  const auto unsure = [&] { return any((pair.best.phi < margin) & !pair.is_met()); };
  if (unsure()) pair.try_corners(transposed_times(Xb.R, Xa.R.column(0)));
  for (int i = 0; i < 3 && unsure(); ++i) pair.try_rims(i);
  if (unsure()) pair.try_flat_rims();
  const ClosestT<T>& exact = pair.best;
  const T along = dot(exact.n, u);
  const mask_of<T> near = exact.phi < margin;
  const mask_of<T> flat = near & (abs(along) > T(kFaceCosine)), side = near & (abs(along) < T(kAlongSine));
  if (any(flat)) cap_on_box<T>(pair.a, pair.h, sign(along) * u, flat, margin, out);
  if (any(side)) side_on_box<T>(pair.a, pair.h, exact.n, side, margin, out);
  put_exact<T>(exact, mask_from_bits<T>(0u), margin, out, kSameSupport);
  for (int k = 0; k < out.count; ++k) {
    out.point[k].p = Xb * out.point[k].p;
    out.point[k].n = Xb.R * out.point[k].n;
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
