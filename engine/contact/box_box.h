#pragma once
// Two boxes. First the exact gap and normal: apart, the least distance of a corner of one from the other, or of two
// edges; overlapping, the axis of least overlap among the 15 of the separating-axis theorem. Then, if that normal is
// (nearly) a face's, the manifold: the other box's opposite face clipped to this face, up to eight points.

#include "engine/contact/box.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct BoxT {
  PoseT<T> X;
  Vec3T<T> h;  // half edges
};

/// Half edge vector along axis k (0 to 2).
template <class T>
inline Vec3T<T> half_edge(const BoxT<T>& box, int k) {
  return (k == 0 ? box.h.x : k == 1 ? box.h.y : box.h.z) * box.X.R.column(k);
}
/// How far the box reaches from its centre along `n`.
template <class T>
inline T reach_along(const BoxT<T>& box, const Vec3T<T>& n) {
  const Vec3T<T> local = transposed_times(box.X.R, n);
  return fma(abs(local.x), box.h.x, fma(abs(local.y), box.h.y, abs(local.z) * box.h.z));
}

/// Corner that is furthest along n.
template <class T>
inline Vec3T<T> furthest(const BoxT<T>& box, const Vec3T<T>& n) {
  Vec3T<T> out = box.X.p;
  for (int k = 0; k < 3; ++k) {
    const Vec3T<T> e = half_edge(box, k);
    out += sign(dot(n, e)) * e;
  }
  return out;
}

/// Gap along n (from b to a) with the nearest points' middle.
template <class T>
struct ClosestT {
  T phi;
  Vec3T<T> n, p;
};

template <class T>
inline void keep_if(const mask_of<T>& better, const T& phi, const Vec3T<T>& n, const Vec3T<T>& p, ClosestT<T>& best) {
  best = {select(better, phi, best.phi), select(better, n, best.n), select(better, p, best.p)};
}

/// Corners of `first` against `second`; `toward` is +1 when `first` is a.
template <class T>
inline void try_corners(const BoxT<T>& first, const BoxT<T>& second, double toward, ClosestT<T>& best) {
  for (int k = 0; k < 8; ++k) {
    const Vec3T<T> x = first.X * box_corner(first.h, k);
    const NearestT<T> near = nearest_on_box(transposed_times(second.X.R, x - second.X.p), second.h);
    const Vec3T<T> outward = second.X.R * near.n;
    keep_if<T>(near.d < best.phi, near.d, T(toward) * outward, axpy(T(-0.5) * near.d, outward, x), best);
  }
}

/// Nearest points of the edges that support a and b against each other along n.
template <class T>
inline void edge_points(const BoxT<T>& a, const BoxT<T>& b, int i, int j, const Vec3T<T>& n, Vec3T<T>& on_a,
                        Vec3T<T>& on_b) {
  Vec3T<T> ca = a.X.p, cb = b.X.p;
  for (int k = 0; k < 3; ++k) {
    const Vec3T<T> ea = half_edge(a, k), eb = half_edge(b, k);
    if (k != i) ca -= sign(dot(n, ea)) * ea;
    if (k != j) cb += sign(dot(n, eb)) * eb;
  }
  const Vec3T<T> u = half_edge(a, i), v = half_edge(b, j);
  const SegmentPairT<T> nearest = nearest_of_segments(ca - cb, u, v);
  on_a = axpy(nearest.s, u, ca);
  on_b = axpy(nearest.t, v, cb);
}

/// Overlap along the axes of faces and pairs of edges, and distances of edges.
template <class T>
struct AxesT {
  ClosestT<T> overlap;  // greatest gap over the axes: the gap, if the boxes overlap
  ClosestT<T> edge;     // nearest pair of edges, for boxes that are apart
};

template <class T>
inline void try_edges(const BoxT<T>& a, const BoxT<T>& b, AxesT<T>& axes) {
  const Vec3T<T> from = a.X.p - b.X.p;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vec3T<T> across = cross(a.X.R.column(i), b.X.R.column(j));
      const T length = sqrt(norm2(across));
      const mask_of<T> usable = length > T(1e-6);
      Vec3T<T> n = recip(select(usable, length, T(1.0))) * across;
      n = sign(dot(n, from)) * n;
      const T gap = dot(n, from) - reach_along(a, n) - reach_along(b, n);
      Vec3T<T> on_a, on_b;
      edge_points(a, b, i, j, n, on_a, on_b);
      const Vec3T<T> middle = T(0.5) * (on_a + on_b);
      keep_if<T>(usable & (gap > axes.overlap.phi + T(kSameGap)), gap, n, middle, axes.overlap);
      T distance;
      const Vec3T<T> apart = direction(on_a - on_b, n, distance);
      keep_if<T>(usable & (distance < axes.edge.phi), distance, apart, middle, axes.edge);
    }
  }
}

