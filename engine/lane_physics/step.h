#pragma once
// One step of a block, semi-implicit Euler at velocity level with impulses (Stewart & Trinkle 1996).
//   settle   from q, v: poses, inertias, M, bias (kept from the end of a step for the beginning of the next)
//   begin    M + h D = L^T D L; change of L v by gravity, Coriolis and joint torques; which pairs are near
//   finish   contact points, impulses, v+, q+ = q + h v+, settle, momentum
// Reads and writes a LaneBlock (kernel.h); allocates nothing.

#include "engine/contact/collide.h"
#include "engine/contact/solver.h"
#include "engine/lane_physics/culling.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline T* rows(double* p) {
  return reinterpret_cast<T*>(p);
}

template <class T>
inline TreeT<T> tree_of(const LaneBlock& block) {
  TreeT<T> tree;
  tree.topology = block.topology;
  tree.body = reinterpret_cast<const BodyT<T>*>(block.body);
  tree.gravity = rows<T>(block.gravity);
  tree.motion = reinterpret_cast<MotionT<T>*>(block.motion);
  tree.pose = reinterpret_cast<PoseT<T>*>(block.X);
  tree.origin = reinterpret_cast<Vec3T<T>*>(block.origin);
  tree.M = rows<T>(block.M);
  tree.inverse_D = rows<T>(block.inverse_D);
  tree.bias = rows<T>(block.bias);
  return tree;
}

/// Velocities, bias and energy; momentum of floating trees, where the next step starts from.
template <class T>
inline void settle_velocity(const LaneBlock& block, const TreeT<T>& tree) {
  const T* v = rows<T>(block.v);
  const T kinetic = update_bias(tree, v);
  *rows<T>(block.energy) = kinetic + potential_energy(tree);
  SpatialT<T>* momentum = reinterpret_cast<SpatialT<T>*>(block.momentum);
  for (int i = 0; i < tree.topology.bodies; ++i) {
    if (tree.topology.kind[i] == kFloating) momentum[i] = momentum_of_tree(tree, i, v);
  }
}

template <class T>
void settle(LaneBlock& block) {
  const TreeT<T> tree = tree_of<T>(block);
  update_poses<T>(tree, rows<T>(block.q));
  update_mass<T>(tree);
  settle_velocity<T>(block, tree);
}

/// World poses of the colliders and bounds of their speeds. Returns the greatest of the active lanes.
template <class T>
inline double place_colliders(LaneBlock& block, const TreeT<T>& tree, unsigned active) {
  PoseT<T>* pose = reinterpret_cast<PoseT<T>*>(block.pose);
  T* speed = rows<T>(block.speed);
  T fastest(0.0);
  for (int i = 0; i < block.collider_count; ++i) {
    const ColliderView& collider = block.colliders[i];
    if (!collider.used) continue;
    const T* numbers = collider_rows<T>(block, i);
    const PoseT<T>& X_BG = *reinterpret_cast<const PoseT<T>*>(numbers + kPose);
    if (collider.body < 0) {
      pose[i] = X_BG;
      speed[i] = T(0.0);
      continue;
    }
    const MotionT<T>& motion = tree.motion[collider.body];
    const int root = tree.topology.root[collider.body];
    const RotT<T>& R = tree.pose[collider.body].R;
    const Vec3T<T> r = motion.p + R * X_BG.p;  // from O
    pose[i].p = root < 0 ? r : r + tree.origin[root];
    pose[i].R = collider.kind == kSphereKind ? R : R * X_BG.R;
    const Vec3T<T> u = cross_add(motion.V.w, r, motion.V.l);
    const T spin = abs(motion.V.w.x) + abs(motion.V.w.y) + abs(motion.V.w.z);
    speed[i] = fma(spin, numbers[kRadius], abs(u.x) + abs(u.y) + abs(u.z));
    fastest = max(speed[i], fastest);
  }
  return greatest(fastest, active);
}

template <class T>
void begin(LaneBlock& block, double h, unsigned active, const double* tau) {
  const TreeT<T> tree = tree_of<T>(block);
  const TopologyView& t = tree.topology;
  const double fastest = place_colliders<T>(block, tree, active);
  find_near_pairs<T>(block, h, active, fastest);
  T* dz = rows<T>(block.dz);
  const T* v = rows<T>(block.v);
  for (int k = 0; k < t.nv; ++k) dz[k] = -tree.bias[k];
  for (int k = 0; k < block.na; ++k) dz[block.actuated_dof[k]] += load<T>(tau + k * kWidth<T>);
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] == kFloating) continue;
    // Viscous friction is implicit: (M + h D)(v+ - v) = h (tau - bias - D v).
    const int k = t.v[i];
    const T damping = tree.body[i].damping;
    dz[k] = fnma(damping, v[k], dz[k]);
    T& diagonal = tree.M[t.row[k] + t.dof_depth[k]];
    diagonal = fma(T(h), damping, diagonal);
  }
  factor<T>(tree);
  for (int k = 0; k < t.nv; ++k) dz[k] = T(h) * dz[k];
  solve_LT<T>(tree, dz);
  for (int k = 0; k < t.nv; ++k) dz[k] *= tree.inverse_D[k];
}

