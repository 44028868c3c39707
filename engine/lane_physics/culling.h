#pragma once
// Which pairs of colliders may touch within a step. The distance of a pair is measured again only when its colliders
// may have come near since: when the ways that they have gone add up to it. Every lane has bounds of its own, which are
// looked at only when those of some lane may be used up. A lane is near only where its own bounds say so, so that it
// does not take part in contacts that only a neighbour may have.

#include "engine/contact/reach.h"
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

/// How far a collider reaches toward a plane of normal n, at most: by its ball and its box.
template <class T>
inline T reach_to_plane(const LaneBlock& block, int collider, const PoseT<T>& X, const Vec3T<T>& n) {
  const T* numbers = collider_rows<T>(block, collider);
  if (block.colliders[collider].kind == kSphereKind) return numbers[kRadius];
  const Vec3T<T> local = transposed_times(X.R, n);
  const T* e = numbers + kExtent;
  return min(numbers[kRadius], fma(abs(local.x), e[0], fma(abs(local.y), e[1], abs(local.z) * e[2])));
}

/// A lower bound of the distance of two colliders, m.
template <class T>
inline T separation(const LaneBlock& block, const PairView& pair) {
  const T* a = collider_rows<T>(block, pair.a);
  const T* b = collider_rows<T>(block, pair.b);
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  const PoseT<T>&Xa = pose[pair.a], &Xb = pose[pair.b];
  if (block.colliders[pair.b].kind == kPlaneKind) {
    const Vec3T<T> n = Xb.R.column(2);
    return dot(n, Xa.p - Xb.p) - reach_to_plane<T>(block, pair.a, Xa, n);
  }
  if (block.colliders[pair.a].kind == kPlaneKind) {
    const Vec3T<T> n = Xa.R.column(2);
    return dot(n, Xb.p - Xa.p) - reach_to_plane<T>(block, pair.b, Xb, n);
  }
  return max(distance_from_box(Xa.p, Xb, b + kExtent) - a[kRadius],
             distance_from_box(Xb.p, Xa, a + kExtent) - b[kRadius]);
}

template <class T>
inline ShapeT<T> shape_of(const LaneBlock& block, int collider) {
  const T* size = collider_rows<T>(block, collider) + kSize;
  return {{size[0], size[1], size[2]}, block.colliders[collider].terrain, block.colliders[collider].hull};
}

/// Guard of bounds along axes, m: more than any of the sums rounds.
inline constexpr double kAxisGuard = 1e-9;

/// Another bound, along the axis that is kept of a pair. It counts less by a guard, so that what is passed over because
/// of it has no contact for certain: then it does not matter which axis it is.
template <class T>
inline T separation_on_axis(const LaneBlock& block, const PairView& pair) {
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  const PoseT<T>&Xa = pose[pair.a], &Xb = pose[pair.b];
  const Vec3T<T> n = Xb.R * reinterpret_cast<const Vec3T<T>*>(block.axis)[pair.axis];
  const auto reach_of = [&](int collider, const PoseT<T>& X, const Vec3T<T>& way) {
    return reach_of_shape(ShapeKind(block.colliders[collider].kind), shape_of<T>(block, collider), X, way);
  };
  return dot(n, Xa.p - Xb.p) - reach_of(pair.a, Xa, -n) - reach_of(pair.b, Xb, n) - T(kAxisGuard);
}

