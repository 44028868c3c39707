#pragma once
// Which pairs of colliders may touch within a step. The distance of a pair is measured again only when its colliders
// may have come near since: when the ways that they have gone add up to it. Every lane has bounds of its own, and a
// lane is near only where its own say so, because bounds round, and a lane that took part in what a neighbour's bounds
// let through would have other bits than alone.

#include "engine/lane_physics/kernel.h"
#include "engine/lanes/vec.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline const T* collider_rows(const LaneBlock& block, int collider) {
  return reinterpret_cast<const T*>(block.collider) + kColliderRows * collider;
}

/// Distance of a point from the box of half edges e at X, at least; 0 inside.
template <class T>
inline T distance_from_box(const Vec3T<T>& p, const PoseT<T>& X, const T* e) {
  const Vec3T<T> local = transposed_times(X.R, p - X.p);
  const Vec3T<T> out{max(abs(local.x) - e[0], T(0.0)), max(abs(local.y) - e[1], T(0.0)),
                     max(abs(local.z) - e[2], T(0.0))};
  return sqrt(norm2(out));
}

/// A lower bound of the distance of two colliders, m.
template <class T>
inline T separation(const LaneBlock& block, const PairView& pair) {
  const T* a = collider_rows<T>(block, pair.a);
  const T* b = collider_rows<T>(block, pair.b);
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  const PoseT<T>&Xa = pose[pair.a], &Xb = pose[pair.b];
  if (block.colliders[pair.b].kind == kPlaneKind) return dot(Xb.R.column(2), Xa.p - Xb.p) - a[kRadius];
  if (block.colliders[pair.a].kind == kPlaneKind) return dot(Xa.R.column(2), Xb.p - Xa.p) - b[kRadius];
  return max(distance_from_box(Xa.p, Xb, b + kExtent) - a[kRadius],
             distance_from_box(Xb.p, Xa, a + kExtent) - b[kRadius]);
}

/// The least number of `lanes`; NaN counts as -1e300.
template <class T>
inline double least(const T& x, unsigned lanes) {
  double value[kWidth<T>];
  store(value, select(x > T(-1e300), x, T(-1e300)));
  double out = 1e300;
  for (int l = 0; l < kWidth<T>; ++l) {
    if (lanes >> l & 1u) out = min(out, value[l]);
  }
  return out;
}

/// The greatest number of `lanes`; NaN counts as 1e300.
template <class T>
inline double greatest(const T& x, unsigned lanes) {
  return -least(-x, lanes);
}

/// Reserve of a contact's reach beyond what present speeds cover: 1 mm, and acceleration of 100 m/s^2 within the step.
inline double reserve(double h) { return 1e-3 + 50 * h * h; }

/// How far apart points may be to be contacts of this step, m.
template <class T>
inline T reach(const LaneBlock& block, const PairView& pair, double h) {
  const T* speed = reinterpret_cast<const T*>(block.speed);
  return fma(T(h), speed[pair.a] + speed[pair.b], T(reserve(h)));
}

/// Bounds of how far the points of colliders have gone within a step, greatest of all colliders.
template <class T>
struct WayT {
  T origin{0.0};  // of their frames' origins, m
  T turn2{0.0};   // of the others from there, squared: the chord of the frame's turn at the collider's radius, m^2

  /// A frame without directions.
  void add(const Vec3T<T>& from, const Vec3T<T>& to) {
    const Vec3T<T> p = to - from;
    origin = max(origin, abs(p.x) + abs(p.y) + abs(p.z));
  }
  /// Of R the change of two axes is enough: |dR|_2^2 <= |dx|^2 + |dz|^2.
  void add(const PoseT<T>& from, const PoseT<T>& to, const T& radius) {
    add(from.p, to.p);
    const Vec3T<T> x = to.R.column(0) - from.R.column(0), z = to.R.column(2) - from.R.column(2);
    turn2 = max(turn2, radius * radius * dot_add(x, x, norm2(z)));
  }
  T bound() const { return origin + sqrt(turn2); }
};

/// Fills block.near. `fastest`: bound of the speeds of all colliders, m/s; `way`: that they have gone since the last
/// step.
template <class T>
inline void find_near_pairs(LaneBlock& block, double h, unsigned active, const T& fastest, const WayT<T>& way) {
  T& travel = *reinterpret_cast<T*>(block.travel);
  travel = select(mask_from_bits<T>(block.fresh), T(0.0), travel + way.bound());
  block.fresh &= ~active;
  const T horizon = fma(T(2.0), travel, fma(T(2.0 * h), fastest, T(reserve(h))));
  const double furthest = greatest(horizon, active);
  T* due = reinterpret_cast<T*>(block.due);
  block.near_count = 0;
  for (int i = 0; i < block.pair_count; ++i) {
    if (block.soonest[i] > furthest) continue;
    const unsigned pending = active & ~bits(due[i] > horizon);
    if (pending == 0) continue;
    const PairView& pair = block.pairs[i];
    const T distance = separation<T>(block, pair);
    const unsigned near = pending & ~bits(distance - reach<T>(block, pair, h) > T(0.0));
    const T next = select(mask_from_bits<T>(near), T(-1e300), fma(T(2.0), travel, distance));
    due[i] = select(mask_from_bits<T>(pending), next, due[i]);
    block.soonest[i] = least(due[i], active);
    if (near == 0) continue;
    block.near_lanes[block.near_count] = near;
    block.near[block.near_count++] = i;
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