/// Makes a contact of each manifold point that some active lane has; keeps the last step's impulse where it goes on.
template <class T>
inline void add_contacts(LaneBlock& block, int pair_index, const ManifoldT<T>& manifold, unsigned active,
                         Vec3T<T>*& free_rows) {
  const PairView& pair = block.pairs[pair_index];
  const T* numbers = rows<T>(block.pair) + 2 * pair_index;
  const T* warm = rows<T>(block.slot_impulse) + kKept * kSlots * pair_index;
  ContactT<T>* contacts = reinterpret_cast<ContactT<T>*>(block.contacts);
  for (int k = 0; k < manifold.count; ++k) {
    const ContactPointT<T>& point = manifold.point[k];
    const unsigned lanes = bits(point.valid) & active;
    if (lanes == 0) continue;
    ContactT<T>& c = contacts[block.contact_count++];
    const auto valid = mask_from_bits<T>(lanes);
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
    c.n = select(valid, point.n, Vec3T<T>{T(0.0), T(0.0), T(1.0)});
    c.p = select(valid, point.p, zero);
    c.phi = select(valid, point.phi, T(0.0));
    c.friction = numbers[0];
    c.restitution = numbers[1];
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
inline ShapeT<T> shape_of(const LaneBlock& block, int collider) {
  const T* size = collider_rows<T>(block, collider) + kSize;
  return {{size[0], size[1], size[2]}, block.colliders[collider].terrain};
}

template <class T>
inline void find_contacts(LaneBlock& block, double h, unsigned active) {
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
      add_contacts<T>(block, block.near[i], manifold, active, free_rows);
      continue;
    }
    const ColliderView &a = block.colliders[pair.a], &b = block.colliders[pair.b];
    const ShapeT<T> shape_a = shape_of<T>(block, pair.a);
    const ShapeT<T> shape_b = shape_of<T>(block, pair.b);
    collide<T>(static_cast<ShapeKind>(a.kind), shape_a, pose[pair.a], static_cast<ShapeKind>(b.kind), shape_b,
               pose[pair.b], reach<T>(block, pair, h), manifold);
    add_contacts<T>(block, block.near[i], manifold, active, free_rows);
  }
}

/// Rows of the joints that are near a limit or have dry friction.
template <class T>
inline int set_up_joints(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active) {
  const TopologyView& t = tree.topology;
  const T *q = rows<T>(block.q), *v = rows<T>(block.v);
  JointRowT<T>* joints = reinterpret_cast<JointRowT<T>*>(block.joints);
  T* free_rows = rows<T>(block.joint_rows);
  int count = 0;
  for (int i = 0; i < block.watched_count; ++i) {
    const int body = block.watched_body[i], dof = t.v[body];
    const T* limit = rows<T>(block.limit) + 3 * body;
    T* warm = rows<T>(block.joint_impulse) + 3 * body;
    const T below = q[t.q[body]] - limit[0], above = limit[1] - q[t.q[body]];
    // Near: closer than ten steps at this speed, and a reserve for impulses.
    const T near = fma(T(10.0 * h), abs(v[dof]), T(0.02));
    const unsigned lanes = bits((below < near) | (above < near) | (limit[2] > T(0.0))) & active;
    const auto in_force = mask_from_bits<T>(lanes);
    for (int k = 0; k < 3; ++k) warm[k] = select(in_force, warm[k], T(0.0));
    if (lanes == 0) continue;
    JointRowT<T>& row = joints[count++];
    row.body = body;
    row.dof = dof;
    row.lanes = lanes;
    row.y = free_rows;
    free_rows += 2 * (t.dof_depth[dof] + 1);
    set_up_joint<T>(tree, v, row);
    const T rate(1.0 / h);
    const auto gap = [&](const T& x) { return select(x < T(0.0), T(0.2) * x * rate, x * rate); };
    row.lower_gap = gap(below);
    row.upper_gap = gap(above);
    row.friction = T(h) * limit[2];
    row.lower = warm[0], row.upper = warm[1], row.dry = min(max(warm[2], -row.friction), row.friction);
  }
  return count;
}

