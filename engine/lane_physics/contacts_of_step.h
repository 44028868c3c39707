#pragma once
// The contacts of a step: found, warm-started, kept and reported.

#include "engine/contact/collide.h"
#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"
#include "engine/lane_physics/culling.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Makes a contact of each manifold point that some lane of `near` has; keeps the last step's impulse where it goes on.
template <class T>
inline void add_contacts(LaneBlock& block, int pair_index, const ManifoldT<T>& manifold, unsigned near,
                         Vec3T<T>*& free_rows) {
  const PairView& pair = block.pairs[pair_index];
  const T* numbers = rows<T>(block.pair) + kPairRows * pair_index;
  const T* warm = rows<T>(block.slot_impulse) + kKept * kSlots * pair_index;
  ContactT<T>* contacts = reinterpret_cast<ContactT<T>*>(block.contacts);
  for (int k = 0; k < manifold.count; ++k) {
    const ContactPointT<T>& point = manifold.point[k];
    const unsigned lanes = bits(point.valid) & near;
    if (lanes == 0) continue;
    ContactT<T>& c = contacts[block.contact_count++];
    const auto valid = mask_from_bits<T>(lanes);
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
    c.n = select(valid, point.n, Vec3T<T>{T(0.0), T(0.0), T(1.0)});
    c.p = select(valid, point.p, zero);
    c.phi = select(valid, point.phi, T(0.0));
    c.friction = numbers[kPairFriction];
    c.restitution = numbers[kPairRestitution];
    c.spring = reinterpret_cast<const ContactSpringT<T>*>(numbers + kPairSpring);
    c.feature_a = point.feature_a;
    c.feature_b = point.feature_b;
    make_tangents(c);
    c.lambda = zero;
    c.slip_rate = T(0.0);
    if (block.slot_used[pair_index] >> k & 1) {
      const T* kept = warm + kKept * k;
      c.lambda = to_local(c, select(valid, Vec3T<T>{kept[0], kept[1], kept[2]}, zero));
      c.slip_rate = select(valid, kept[3], T(0.0));
    }
    c.lanes = lanes;
    c.pair = pair_index;
    c.slot = k;
    c.path = pair.path;
    c.y = free_rows;
    free_rows += 2 * block.paths[pair.path].count;
  }
}

template <class T>
inline void find_contacts(LaneBlock& block, double h) {
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  Vec3T<T>* free_rows = reinterpret_cast<Vec3T<T>*>(block.contact_rows);
  const double* given = block.manifolds;
  block.contact_count = 0;
  for (int i = 0; i < block.near_count; ++i) {
    const PairView& pair = block.pairs[block.near[i]];
    ManifoldT<T> manifold;
    if (pair.external) {
      read_manifold<T>(given, kSlots, manifold);
      given += kManifoldRows * kSlots * kWidth<T>;
      add_contacts<T>(block, block.near[i], manifold, block.near_lanes[i], free_rows);
      continue;
    }
    const ColliderView &a = block.colliders[pair.a], &b = block.colliders[pair.b];
    const ShapeT<T> shape_a = shape_of<T>(block, pair.a);
    const ShapeT<T> shape_b = shape_of<T>(block, pair.b);
    collide<T>(static_cast<ShapeKind>(a.kind), shape_a, pose[pair.a], static_cast<ShapeKind>(b.kind), shape_b,
               pose[pair.b], reach<T>(block, pair, h), manifold);
    add_contacts<T>(block, block.near[i], manifold, block.near_lanes[i], free_rows);
  }
}

/// Adds the impulses kept from the last step to dz.
template <class T>
inline void warm_start(const LaneBlock& block, const ConstraintsT<T>& set, T* dz) {
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    apply_row<T>(row, row.dry + row.lower - row.upper, dz);
  }
  ChangeT<T> change(dz);
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    if (!(block.slot_used[c.pair] >> c.slot & 1)) continue;
    change.turn_to(set.paths[c.path]);
    apply_impulse<T>(set.paths[c.path], c, c.lambda, change);
  }
  change.in_memory();
}