template <class T>
inline AxesT<T> try_axes(const BoxT<T>& a, const BoxT<T>& b) {
  const Vec3T<T> from = a.X.p - b.X.p;
  AxesT<T> axes{{T(-1e300), from, from}, {T(1e300), from, from}};
  for (int k = 0; k < 6; ++k) {
    const Vec3T<T> axis = k < 3 ? a.X.R.column(k) : b.X.R.column(k - 3);
    const Vec3T<T> n = sign(dot(axis, from)) * axis;
    const T gap = dot(n, from) - reach_along(a, n) - reach_along(b, n);
    const Vec3T<T> p = k < 3 ? axpy(T(0.5) * gap, n, furthest(b, n)) : axpy(T(-0.5) * gap, n, furthest(a, -n));
    keep_if<T>(gap > axes.overlap.phi + T(kSameGap), gap, n, p, axes.overlap);
  }
  try_edges(a, b, axes);
  return axes;
}

/// Where the boxes come nearest, or overlap the least.
template <class T>
inline ClosestT<T> closest(const BoxT<T>& a, const BoxT<T>& b) {
  const AxesT<T> axes = try_axes(a, b);
  ClosestT<T> best = axes.edge;
  best.phi = T(1e300);
  try_corners(a, b, 1.0, best);
  try_corners(b, a, -1.0, best);
  keep_if<T>(axes.edge.phi < best.phi, axes.edge.phi, axes.edge.n, axes.edge.p, best);
  // Nearly touching points give a poor direction; an axis that parts the boxes as far is a good one.
  best.n = select(axes.overlap.phi > best.phi - T(kSameGap), axes.overlap.n, best.n);
  const mask_of<T> overlapping = axes.overlap.phi <= T(0.0);
  keep_if<T>(overlapping, axes.overlap.phi, axes.overlap.n, axes.overlap.p, best);
  return best;
}

/// The axes of a box in an order that begins with the one along which |n| is largest.
template <class T>
struct FaceT {
  Vec3T<T> centre, normal, e1, e2;  // of the face toward n; e1 and e2 are half edges
  T cosine;
};

template <class T>
inline FaceT<T> face_toward(const BoxT<T>& box, const Vec3T<T>& n) {
  const Vec3T<T> local = transposed_times(box.X.R, n);
  const T x = abs(local.x), y = abs(local.y), z = abs(local.z);
  const mask_of<T> is_x = (x >= y) & (x >= z), is_y = (!is_x) & (y >= z);
  const auto pick = [&](const Vec3T<T>& a, const Vec3T<T>& b, const Vec3T<T>& c) {
    return select(is_x, a, select(is_y, b, c));
  };
  const Vec3T<T> X = half_edge(box, 0), Y = half_edge(box, 1), Z = half_edge(box, 2);
  const Vec3T<T> axis = pick(box.X.R.column(0), box.X.R.column(1), box.X.R.column(2));
  const T s = sign(dot(axis, n));
  return {box.X.p + s * pick(X, Y, Z), s * axis, pick(Y, Z, X), pick(Z, X, Y), max(max(x, y), z)};
}

template <class T>
inline FaceT<T> select_face(const mask_of<T>& mask, const FaceT<T>& a, const FaceT<T>& b) {
  return {select(mask, a.centre, b.centre), select(mask, a.normal, b.normal), select(mask, a.e1, b.e1),
          select(mask, a.e2, b.e2), select(mask, a.cosine, b.cosine)};
}

/// The reference face lies in z = 0 of its frame, with half edges w along x and y; the incident face is
/// c + alpha e1 + beta e2 there.
template <class T>
struct ClippingT {
  T wx, wy, loose;  // loose: so much outside still counts as on the edge
  Vec3T<T> c, e1, e2;
  ManifoldT<T>* out;  // p in the reference face's frame until the end

  /// Slots 2 k and 2 k + 1: where edge k of the incident face enters and leaves the reference face's prism.
  void edge(int k, const mask_of<T>& wanted) const {
    const double s1[5] = {1, -1, -1, 1, 1}, s2[5] = {1, 1, -1, -1, 1};
    const Vec3T<T> from = axpy(T(s1[k]), e1, axpy(T(s2[k]), e2, c));
    const Vec3T<T> to = axpy(T(s1[k + 1]), e1, axpy(T(s2[k + 1]), e2, c));
    const Vec3T<T> way = to - from;
    T low(0.0), high(1.0);
    cut(from.x, way.x, wx + loose, low, high);
    cut(from.y, way.y, wy + loose, low, high);
    const mask_of<T> some = wanted & (low <= high);
    put<T>(*out, 2 * k, T(0.0), axpy(low, way, from), c, some);
    put<T>(*out, 2 * k + 1, T(0.0), axpy(high, way, from), c, some & (high < T(1.0)));
  }

