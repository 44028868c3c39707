#pragma once
// Gap of two convex shapes on lanes: GJK while their cores are apart. Where they overlap, one is
// moved away from the other along the best direction that is known, and looked back at from there: that gives a
// direction that parts them by more (overlaps them by less), until there is none. From a shallow overlap, GJK's own
// directions lead to the least way out; a deep one is begun from other directions, too.

#include "engine/contact/gjk.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Nearest points, or deepest; n unit, from b to a; p_a = p_b + phi n. As CoreT, from the origin that both share.
template <class T>
struct CoreGapT {
  T phi;
  Vec3T<T> n, p_a, p_b;
};

/// n . x over a's core, least, minus n . x over b's, greatest: no greater than the cores' gap, for any unit n.
/// In `lanes`.
template <class T>
inline T separation(const CoreT<T>& a, const CoreT<T>& b, const Vec3T<T>& n, const mask_of<T>& lanes) {
  return dot(n, a.support(-n, lanes)) - dot(n, b.support(n, lanes));
}

/// How far away one is looked back at from the other, m. Any distance at which GJK is quick will do for faces and
/// edges; around a rim directions converge the sooner, the nearer that is.
template <class T>
inline double aside_of(const CoreT<T>& a, const CoreT<T>& b) {
  return a.kind == kinds::cylinder || b.kind == kinds::cylinder ? 1e-3 : 0.02;
}

/// Climbs from a direction, in `lanes`; `best` is replaced where the result is better. Of cores.
template <class T>
GRAZE_OUT_OF_LINE void step_out(const CoreT<T>& a, const CoreT<T>& b, mask_of<T> lanes, const WayApartT<T>& from,
                                CoreGapT<T>& best) {
  constexpr int kMost = 20;
  constexpr double kBetter = 1e-10;  // m
  const double aside = aside_of(a, b);
  SimplexT<T> simplex(a, b, from.n, lanes);  // of a where it is; the next place is not far from the last
  WayApartT<T> now = from;
  T last(-1e300);
  for (int i = 0; i < kMost; ++i) {
    lanes = lanes & (now.separation > last + T(kBetter));
    if (!any(lanes)) return;
    last = select(lanes, now.separation, last);
    const mask_of<T> better = lanes & (now.separation > best.phi);
    best.phi = select(better, now.separation, best.phi);
    best.n = select(better, now.n, best.n);
    CoreT<T> moved = a;
    const Vec3T<T> way = (T(aside) - now.separation) * now.n;
    moved.X.p += way;
    simplex.move_a(way);
    WayApartT<T> seen{T(-1e300), now.n};
    lanes = lanes & !nearest_cores<T>(moved, b, T(1e300), lanes, simplex, seen).overlap;
    const Vec3T<T> on_a = simplex.on_a() - way, on_b = simplex.on_b();
    simplex.move_a(-way);
    best.p_a = select(lanes & better, on_a, best.p_a);
    best.p_b = select(lanes & better, on_b, best.p_b);
    now.show(lanes, seen.separation - dot(way, seen.n), seen.n);
  }
}

/// Directions that are spread over the sphere, to a grid on the faces of a cube, with what they part two cores by.
template <class T>
class ManyWaysT {
 public:
  /// The directions turn with b.
  ManyWaysT(const CoreT<T>& a, const CoreT<T>& b, const mask_of<T>& lanes) {
    for (int x = -kGrid; x <= kGrid; ++x) {
      for (int y = -kGrid; y <= kGrid; ++y) {
        const bool side = x == -kGrid || x == kGrid || y == -kGrid || y == kGrid;
        for (int z = -kGrid; z <= kGrid; z += side ? 1 : 2 * kGrid) {
          const Vec3T<T> to{T(x), T(y), T(z)}, n = b.X.R * (recip(sqrt(norm2(to))) * to);
          way_[count_] = n;
          along_[count_++] = separation(a, b, n, lanes);
        }
      }
    }
  }
  /// Leaves out what lies near n.
  void pass_over(const Vec3T<T>& n) {
    constexpr double kNear = 0.9;
    for (int k = 0; k < count_; ++k) along_[k] = select(dot(way_[k], n) > T(kNear), T(-1e300), along_[k]);
  }
  WayApartT<T> widest() const {
    WayApartT<T> best{along_[0], way_[0]};
    for (int k = 1; k < count_; ++k) best.show(!no_lane<T>(), along_[k], way_[k]);
    return best;
  }

