#pragma once
// Distance of two cores on lanes (Gilbert, Johnson and Keerthi, IEEE J. Robotics and Automation 4 (1988)). Every lane
// ends by its own numbers and is not touched any more, so that its bits do not depend on its neighbours. Nothing is
// kept from step to step: when a pair was last looked at depends on culling, which must not change a bit.

#include "engine/contact/core.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Nearer than this (m) the direction from one core to the other is poor; that counts as an overlap.
inline constexpr double kCoresApart = 1e-7;

template <class T>
inline mask_of<T> no_lane() {
  return mask_from_bits<T>(0);
}

/// Weights of the point nearest to zero: of up to three old corners, and the rest of the new one.
template <class T>
struct WeightsT {
  T distance2, old[3];
  mask_of<T> inside;  // zero lies within all four

  void keep_if(const mask_of<T>& better, const T& d2, const T& x, int i, const T& y, int j) {
    distance2 = select(better, d2, distance2);
    for (int k = 0; k < 3; ++k) old[k] = select(better, k == i ? x : k == j ? y : T(0.0), old[k]);
  }
};

/// Tries all faces of the simplex that hold its new corner w, which has no case to get wrong. e: the edges from w to
/// the old corners, of those that are there.
template <class T>
struct FacesT {
  const Vec3T<T>& w;
  Vec3T<T> e[3];
  mask_of<T> there[3];
  T square[3], right[3];  // e . e, -e . w

  FacesT(const Vec3T<T>& w_, const Vec3T<T> (&old)[3], const T (&weight)[3]) : w(w_) {
    for (int i = 0; i < 3; ++i) {
      e[i] = old[i] - w;
      there[i] = weight[i] > T(0.0);
      square[i] = norm2(e[i]);
      right[i] = -dot(e[i], w);
    }
  }

  void try_edge(int i, WeightsT<T>& best) const {
    const T x = right[i] / square[i], d2 = norm2(axpy(x, e[i], w));
    best.keep_if(there[i] & (x >= T(0.0)) & (x <= T(1.0)) & (d2 < best.distance2), d2, x, i, x, i);
  }

  /// Solves for two weights, the larger diagonal first.
  void try_triangle(int i, int j, WeightsT<T>& best) const {
    const T both = dot(e[i], e[j]);
    const mask_of<T> first = square[i] >= square[j];
    const T g = select(first, square[i], square[j]), h = select(first, square[j], square[i]);
    const T right_g = select(first, right[i], right[j]), right_h = select(first, right[j], right[i]);
    const T l = both / g, second = fnma(l, right_g, right_h) / fnma(l, both, h);
    const T other = fnma(l, second, right_g / g);
    const T x = select(first, other, second), y = select(first, second, other);
    const T d2 = norm2(axpy(x, e[i], axpy(y, e[j], w)));
    const mask_of<T> within = (x >= T(0.0)) & (y >= T(0.0)) & (x + y <= T(1.0));
    best.keep_if(there[i] & there[j] & within & (d2 < best.distance2), d2, x, i, y, j);
  }

  /// Whether zero lies in the tetrahedron; what else comes out of a flat one is rounding.
  mask_of<T> inside() const {
    constexpr double kFlat = 1e-9;  // m
    const Vec3T<T> n0 = cross(e[1], e[2]), n1 = cross(e[2], e[0]), n2 = cross(e[0], e[1]);
    const T scale = T(-1.0) / dot(e[0], n0);
    const T x = scale * dot(w, n0), y = scale * dot(w, n1), z = scale * dot(w, n2);
    const Vec3T<T> off = axpy(x, e[0], axpy(y, e[1], axpy(z, e[2], w)));
    const mask_of<T> within = (x >= T(0.0)) & (y >= T(0.0)) & (z >= T(0.0)) & (x + y + z <= T(1.0));
    return there[0] & there[1] & there[2] & within & (norm2(off) <= T(kFlat * kFlat));
  }

  WeightsT<T> nearest() const {
    WeightsT<T> best{norm2(w), {T(0.0), T(0.0), T(0.0)}, inside()};
    for (int i = 0; i < 3; ++i) try_edge(i, best);
    try_triangle(0, 1, best);
    try_triangle(0, 2, best);
    try_triangle(1, 2, best);
    return best;
  }
};

