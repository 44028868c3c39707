#pragma once
// One step of a block, semi-implicit Euler at velocity level with impulses (Stewart & Trinkle 1996).
//   settle   from q, v: poses, inertias, M, bias (kept from the end of a step for the beginning of the next)
//   begin    M + h D = L^T D L; change of L v by gravity, Coriolis and joint torques; which pairs are near
//   finish   contact points, impulses, v*, q+ = q + h v*, momentum and energy restored in v+, settle
// Reads and writes a LaneBlock (kernel.h); allocates nothing.

#include "engine/contact/brake.h"
#include "engine/contact/newton_solve.h"
#include "engine/contact/residuals.h"
#include "engine/lane_physics/audit.h"
#include "engine/lane_physics/contacts_of_step.h"
#include "engine/lane_physics/drive_of_step.h"
#include "engine/lane_physics/integrate.h"
#include "engine/lane_physics/joints_of_step.h"
#include "engine/lane_physics/push_out.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Velocities, bias and energy; momentum of floating trees, where the next step starts from.
template <class T>
inline void settle_velocity(const LaneBlock& block, const TreeT<T>& tree) {
  const T* v = rows<T>(block.v);
  const T kinetic = update_bias(tree, v);
  rows<T>(block.energy_audit)[kKinetic] = kinetic;
  *rows<T>(block.energy) = kinetic + potential_energy(tree);
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  for (int i = 0; i < tree.topology.bodies; ++i) {
    if (tree.topology.kind[i] == kFloating) balance[i].momentum = momentum_of_tree(tree, i, v);
  }
}

template <class T>
void settle(LaneBlock& block) {
  const TreeT<T> tree = tree_of<T>(block);
  update_poses<T>(tree, rows<T>(block.q));
  update_mass<T>(tree);
  settle_velocity<T>(block, tree);
}

/// World poses of the colliders and bounds of their speeds. `fastest`: the greatest of these; `way`: how far they have
/// gone since the last step.
template <class T>
inline void place_colliders(LaneBlock& block, const TreeT<T>& tree, T& fastest, WayT<T>& way) {
  PoseT<T>* pose = reinterpret_cast<PoseT<T>*>(block.pose);
  T* speed = rows<T>(block.speed);
  fastest = T(0.0);
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
    const PoseT<T> before = pose[i];
    pose[i].p = root < 0 ? r : r + tree.origin[root];
    if (collider.kind == kSphereKind) {  // whose R never changes: load_colliders
      way.add(before.p, pose[i].p);
    } else {
      pose[i].R = R * X_BG.R;
      way.add(before, pose[i], numbers[kRadius]);
    }
    const Vec3T<T> u = cross_add(motion.V.w, r, motion.V.l);
    const T spin = abs(motion.V.w.x) + abs(motion.V.w.y) + abs(motion.V.w.z);
    speed[i] = fma(spin, numbers[kRadius], abs(u.x) + abs(u.y) + abs(u.z));
    fastest = max(speed[i], fastest);
  }
}

/// Whether bodies are that far from their bases that newton_tree.h comes first.
inline bool is_deep(const LaneBlock& block) { return block.settings.tree_after < block.settings.newton_after; }

/// What M's diagonal has beside the inertias of bodies: the rotors', less what is there now or, `now`, with it.
template <class T>
inline void note_diagonal(const LaneBlock& block, const TreeT<T>& tree, bool now) {
  if (!is_deep(block)) return;
  const TopologyView& t = tree.topology;
  T* out = rows<T>(block.diagonal);
  for (int i = 0; i < t.bodies; ++i) {
    const int k = t.v[i];
    if (t.kind[i] == kFloating) {
      for (int d = 0; d < 6; ++d) out[k + d] = T(0.0);
      continue;
    }
    const T diagonal = tree.M[t.row[k] + t.dof_depth[k]];
    out[k] = now ? out[k] + diagonal : tree.body[i].armature - diagonal;
  }
}

/// M + h D and drives = L^T D L, and dz: the change of L v by all but constraints.
template <class T>
inline void move_freely(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active, const DriveView& drive) {
  const TopologyView& t = tree.topology;
  T* dz = rows<T>(block.dz);
  const T* v = rows<T>(block.v);
  for (int k = 0; k < t.nv; ++k) dz[k] = -(T(h) * tree.bias[k]);
  note_diagonal<T>(block, tree, false);
  if (drive.q) {
    add_drives<T>(block, tree, drive, h, active, dz);
  } else {
    for (int k = 0; k < block.na; ++k) {
      T& at = dz[block.actuated_dof[k]];
      at = fma(T(h), load<T>(drive.tau + k * kWidth<T>), at);
    }
  }
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] == kFloating) continue;
    // Viscous friction is implicit: (M + h D)(v+ - v) = h (tau - bias - D v).
    const int k = t.v[i];
    const T damping = T(h) * tree.body[i].damping;
    dz[k] = fnma(damping, v[k], dz[k]);
    T& diagonal = tree.M[t.row[k] + t.dof_depth[k]];
    diagonal += damping;
  }
  if (drive.prescribed) hold_joints<T>(block, tree, drive, h, dz);
  note_diagonal<T>(block, tree, true);
  factor_and_solve<T>(tree, dz);
  if (drive.prescribed) move_joints<T>(block, tree, drive, h, dz);
}