 private:
  static constexpr int kGrid = 2, kMost = 98;  // from the middle of a face to its edge; of all faces
  int count_ = 0;
  T along_[kMost];
  Vec3T<T> way_[kMost];
};

/// Begins from other directions than the one that led to `best`.
template <class T>
GRAZE_OUT_OF_LINE void look_around(const CoreT<T>& a, const CoreT<T>& b, const mask_of<T>& lanes, CoreGapT<T>& best) {
  constexpr int kStarts = 4;
  ManyWaysT<T> ways(a, b, lanes);
  ways.pass_over(best.n);
  for (int i = 0; i < kStarts; ++i) {
    const WayApartT<T> widest = ways.widest();
    step_out<T>(a, b, lanes, widest, best);
    ways.pass_over(widest.n);
  }
}

/// Cores that overlap, or nearly touch; in `lanes`. `first`: the best direction it saw.
template <class T>
inline CoreGapT<T> overlap_of(const CoreT<T>& a, const CoreT<T>& b, const mask_of<T>& lanes,
                              const WayApartT<T>& first) {
  constexpr double kShallow = 1e-3;  // m
  CoreGapT<T> best{T(-1e300), first.n, a.X.p, b.X.p};
  step_out<T>(a, b, lanes, first, best);
  const mask_of<T> deep = lanes & (best.phi < T(-kShallow));
  if (any(deep)) look_around<T>(a, b, deep, best);
  return best;
}

/// From gaps and points of cores to those of the shapes around them.
template <class T>
inline CoreGapT<T> with_rounding(const CoreT<T>& a, const CoreT<T>& b, const CoreGapT<T>& cores) {
  const T r_a = a.rounding(), r_b = b.rounding();
  return {cores.phi - r_a - r_b, cores.n, axpy(-r_a, cores.n, cores.p_a), axpy(r_b, cores.n, cores.p_b)};
}

/// The gap where it is less than `margin`; elsewhere phi is more than it, and n a direction along which the shapes are
/// that far apart. Lanes whose margin is -1e300 are not looked at.
template <class T>
inline CoreGapT<T> gap_of_cores(const CoreT<T>& a, const CoreT<T>& b, const T& margin) {
  constexpr double kRounding = 1e-9;  // m: where a bound decides, so would the gap
  T length;
  const Vec3T<T> up{T(0.0), T(0.0), T(1.0)}, outward = direction(a.X.p - b.X.p, up, length);
  const mask_of<T> lanes = margin > T(-1e299);
  SimplexT<T> simplex(a, b, outward, lanes);
  WayApartT<T> best{dot(outward, simplex.nearest()), outward};
  const T enough = margin + T(kRounding) + a.rounding() + b.rounding();
  const CoresT<T> cores = nearest_cores<T>(a, b, enough, lanes, simplex, best);
  const Vec3T<T> n = direction(simplex.nearest(), best.n, length);
  CoreGapT<T> out{length, n, simplex.on_a(), simplex.on_b()};
  if (any(cores.overlap)) {
    const CoreGapT<T> over = overlap_of(a, b, cores.overlap, best);
    // The ends as they touch, phi apart along n.
    const Vec3T<T> middle = T(0.5) * (over.p_a + over.p_b);
    out.phi = select(cores.overlap, over.phi, out.phi);
    out.n = select(cores.overlap, over.n, out.n);
    out.p_a = select(cores.overlap, axpy(T(0.5) * over.phi, over.n, middle), out.p_a);
    out.p_b = select(cores.overlap, axpy(T(-0.5) * over.phi, over.n, middle), out.p_b);
  }
  out.n = select(cores.far, best.n, out.n);
  out.phi = select(cores.far | !lanes, T(1e300), out.phi);
  return with_rounding(a, b, out);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
