#pragma once
// Which pairs of colliders may touch within a step. Bounds only: a pair that is left out cannot touch in any lane, so
// the choice, which looks at all lanes together, changes no lane's bits. The distance of a pair is measured again only
// when its colliders may have come near since (they cannot have moved further than the fastest point of the block).

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

template <class T>
inline double least(const T& x, unsigned lanes) {
  double value[kWidth<T>];
  store(value, x);
  double out = 1e300;
  for (int l = 0; l < kWidth<T>; ++l) {
    if ((lanes >> l & 1u) && !(value[l] >= out)) out = value[l];  // a NaN counts as near
  }
  return out;
}

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

/// Fills block.near. `fastest`: bound over colliders and lanes, m/s.
template <class T>
inline void find_near_pairs(LaneBlock& block, double h, unsigned active, double fastest) {
  // 1.25: the way along the step's own motion, against the speed at its end.
  block.travel += 1.25 * block.last_h * fastest;
  block.last_h = h;
  const double safe = reserve(h) + 2 * h * fastest;
  block.near_count = 0;
  for (int i = 0; i < block.pair_count; ++i) {
    if (block.gap[i] - 2 * (block.travel - block.gap_travel[i]) > safe) continue;
    const PairView& pair = block.pairs[i];
    const T distance = separation<T>(block, pair);
    if ((active & ~bits(distance - reach<T>(block, pair, h) > T(0.0))) != 0) {
      block.near[block.near_count++] = i;
      block.gap[i] = 0;
    } else {
      block.gap[i] = least(distance, active);
    }
    block.gap_travel[i] = block.travel;
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