/// Keeps the impulses for the next step.
template <class T>
inline void keep_impulses(LaneBlock& block, const ConstraintsT<T>& set) {
  T* warm = rows<T>(block.slot_impulse);
  for (int i = 0; i < block.pair_count; ++i) {
    for (int k = 0; block.slot_used[i] != 0; ++k, block.slot_used[i] >>= 1) {
      if (!(block.slot_used[i] & 1)) continue;
      for (int row = 0; row < kKept; ++row) warm[kKept * (kSlots * i + k) + row] = T(0.0);
    }
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    T* kept = warm + kKept * (kSlots * c.pair + c.slot);
    const Vec3T<T> impulse = to_world(c, c.lambda);
    kept[0] = impulse.x, kept[1] = impulse.y, kept[2] = impulse.z, kept[3] = c.slip_rate;
    block.slot_used[c.pair] |= 1 << c.slot;
  }
  for (int i = 0; i < set.joint_count; ++i) {
    if (set.joints[i].body < 0) continue;
    T* kept = rows<T>(block.joint_impulse) + 3 * set.joints[i].body;
    kept[0] = set.joints[i].lower, kept[1] = set.joints[i].upper, kept[2] = set.joints[i].dry;
  }
}

/// Speed at which a contact's point moves over a round shape whose body has angular velocity w relative to the other,
/// m/s; 0 for shapes that are not round there.
template <class T>
inline T speed_over(const LaneBlock& block, const ContactT<T>& c, int collider, const T& feature, const Vec3T<T>& w) {
  const ShapeKind kind = static_cast<ShapeKind>(block.colliders[collider].kind);
  const T radius = collider_rows<T>(block, collider)[kSize];
  if (kind == kinds::sphere) {
    const Vec3T<T> along = axpy(-dot(w, c.n), c.n, w);
    return radius * sqrt(norm2(along));
  }
  if (kind != kinds::capsule && kind != kinds::cylinder) return T(0.0);
  const Vec3T<T> axis = reinterpret_cast<const PoseT<T>*>(block.pose)[collider].R.column(2);
  const T speed = radius * abs(dot(w, axis));
  return kind == kinds::capsule ? speed : select(abs(feature - T(features::side)) < T(0.5), speed, T(0.0));
}

/// Lanes in which a contact that sticks rolls (ContactMode).
template <class T>
inline mask_of<T> rolls(const LaneBlock& block, const TreeT<T>& tree, const ContactT<T>& c) {
  const PairView& pair = block.pairs[c.pair];
  const int a = block.colliders[pair.a].body, b = block.colliders[pair.b].body;
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  const Vec3T<T> w = (a < 0 ? zero : tree.motion[a].V.w) - (b < 0 ? zero : tree.motion[b].V.w);
  const T speed = max(speed_over(block, c, pair.a, c.feature_a, w), speed_over(block, c, pair.b, c.feature_b, w));
  return (speed > T(kRollSpeed)) & (c.lambda.x > T(0.0));
}

/// After the step has been taken: velocities are those of its end.
template <class T>
inline void report_contacts(LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, double h) {
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    T* row = rows<T>(block.report) + kContactRows * i;
    row[kPoint] = c.p.x, row[kPoint + 1] = c.p.y, row[kPoint + 2] = c.p.z;
    row[kNormal] = c.n.x, row[kNormal + 1] = c.n.y, row[kNormal + 2] = c.n.z;
    row[kGap] = c.phi;
    const Vec3T<T> impulse = to_world(c, c.lambda);
    row[kImpulse] = impulse.x, row[kImpulse + 1] = impulse.y, row[kImpulse + 2] = impulse.z;
    row[kNormalImpulse] = c.lambda.x;
    row[kMode] = select(c.slips > T(0.5), T(1.0), select(rolls(block, tree, c), T(2.0), T(0.0)));
    // It touched when the gap was used up; at once where there was none, at the end where it closes none.
    const T left = fma(c.phi, recip(min(c.free, T(-1e-9))), T(h));
    row[kAge] = select(c.phi > T(0.0), max(T(0.0), left), T(h));
    row[kFeatureA] = c.feature_a;
    row[kFeatureB] = c.feature_b;
    block.report_pair[i] = c.pair;
    block.report_lanes[i] = c.lanes;
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