template <class T>
void begin(LaneBlock& block, double h, unsigned active, const DriveView& drive) {
  const TreeT<T> tree = tree_of<T>(block);
  T fastest;
  WayT<T> way;
  place_colliders<T>(block, tree, fastest, way);
  find_near_pairs<T>(block, h, active, fastest, way);
  for (int i = 0; i < tree.topology.bodies; ++i) block.locked[i] = 0;
  if (drive.q) {
    const int entries = tree.topology.row[tree.topology.nv];
    T* kept = rows<T>(block.M_kept);
    for (int i = 0; i < entries; ++i) kept[i] = tree.M[i];
    begin_servos<T>(block, drive, h);
  }
  move_freely<T>(block, tree, h, active, drive);
}

/// v+, q+ and all that follows from them. dz: the change of v. impulse_work: of the constraints, J.
template <class T>
inline void advance(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active, const DriveView& drive,
                    const T& impulse_work) {
  const TopologyView& t = tree.topology;
  const auto live = mask_from_bits<T>(active);
  T *v = rows<T>(block.v), *a = rows<T>(block.a), *dz = rows<T>(block.dz), *z = rows<T>(block.z);
  rows<T>(block.effort)[2] = work<T>(block, dz, h, drive);
  const T damper_work = given_by_dampers<T>(block, tree, dz, h);
  for (int k = 0; k < t.nv; ++k) {
    a[k] = v[k];
    v[k] = select(live, v[k] + dz[k], v[k]);
  }
  const T gravity_work = expect_energy<T>(block, tree, v, z, a, h, drive.q != nullptr);
  const T before = rows<T>(block.energy_audit)[kKinetic];
  integrate<T>(block, tree, h, live);
  if (block.pushing != 0) move_pushed<T>(block, tree, h);
  update_poses<T>(tree, rows<T>(block.q));
  update_mass<T>(tree);
  restore<T>(block, tree, live);
  const T rate(1.0 / h);
  for (int k = 0; k < t.nv; ++k) {
    // The sum with 0 turns -0, whose sign may depend on neighbours, into +0.
    const T now = v[k] + T(0.0);
    v[k] = now;
    a[k] = (now - a[k]) * rate;
  }
  settle_velocity<T>(block, tree);
  audit<T>(block, tree, h, active, before, impulse_work, gravity_work, rows<T>(block.effort)[2] + damper_work);
}

/// articulate() of deep trees; else null. Without contacts, too: rows of joints may need newton_tree.h.
template <class T>
inline const SpatialT<T>* articulate_deep(const LaneBlock& block, const TreeT<T>& tree) {
  if (!is_deep(block)) return nullptr;
  const TreeRowsT<T> memory(block.newton, tree.topology.bodies);
  articulate<T>(tree, rows<T>(block.diagonal), memory.A, memory.U);
  return memory.U;
}