/// Another bound, of a flat pair: the greatest of the gaps along its faces' normals, and along the line between the
/// origins as far as it is across a round one's axis. With a guard, likewise.
template <class T>
inline T separation_of_flat(const LaneBlock& block, const PairView& pair) {
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  const int colliders[] = {pair.a, pair.b};
  const Vec3T<T> from = pose[pair.a].p - pose[pair.b].p;
  T most(-1e300);
  const auto look_along = [&](const Vec3T<T>& n) {
    T gap = abs(dot(n, from));
    for (const int one : colliders) {
      gap -= reach_of_shape(ShapeKind(block.colliders[one].kind), shape_of<T>(block, one), pose[one], n);
    }
    most = max(most, gap);
  };
  for (const int one : colliders) {
    const RotT<T>& R = pose[one].R;
    const Vec3T<T> axis = R.column(2);
    look_along(axis);
    if (block.colliders[one].kind == kBoxKind) {
      look_along(R.column(0));
      look_along(R.column(1));
    } else {
      const Vec3T<T> across = axpy(-dot(axis, from), axis, from);
      look_along(recip(max(sqrt(norm2(across)), T(1e-150))) * across);
    }
  }
  return most - T(kAxisGuard);
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

/// Added to what counts as near, m. Gaps at the rims of cylinders, which take iterations, are wrong by up to 1e-6, and
/// sums of ways by rounding: a pair that is passed over has no contact for certain. So it does not matter when a pair
/// was last measured, and all lanes may be measured together.
inline constexpr double kCullingSlack = 2e-6;

/// The ways that have been gone, twice: travel[0] of each lane's own colliders; travel[1] the sum of each step's
/// greatest, as it was when the lane last took part. Returns that of now. block.soonest holds for lanes that have taken
/// part since it was written: where another one joins, it begins anew.
template <class T>
inline double add_way(LaneBlock& block, unsigned active, const WayT<T>& way) {
  constexpr double kFarthest = 100, kLeast = 1e-9;  // m; beyond the first, or after a NaN, the sum begins anew
  constexpr unsigned kAll = ~0u >> (32 - kWidth<T>);
  T* travel = reinterpret_cast<T*>(block.travel);
  const mask_of<T> fresh = mask_from_bits<T>(block.fresh);
  const T gone = select(fresh, T(0.0), T(2.0) * way.bound());
  block.fresh &= ~active;
  travel[0] = select(fresh, T(0.0), travel[0] + gone);
  const double last = greatest(travel[1], kAll);
  const unsigned joining = active & ~bits(travel[1] == T(last));
  double most = last + max(greatest(gone, active), kLeast);  // grows, so that who stands still is behind
  const bool anew = !(most < kFarthest);
  if (anew) {
    most = 0;
    travel[1] = T(-1.0);
  }
  travel[1] = select(mask_from_bits<T>(active), T(most), travel[1]);
  if (anew || joining != 0) {
    for (int i = 0; i < block.pair_count; ++i) block.soonest[i] = -1e300;
  }
  return most;
}

/// Measures a pair where it may have come near: in `active` lanes whose `due` lies within the horizon. Returns the
/// lanes in which it is near.
template <class T>
inline unsigned look_at_pair(const LaneBlock& block, int i, double h, unsigned active, const T& travel,
                             const T& horizon) {
  T& due = reinterpret_cast<T*>(block.due)[i];
  const unsigned pending = active & ~bits(due > horizon);
  if (pending == 0) return 0;
  const PairView& pair = block.pairs[i];
  T distance = separation<T>(block, pair);
  unsigned near = pending & ~bits(distance - reach<T>(block, pair, h) > T(0.0));
  if (near != 0 && (pair.axis >= 0 || pair.flat)) {
    const T other = pair.flat ? separation_of_flat<T>(block, pair) : separation_on_axis<T>(block, pair);
    distance = select(mask_from_bits<T>(near), max(distance, other), distance);
    near &= ~bits(distance - reach<T>(block, pair, h) > T(0.0));
  }
  const T next = select(mask_from_bits<T>(near), T(-1e300), max(due, travel + distance));
  due = select(mask_from_bits<T>(active), next, due);
  return near;
}

/// Fills block.near. `fastest`: bound of the speeds of all colliders, m/s; `way`: that they have gone since the last
/// step.
template <class T>
inline void find_near_pairs(LaneBlock& block, double h, unsigned active, const T& fastest, const WayT<T>& way) {
  constexpr int W = kWidth<T>;
  const double most = add_way<T>(block, active, way);
  const T travel = *reinterpret_cast<T*>(block.travel);
  const T ahead = fma(T(2.0 * h), fastest, T(reserve(h) + kCullingSlack)), horizon = travel + ahead;
  const double furthest = most + greatest(ahead, active) + 1e-3 * kCullingSlack;  // more than either sum rounds
  block.near_count = 0;
  for (int first = 0; first < block.pair_count; first += W) {
    // W pairs at a time, as most are far apart in all lanes.
    unsigned soon = ~bits(load<T>(block.soonest + first) > T(furthest)) & ((1u << W) - 1u);
    for (; soon != 0; soon &= soon - 1) {
      const int i = first + __builtin_ctz(soon);
      if (i >= block.pair_count) break;
      const unsigned near = look_at_pair<T>(block, i, h, active, travel, horizon);
      const T left = reinterpret_cast<const T*>(block.due)[i] - travel;
      block.soonest[i] = near != 0 ? -1e300 : most + least(left, active);
      if (near == 0) continue;
      block.near_lanes[block.near_count] = near;
      block.near[block.near_count++] = i;
    }
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