/// Adds the impulses kept from the last step to dz.
template <class T>
inline void warm_start(const LaneBlock& block, const ConstraintsT<T>& set, T* dz) {
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    apply_row<T>(block.topology, row, row.dry + row.lower - row.upper, dz);
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    if (block.slot_used[c.pair] >> c.slot & 1) apply_impulse<T>(set.paths[c.path], c, c.lambda, dz);
  }
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
    T* kept = rows<T>(block.joint_impulse) + 3 * set.joints[i].body;
    kept[0] = set.joints[i].lower, kept[1] = set.joints[i].upper, kept[2] = set.joints[i].dry;
  }
}

template <class T>
inline void report_contacts(LaneBlock& block, const ConstraintsT<T>& set) {
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    T* row = rows<T>(block.report) + kContactRows * i;
    row[kPoint] = c.p.x, row[kPoint + 1] = c.p.y, row[kPoint + 2] = c.p.z;
    row[kNormal] = c.n.x, row[kNormal + 1] = c.n.y, row[kNormal + 2] = c.n.z;
    row[kGap] = c.phi;
    const Vec3T<T> impulse = to_world(c, c.lambda);
    row[kImpulse] = impulse.x, row[kImpulse + 1] = impulse.y, row[kImpulse + 2] = impulse.z;
    row[kSlips] = c.slips;
    row[kFeatureA] = c.feature_a;
    row[kFeatureB] = c.feature_b;
    block.report_pair[i] = c.pair;
    block.report_lanes[i] = c.lanes;
  }
}

/// Momentum about O that each floating tree must have after the step: what it had, gravity and contacts.
template <class T>
inline void expect_momentum(const LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, double h) {
  const TopologyView& t = tree.topology;
  SpatialT<T>* momentum = reinterpret_cast<SpatialT<T>*>(block.momentum);
  const Vec3T<T> pull{T(h) * tree.gravity[0], T(h) * tree.gravity[1], T(h) * tree.gravity[2]};
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] != kFloating) continue;
    const InertiaT<T>& C = tree.motion[i].C;
    momentum[i] = {cross_add(C.h, pull, momentum[i].w), axpy(C.m, pull, momentum[i].l)};
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    for (int side = 0; side < 2; ++side) {
      const int body = side == 0 ? path.body_a : path.body_b;
      const int root = body < 0 ? -1 : t.root[body];
      if (root < 0) continue;
      const Vec3T<T> impulse = side == 0 ? to_world(c, c.lambda) : -to_world(c, c.lambda);
      momentum[root] = {cross_add(c.p - tree.origin[root], impulse, momentum[root].w), momentum[root].l + impulse};
    }
  }
}

/// q+ = q + h v+, the attitude by the exponential of the (constant) angular velocity. Lanes that are not `live` stay.
template <class T>
inline void integrate(const LaneBlock& block, const TopologyView& t, double h, const mask_of<T>& live) {
  T* q = rows<T>(block.q);
  const T* v = rows<T>(block.v);
  for (int i = 0; i < t.bodies; ++i) {
    T* qi = q + t.q[i];
    const T* vi = v + t.v[i];
    if (t.kind[i] != kFloating) {
      qi[0] = select(live, fma(T(h), vi[0], qi[0]), qi[0]);
      continue;
    }
    const Vec3T<T> w{vi[0], vi[1], vi[2]};
    const T rate = sqrt(norm2(w));
    T s, c;
    sin_cos(T(0.5 * h) * rate, s, c);
    const Vec3T<T> e = select(rate > T(1e-100), s * recip(max(rate, T(1e-100))), T(0.5 * h)) * w;
    const Vec3T<T> x{qi[1], qi[2], qi[3]};
    T qw = fnma(e.x, x.x, fnma(e.y, x.y, fnma(e.z, x.z, c * qi[0])));
    Vec3T<T> qx = axpy(qi[0], e, cross_add(e, x, c * x));
    // One Newton step towards length 1, which rounding alone has changed.
    const T scale = fnma(T(0.5), fma(qw, qw, norm2(qx)), T(1.5));
    qi[0] = select(live, scale * qw, qi[0]);
    qi[1] = select(live, scale * qx.x, qi[1]);
    qi[2] = select(live, scale * qx.y, qi[2]);
    qi[3] = select(live, scale * qx.z, qi[3]);
    for (int k = 0; k < 3; ++k) qi[4 + k] = select(live, fma(T(h), vi[3 + k], qi[4 + k]), qi[4 + k]);
  }
}

