#pragma once
// The contacts of a step: found, warm-started, kept and reported.

#include "engine/contact/collide.h"
#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"
#include "engine/lane_physics/culling.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Manifold points of which each lane has at most one, and what was kept of them.
template <class T>
struct PointRowT {
  ContactPointT<T> at;
  Vec3T<T> impulse;  // world, N s
  T slip_rate, slot;
  unsigned lanes = 0, slots = 0;  // slots: bit k: some lane's is k
  bool warm = false;              // something was kept in some lane

  void take(unsigned more, const ContactPointT<T>& point, int k, const T* kept) {
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)}, before = kept ? Vec3T<T>{kept[0], kept[1], kept[2]} : zero;
    const T rate = kept ? kept[3] : T(0.0);
    if (lanes == 0) {
      at = point, impulse = before, slip_rate = rate, slot = T(k);
    } else {
      const mask_of<T> here = mask_from_bits<T>(more);
      at = {select(here, point.phi, at.phi),
            select(here, point.p, at.p),
            select(here, point.n, at.n),
            select(here, point.feature_a, at.feature_a),
            select(here, point.feature_b, at.feature_b),
            at.valid};
      impulse = select(here, before, impulse);
      slip_rate = select(here, rate, slip_rate);
      slot = select(here, T(k), slot);
    }
    lanes |= more;
    slots |= 1u << k;
    warm = warm || kept != nullptr;
  }
};

/// Row r gets each lane's r-th point of those in `near`, in the order of slots. Lanes may use different slots, and a
/// contact costs as much for one lane as for eight. A lane's own points stay in order, so that its bits stay. Returns
/// the number of rows.
template <class T>
inline int pack_points(const LaneBlock& block, int pair_index, const ManifoldT<T>& manifold, unsigned near,
                       PointRowT<T>* row) {
  const T* warm = rows<T>(block.slot_impulse) + kKept * kSlots * pair_index;
  int count = 0;
  for (int k = 0; k < manifold.count; ++k) {
    const T* kept = block.slot_used[pair_index] >> k & 1 ? warm + kKept * k : nullptr;
    unsigned left = bits(manifold.point[k].valid) & near;
    for (int r = 0; left != 0; ++r) {
      const unsigned here = r < count ? left & ~row[r].lanes : left;
      if (here == 0) continue;
      row[r].take(here, manifold.point[k], k, kept);
      count = r < count ? count : r + 1;
      left &= ~here;
    }
  }
  return count;
}

/// Makes contacts of the manifold points that some lane of `near` has; keeps the last step's impulse where it goes on.
template <class T>
inline void add_contacts(LaneBlock& block, int pair_index, const ManifoldT<T>& manifold, unsigned near,
                         Vec3T<T>*& free_rows) {
  const PairView& pair = block.pairs[pair_index];
  const T* numbers = rows<T>(block.pair) + kPairRows * pair_index;
  ContactT<T>* contacts = reinterpret_cast<ContactT<T>*>(block.contacts);
  PointRowT<T> packed[kSlots];
  const int count = pack_points<T>(block, pair_index, manifold, near, packed);
  for (int r = 0; r < count; ++r) {
    const PointRowT<T>& row = packed[r];
    ContactT<T>& c = contacts[block.contact_count++];
    const auto valid = mask_from_bits<T>(row.lanes);
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
    c.n = select(valid, row.at.n, Vec3T<T>{T(0.0), T(0.0), T(1.0)});
    c.p = select(valid, row.at.p, zero);
    c.phi = select(valid, row.at.phi, T(0.0));
    c.friction = numbers[kPairFriction];
    c.restitution = numbers[kPairRestitution];
    c.spring = reinterpret_cast<const ContactSpringT<T>*>(numbers + kPairSpring);
    c.deep = numbers[kPairDeep];
    c.feature_a = row.at.feature_a;
    c.feature_b = row.at.feature_b;
    make_tangents(c);
    c.lambda = zero;
    c.slip_rate = T(0.0);
    if (row.warm) {
      c.lambda = to_local(c, select(valid, row.impulse, zero));
      c.slip_rate = select(valid, row.slip_rate, T(0.0));
    }
    c.warm = row.warm;
    c.lanes = row.lanes;
    c.pair = pair_index;
    c.slot = row.slot;
    c.slots = row.slots;
    c.path = pair.path;
    c.y = free_rows;
    free_rows += 2 * block.paths[pair.path].count;
  }
}

/// Of lanes of `near` without points.
template <class T>
inline void keep_axis(const LaneBlock& block, const PairView& pair, const ManifoldT<T>& manifold, unsigned near) {
  for (int k = 0; k < manifold.count; ++k) near &= ~bits(manifold.point[k].valid);
  const PoseT<T>& Xb = reinterpret_cast<const PoseT<T>*>(block.pose)[pair.b];
  Vec3T<T>& axis = reinterpret_cast<Vec3T<T>*>(block.axis)[pair.axis];
  axis = select(mask_from_bits<T>(near), transposed_times(Xb.R, manifold.axis), axis);
}

template <class T>
inline void find_contacts(LaneBlock& block, double h) {
  const PoseT<T>* pose = reinterpret_cast<const PoseT<T>*>(block.pose);
  Vec3T<T>* free_rows = reinterpret_cast<Vec3T<T>*>(block.contact_rows);
  block.contact_count = 0;
  for (int i = 0; i < block.near_count; ++i) {
    const PairView& pair = block.pairs[block.near[i]];
    ManifoldT<T> manifold;
    const ColliderView &a = block.colliders[pair.a], &b = block.colliders[pair.b];
    const ShapeT<T> shape_a = shape_of<T>(block, pair.a);
    const ShapeT<T> shape_b = shape_of<T>(block, pair.b);
    T margin = reach<T>(block, pair, h);
    const unsigned near = block.near_lanes[i];
    if (pair.axis >= 0) margin = select(mask_from_bits<T>(near), margin, T(-1e300));
    collide<T>(static_cast<ShapeKind>(a.kind), shape_a, pose[pair.a], static_cast<ShapeKind>(b.kind), shape_b,
               pose[pair.b], margin, manifold);
    if (pair.axis >= 0) keep_axis<T>(block, pair, manifold, near);
    add_contacts<T>(block, block.near[i], manifold, near, free_rows);
  }
}

/// Adds the impulses kept from the last step to dz.
template <class T>
inline void warm_start(const ConstraintsT<T>& set, T* dz) {
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    apply_row<T>(row, row.dry + row.lower - row.upper, dz);
  }
  ChangeT<T> change(dz);
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    if (!c.warm) continue;
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
    const Vec3T<T> impulse = to_world(c, c.lambda);
    const T numbers[kKept] = {impulse.x, impulse.y, impulse.z, c.slip_rate};
    const auto valid = mask_from_bits<T>(c.lanes);
    for (unsigned slots = c.slots; slots != 0; slots &= slots - 1) {
      const int k = __builtin_ctz(slots);
      const auto here = valid & (c.slot == T(k));
      T* kept = warm + kKept * (kSlots * c.pair + k);
      for (int row = 0; row < kKept; ++row) kept[row] = select(here, numbers[row], kept[row]);
      block.slot_used[c.pair] |= 1 << k;
    }
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