/// Up to three corners of the difference of two cores, and the weights of their hull's point nearest to zero. A corner
/// without weight is not there.
template <class T>
struct SimplexT {
  Vec3T<T> a[3], b[3];  // points that the corners are the differences of
  T weight[3];

  /// The corner furthest against n, in `lanes`.
  SimplexT(const CoreT<T>& core_a, const CoreT<T>& core_b, const Vec3T<T>& n, const mask_of<T>& lanes) {
    for (int i = 0; i < 3; ++i) {
      a[i] = i == 0 ? core_a.support(-n, lanes) : a[0];
      b[i] = i == 0 ? core_b.support(n, lanes) : b[0];
      weight[i] = T(i == 0 ? 1.0 : 0.0);
    }
  }
  Vec3T<T> on_a() const { return sum(a); }
  Vec3T<T> on_b() const { return sum(b); }
  Vec3T<T> nearest() const {
    const Vec3T<T> w[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sum(w);
  }
  void move_a(const Vec3T<T>& way) {
    for (Vec3T<T>& p : a) p += way;
  }
  /// The new corner goes where an old one is without weight.
  void take(const mask_of<T>& where, const WeightsT<T>& weights, const Vec3T<T>& new_a, const Vec3T<T>& new_b) {
    const T left = T(1.0) - (weights.old[0] + weights.old[1] + weights.old[2]);
    mask_of<T> homeless = where;
    for (int i = 0; i < 3; ++i) {
      const mask_of<T> here = homeless & !(weights.old[i] > T(0.0));
      homeless = homeless & !here;
      a[i] = select(here, new_a, a[i]);
      b[i] = select(here, new_b, b[i]);
      weight[i] = select(here, left, select(where, weights.old[i], weight[i]));
    }
  }

 private:
  Vec3T<T> sum(const Vec3T<T> (&p)[3]) const { return axpy(weight[2], p[2], axpy(weight[1], p[1], weight[0] * p[0])); }
};

/// The direction of greatest separation that has been seen, |n| = 1.
template <class T>
struct WayApartT {
  T separation;
  Vec3T<T> n;

  void show(const mask_of<T>& lanes, const T& along, const Vec3T<T>& way) {
    const mask_of<T> better = lanes & (along > separation);
    separation = select(better, along, separation);
    n = select(better, way, n);
  }
};

/// Lanes in which cores overlap (or nearly), and in which they are more than enough apart; the others' nearest
/// points are in the simplex.
template <class T>
struct CoresT {
  mask_of<T> overlap, far;
};

/// Ends where the direction proves the distance to 1e-13 of it; or, far, where it proves that it is more than `enough`
/// and three quarters of that of the points found; or where rounding ends it.
template <class T>
GRAZE_OUT_OF_LINE CoresT<T> nearest_cores(const CoreT<T>& a, const CoreT<T>& b, const T& enough,
                                          const mask_of<T>& lanes, SimplexT<T>& simplex, WayApartT<T>& best) {
  constexpr int kMost = 100;
  constexpr double kProved = 1e-13;
  CoresT<T> out{no_lane<T>(), no_lane<T>()};
  mask_of<T> open = lanes;
  for (int i = 0; i < kMost && any(open); ++i) {
    const Vec3T<T> v = simplex.nearest();
    const T length2 = norm2(v), length = sqrt(length2);
    const mask_of<T> directed = length >= T(kCoresApart);
    out.overlap = out.overlap | (open & !directed);
    open = open & directed;
    const Vec3T<T> new_a = a.support(-v, open), new_b = b.support(v, open), w = new_a - new_b;
    const T proved = dot(v, w), inverse = recip(select(directed, length, T(1.0)));
    best.show(open, proved * inverse, inverse * v);
    open = open & !(length2 - proved <= T(kProved) * length2);
    const mask_of<T> far = open & (proved > max(enough, T(0.75) * length) * length);
    out.far = out.far | far;
    open = open & !far;
    const Vec3T<T> old[3] = {simplex.a[0] - simplex.b[0], simplex.a[1] - simplex.b[1], simplex.a[2] - simplex.b[2]};
    const WeightsT<T> weights = FacesT<T>(w, old, simplex.weight).nearest();
    out.overlap = out.overlap | (open & weights.inside);
    open = open & !weights.inside & (weights.distance2 < length2);
    simplex.take(open, weights, new_a, new_b);
  }
  return out;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