/// Gives each floating tree the momentum it must have at its new configuration, by a rigid motion of the whole tree (of
/// second order in h): free flight then keeps momentum to rounding. `before`: O at the beginning of the step.
template <class T>
inline void restore_momentum(const LaneBlock& block, const TreeT<T>& tree, const Vec3T<T>* before,
                             const mask_of<T>& live) {
  const TopologyView& t = tree.topology;
  const SpatialT<T>* momentum = reinterpret_cast<const SpatialT<T>*>(block.momentum);
  T* v = rows<T>(block.v);
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] != kFloating) continue;
    const SpatialT<T> now = momentum_of_tree(tree, i, v);
    const Vec3T<T> moved = tree.origin[i] - before[i];
    const SpatialT<T> missing{momentum[i].w - cross(moved, momentum[i].l) - now.w, momentum[i].l - now.l};
    const SpatialT<T> dv = velocity_for_momentum(tree.motion[i].C, missing);
    T* vi = v + t.v[i];
    vi[0] = select(live, vi[0] + dv.w.x, vi[0]), vi[3] = select(live, vi[3] + dv.l.x, vi[3]);
    vi[1] = select(live, vi[1] + dv.w.y, vi[1]), vi[4] = select(live, vi[4] + dv.l.y, vi[4]);
    vi[2] = select(live, vi[2] + dv.w.z, vi[2]), vi[5] = select(live, vi[5] + dv.l.z, vi[5]);
  }
}

/// Work of the joint torques over the step, with the mean speed.
template <class T>
inline T work(const LaneBlock& block, const T* change, double h, const double* tau) {
  const T* v = rows<T>(block.v);
  T sum(0.0);
  for (int k = 0; k < block.na; ++k) {
    const int dof = block.actuated_dof[k];
    sum = fma(load<T>(tau + k * kWidth<T>), fma(T(0.5), change[dof], v[dof]), sum);
  }
  return T(h) * sum;
}

/// v+, q+ and all that follows from them.
template <class T>
inline void advance(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active, const double* tau) {
  const TopologyView& t = tree.topology;
  const auto live = mask_from_bits<T>(active);
  T *v = rows<T>(block.v), *a = rows<T>(block.a), *dz = rows<T>(block.dz);
  Vec3T<T>* before = reinterpret_cast<Vec3T<T>*>(block.scratch);
  solve_L<T>(tree, dz);
  rows<T>(block.worth)[2] = work<T>(block, dz, h, tau);
  for (int k = 0; k < t.nv; ++k) {
    a[k] = v[k];
    v[k] = select(live, v[k] + dz[k], v[k]);
  }
  for (int i = 0; i < t.bodies; ++i) before[i] = tree.origin[i];
  integrate<T>(block, t, h, live);
  update_poses<T>(tree, rows<T>(block.q));
  update_mass<T>(tree);
  restore_momentum<T>(block, tree, before, live);
  const T rate(1.0 / h);
  // The sum with 0 turns -0, whose sign may depend on neighbours, into +0.
  for (int k = 0; k < t.nv; ++k) v[k] = v[k] + T(0.0);
  for (int k = 0; k < t.nv; ++k) a[k] = (v[k] - a[k]) * rate;
  settle_velocity<T>(block, tree);
}

template <class T>
void finish(LaneBlock& block, double h, unsigned active, const double* tau) {
  const TreeT<T> tree = tree_of<T>(block);
  T* dz = rows<T>(block.dz);
  const ContactLawT<T>& law = *reinterpret_cast<const ContactLawT<T>*>(block.law);
  find_contacts<T>(block, h, active);
  ConstraintsT<T> set;
  set.contacts = reinterpret_cast<ContactT<T>*>(block.contacts);
  set.contact_count = block.contact_count;
  set.paths = block.paths;
  Vec3T<T>* scratch = reinterpret_cast<Vec3T<T>*>(block.scratch);
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    set_up_contact<T>(tree, set.paths[c.path], law, T(h), dz, c, scratch);
  }
  set.joints = reinterpret_cast<JointRowT<T>*>(block.joints);
  set.joint_count = set_up_joints<T>(block, tree, h, active);
  warm_start<T>(block, set, dz);
  T* worth = rows<T>(block.worth);
  solve_constraints<T>(tree.topology, law, block.settings.most_sweeps, block.settings.tolerance, active, set, dz,
                       worth[0], worth[1]);
  keep_impulses<T>(block, set);
  report_contacts<T>(block, set);
  expect_momentum<T>(block, tree, set, h);
  advance<T>(block, tree, h, active, tau);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