/// Impulses of the step's constraints; dz becomes the change of v. Returns their work, J.
template <class T>
inline T solve(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active, const DriveView& drive,
               ConstraintsT<T>& set) {
  T* dz = rows<T>(block.dz);
  const ContactLawT<T>& law = *reinterpret_cast<const ContactLawT<T>*>(block.law);
  const MimicsT<T> mimics = follow_mimics<T>(block, tree, h, dz);
  find_contacts<T>(block, h);
  set.contacts = reinterpret_cast<ContactT<T>*>(block.contacts);
  set.contact_count = block.contact_count;
  set.paths = block.paths;
  set.memory = reinterpret_cast<SweepMemoryT<T>*>(block.sweep_memory);
  Vec3T<T>* scratch = reinterpret_cast<Vec3T<T>*>(block.scratch);
  const SpatialT<T>* U = articulate_deep<T>(block, tree);
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    set_up_contact<T>(tree, U, set.paths[c.path], mimics, law, T(h), dz, c, scratch);
  }
  set.joints = reinterpret_cast<JointRowT<T>*>(block.joints);
  set.joint_count = set_up_joints<T>(block, tree, mimics, h, active);
  set.servo_count =
      drive.q ? add_servo_rows<T>(block, tree, mimics, drive, h, active, set.joints + set.joint_count) : 0;
  set.joint_count += set.servo_count;
  T *z = rows<T>(block.z), *free = rows<T>(block.free);
  times_L<T>(tree, rows<T>(block.v), z);
  for (int k = 0; k < tree.topology.nv; ++k) free[k] = dz[k];
  warm_start<T>(set, dz);
  T* effort = rows<T>(block.effort);
  const NewtonT<T> newton{tree.topology.nv, tree.inverse_D, z, free, block.newton, &tree, rows<T>(block.diagonal)};
  const SolverSettings& settings = block.settings;
  const SolveBounds bounds{settings.most_sweeps, settings.newton_after, settings.most_newton_steps,
                           settings.tolerance,   settings.accepted,     settings.tree_after};
  solve_constraints<T>(law, bounds, active, newton, set, dz, effort[0], effort[1]);
  if (block.settings.measure) {
    *reinterpret_cast<ContactResidualsT<T>*>(block.measured) = contact_residuals<T>(law, set, dz);
  }
  // Drives may give energy: lanes in which some are impulses or infinite inertias are neither braked nor, as their work
  // is not in the audit of energy.
  unsigned driven = 0;
  for (int i = 0; i < tree.topology.bodies; ++i) driven |= block.locked[i];
  for (int i = set.joint_count - set.servo_count; i < set.joint_count; ++i) driven |= set.joints[i].lanes;
  T work = brake<T>(tree, set, z, free, ~driven, dz, effort[3]);
  if (mimics.count > 0) work += work_of<T>(mimics);
  const T impulse_work = select(mask_from_bits<T>(driven), T(1e300), work);
  for (int k = 0; k < tree.topology.nv; ++k) z[k] += dz[k];
  solve_L<T>(tree, dz);
  return impulse_work;
}

/// Not a number, in every lane of `lost`.
template <class T>
inline void forget(T* numbers, int count, const mask_of<T>& lost) {
  for (int i = 0; i < count; ++i) numbers[i] = select(lost, T(__builtin_nan("")), numbers[i]);
}

/// Where numbers have left the range of a double, all that the step shows becomes NaN, and always the same NaN: which
/// of them are infinite, and the sign of a NaN, depend on the compiler, the instruction set and the neighbours.
template <class T>
GRAZE_OUT_OF_LINE void forget_lost(LaneBlock& block, unsigned lanes) {
  const auto lost = mask_from_bits<T>(lanes);
  const TopologyView& t = block.topology;
  for (int i = 0; i < t.bodies; ++i) forget<T>(rows<T>(block.q) + t.q[i], t.kind[i] == kFloating ? 7 : 1, lost);
  forget<T>(rows<T>(block.v), t.nv, lost);
  forget<T>(rows<T>(block.a), t.nv, lost);
  forget<T>(rows<T>(block.X), 12 * t.bodies, lost);
  forget<T>(rows<T>(block.energy), 1, lost);
  forget<T>(rows<T>(block.effort) + 1, 3, lost);
  for (int k = 0; k < block.na; ++k) forget<T>(rows<T>(block.servo) + kServoRows * k + 2, 2, lost);
  for (int i = 0; i < block.contact_count; ++i) {
    T* row = rows<T>(block.report) + kContactRows * i;
    forget<T>(row, kMode, lost);  // places, gap and impulses
    forget<T>(row + kAge, 1, lost);
    row[kMode] = select(lost, T(0.0), row[kMode]);
  }
}

template <class T>
void finish(LaneBlock& block, double h, unsigned active, const DriveView& drive) {
  const TreeT<T> tree = tree_of<T>(block);
  ConstraintsT<T> set;
  T impulse_work = solve<T>(block, tree, h, active, drive, set);
  if (drive.q) {
    T* M = tree.M;
    while (settle_servos<T>(block, tree, drive, set, h, active, rows<T>(block.dz)) != 0) {
      const int entries = tree.topology.row[tree.topology.nv];
      for (int i = 0; i < entries; ++i) M[i] = rows<T>(block.M_kept)[i];
      move_freely<T>(block, tree, h, active, drive);
      impulse_work = solve<T>(block, tree, h, active, drive, set);
    }
    keep_servos<T>(block, drive, h, active);
  }
  keep_impulses<T>(block, set);
  expect_momentum<T>(block, tree, set, h);
  push_out<T>(block, tree, set, h, active);
  advance<T>(block, tree, h, active, drive, impulse_work);
  report_contacts<T>(block, tree, set, h);
  const unsigned lost = active & ~bits(abs(*rows<T>(block.energy)) < T(1e300));
  if (lost != 0) forget_lost<T>(block, lost);
  if (drive.torque) report_drives<T>(block, drive, active);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