  /// A corner of the reference face that lies inside the incident one, into a slot that is free.
  void corner(int k, const mask_of<T>& wanted) const {
    const T x = k == 0 || k == 3 ? wx : -wx, y = k < 2 ? wy : -wy;
    const T inverse = recip(divisor(fma(e1.x, e2.y, -(e1.y * e2.x))));
    const T dx = x - c.x, dy = y - c.y;
    const T alpha = fma(dx, e2.y, -(dy * e2.x)) * inverse, beta = fma(e1.x, dy, -(e1.y * dx)) * inverse;
    mask_of<T> want = wanted & (max(abs(alpha), abs(beta)) < T(1.0 - 1e-5));
    const Vec3T<T> point{x, y, fma(alpha, e1.z, fma(beta, e2.z, c.z))};
    for (int i = 0; i < 8; ++i) {
      const int slot = (2 * k + 1 + 2 * i + (i >= 4 ? 1 : 0)) % 8;
      const mask_of<T> take = want & !out->point[slot].valid;
      put_where<T>(*out, slot, take, T(0.0), point, c);
      want = want & !take;
    }
  }

 private:
  static void cut(const T& c, const T& u, const T& h, T& low, T& high) {
    const T inverse = recip(divisor(u));
    const T from = (-h - c) * inverse, to = (h - c) * inverse;
    low = max(low, min(from, to));
    high = min(high, max(from, to));
  }
};

/// Fills all slots by clipping the incident face to the reference face, where `wanted`.
template <class T>
inline void clip_faces(const FaceT<T>& reference, const FaceT<T>& incident, const mask_of<T>& wanted, const T& toward_a,
                       const T& margin, ManifoldT<T>& out) {
  const T wx = sqrt(norm2(reference.e1)), wy = sqrt(norm2(reference.e2));
  const Vec3T<T> x = recip(wx) * reference.e1, y = recip(wy) * reference.e2, z = reference.normal;
  const auto local = [&](const Vec3T<T>& v) { return Vec3T<T>{dot(x, v), dot(y, v), dot(z, v)}; };
  const ClippingT<T> clipping{
      wx,  wy, T(1e-6) * (wx + wy), local(incident.centre - reference.centre), local(incident.e1), local(incident.e2),
      &out};
  for (int k = 0; k < 4; ++k) clipping.edge(k, wanted);
  for (int k = 0; k < 4; ++k) clipping.corner(k, wanted);
  for (int k = 0; k < 8; ++k) {
    ContactPointT<T>& point = out.point[k];
    const Vec3T<T> q = point.p;
    point.phi = q.z;
    point.p = axpy(q.x, x, axpy(q.y, y, axpy(T(0.5) * q.z, z, reference.centre)));
    point.n = toward_a * z;
    point.valid = point.valid & (point.phi < margin);
  }
}

/// Sets the deepest slot to the exact gap and normal, and the exact point if the slot did not have it. An overlap along
/// a face's normal (`by_face`) has its point from the clipping, if that found one. Gaps within `same` (m) are one
/// point's.
template <class T>
inline void put_exact(const ClosestT<T>& exact, const mask_of<T>& by_face, const T& margin, ManifoldT<T>& out,
                      double same = kSamePoint) {
  const T none(1e300);
  T deepest = none, slot(0.0);
  for (int k = 0; k < 8; ++k) {
    const mask_of<T> deeper = out.point[k].valid & (out.point[k].phi < deepest);
    deepest = select(deeper, out.point[k].phi, deepest);
    slot = select(deeper, T(k), slot);
  }
  const mask_of<T> wanted = exact.phi < margin, found = deepest < none;
  const mask_of<T> other = (exact.phi < deepest - T(same)) & !(by_face & found);
  for (int k = 0; k < 8; ++k) {
    put_where<T>(out, k, wanted & (slot == T(k)), exact.phi, select(other, exact.p, out.point[k].p), exact.n);
  }
}

template <class T>
inline void box_box(const ShapeT<T>& sa, const PoseT<T>& Xa, const ShapeT<T>& sb, const PoseT<T>& Xb, const T& margin,
                    ManifoldT<T>& out) {
  out.count = 8;
  const BoxT<T> a{Xa, T(0.5) * sa.size}, b{Xb, T(0.5) * sb.size};
  const ClosestT<T> exact = closest(a, b);
  const FaceT<T> face_a = face_toward(a, -exact.n), face_b = face_toward(b, exact.n);
  // Nearly parallel faces: always a's, so that the points keep their slots.
  const mask_of<T> on_a = face_a.cosine > face_b.cosine - T(1e-4);
  const FaceT<T> reference = select_face(on_a, face_a, face_b);
  const FaceT<T> incident = select_face(on_a, face_toward(b, -reference.normal), face_toward(a, -reference.normal));
  const mask_of<T> flat = (reference.cosine > T(kFaceCosine)) & (exact.phi < margin);
  clip_faces(reference, incident, flat, select(on_a, T(-1.0), T(1.0)), margin, out);
  const mask_of<T> by_face = (exact.phi <= T(0.0)) & (max(face_a.cosine, face_b.cosine) > T(1.0 - 1e-12));
  put_exact<T>(exact, by_face, margin, out);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
