#pragma once
// The law of the tracker `inverse_dynamics` on lanes (inverse_dynamics.cpp says what it is), at the velocity level
// (Eqs. 68-71): joints shall move at v + h a_des at the end of the control step; contact impulses are predicted from
// that (contact_program.h); torques follow from the equation of motion.

#include "engine/control/contact_finding.h"
#include "engine/control/kernel.h"
#include "engine/control/operational_wish.h"
#include "engine/dynamics/equation.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Joint velocities that the contacts change by more than that contradict them, rad/s or m/s for each unit of the
/// weight of torques: what torques alone do is a hundredth of it.
inline constexpr double kContradiction = 10;
/// Where hands grip, how exactly impulses must have settled before joints take the velocities that go with them, as a
/// share of the largest: what is left of a contradiction comes back as force a million times.
inline constexpr double kMendedError = 1e-9;

template <class T>
inline TreeT<T> tree_of(const InverseDynamicsView& view) {
  const InverseDynamicsMemory& m = view.memory;
  return {view.topology,
          reinterpret_cast<const BodyT<T>*>(m.body),
          rows_of<T>(m.gravity),
          reinterpret_cast<MotionT<T>*>(m.motion),
          reinterpret_cast<PoseT<T>*>(m.pose),
          reinterpret_cast<Vec3T<T>*>(m.origin),
          rows_of<T>(m.M),
          rows_of<T>(m.inverse_D),
          rows_of<T>(m.bias)};
}

/// Sensed q and v of the nominal robot.
template <class T>
inline void read_state(const InverseDynamicsView& view, const InverseDynamicsCall& call, T* q, T* v) {
  const auto at = [](const double* rows, int i) { return load<T>(rows + i * kWidth<T>); };
  if (view.floating) {
    T s[3], c[3];  // of half the roll, pitch and yaw: R = Rz Ry Rx
    for (int i = 0; i < 3; ++i) sin_cos(T(0.5) * at(call.base_rpy, i), s[i], c[i]);
    q[0] = fma(s[2], s[1] * s[0], c[2] * c[1] * c[0]);
    q[1] = fnma(s[2], s[1] * c[0], c[2] * c[1] * s[0]);
    q[2] = fma(s[2], c[1] * s[0], c[2] * s[1] * c[0]);
    q[3] = fnma(c[2], s[1] * s[0], s[2] * c[1] * c[0]);
    for (int i = 0; i < 3; ++i) {
      q[4 + i] = at(call.base_position, i);
      v[i] = at(call.base_rate, i);
      v[3 + i] = at(call.base_velocity, i);
    }
  }
  for (int i = view.floating ? 1 : 0; i < view.free_count; ++i) {
    const FreeBodyView& body = view.free[i];  // one that is not told of is anywhere, and touches nothing
    const bool told = body.row >= 0;
    for (int k = 0; k < 7; ++k) q[body.q + k] = told ? at(call.object_state, body.row + k) : T(k == 0 ? 1.0 : 0.0);
    for (int k = 0; k < 6; ++k) v[body.dof + k] = told ? at(call.object_state, body.row + 7 + k) : T(0.0);
  }
  for (int k = 0; k < view.na; ++k) {
    q[view.q[k]] = at(call.joint_position, k);
    v[view.v[k]] = at(call.joint_velocity, k);
  }
  for (int i = 0; i < view.follower_count; ++i) {
    const FollowerView& f = view.followers[i];
    q[f.q] = fma(T(f.multiplier), q[f.other_q], T(f.offset));
    v[f.v] = T(f.multiplier) * v[f.other_v];
  }
}

template <class T>
inline void wish_of_joints(const InverseDynamicsView& view, const InverseDynamicsCall& call, const T* q, const T* v,
                           T* want) {
  for (int k = 0; k < view.na; ++k) {
    const T off = load<T>(call.target_q + k * kWidth<T>) - q[view.q[k]];
    const T slow = load<T>(call.target_v + k * kWidth<T>) - v[view.v[k]];
    T acceleration = fma(T(view.kp[k]), off, T(view.kd[k]) * slow);
    if (call.error_sum != nullptr) {
      acceleration = fma(T(view.ki[k]), load<T>(call.error_sum + k * kWidth<T>), acceleration);
    }
    want[view.v[k]] = fma(T(view.h), acceleration, v[view.v[k]]);
  }
}

/// Joint velocities at the end of the step (Eq. 71).
template <class T>
inline void wish(const InverseDynamicsView& view, const InverseDynamicsCall& call, const T* q, const T* v, T* want) {
  view.operational.effectors > 0 ? wish_of_effectors(view, call, v, want) : wish_of_joints(view, call, q, v, want);
  for (int i = 0; i < view.follower_count; ++i) {
    const FollowerView& f = view.followers[i];
    want[f.v] = T(f.multiplier) * want[f.other_v];
  }
}

/// x := A^-1 x with the inertia of a free body.
template <class T>
inline void solve_free_body(const TreeT<T>& tree, const FreeBodyView& body, T (&x)[6]) {
  T A[36];
  for (int k = 0; k < 6; ++k) {
    for (int d = 0; d <= k; ++d) A[6 * k + d] = tree.M[body.mass + base_entry(k, d)];
  }
  solve_spd<T, 6, 6>(6, A, x);
}

/// The velocities of the base and of objects after the step but for contacts, if the joints move as wished: their rows
/// of M want = M v - h bias.
template <class T>
inline void move_free_bodies(const InverseDynamicsView& view, const TreeT<T>& tree, const T* v, T* want) {
  for (int i = 0; i < view.free_count; ++i) {
    const FreeBodyView& body = view.free[i];
    T* const own = want + body.dof;
    for (int k = 0; k < 6; ++k) own[k] = T(0.0);
    const SpatialT<T> now = momentum_of_tree(tree, body.body, v), joints = momentum_of_tree(tree, body.body, want);
    const T h(view.h), *bias = tree.bias + body.dof;
    T x[6] = {now.w.x - joints.w.x, now.w.y - joints.w.y, now.w.z - joints.w.z,
              now.l.x - joints.l.x, now.l.y - joints.l.y, now.l.z - joints.l.z};
    for (int k = 0; k < 6; ++k) x[k] = fnma(h, bias[k], x[k]);
    solve_free_body(tree, body, x);
    for (int k = 0; k < 6; ++k) own[k] = x[k];
  }
}

/// to := select(lanes, from, to) of the free bodies' velocities.
template <class T>
inline void take_free(const InverseDynamicsView& view, const mask_of<T>& lanes, const T* from, T* to) {
  for (int i = 0; i < view.free_count; ++i) {
    for (int k = view.free[i].dof; k < view.free[i].dof + 6; ++k) to[k] = select(lanes, from[k], to[k]);
  }
}

/// Softness of the joints, eps s, and its inverse, their weight. s makes the two parts of the objective comparable: it
/// has the unit 1/(kg m^2). One for all joints, as printed, or where hands grip each joint's own, because the short
/// levers of fingers would take up what contradicts them too slowly beside those of an arm.
template <class T>
inline void weigh_joints(const InverseDynamicsView& view, const ContactProgramT<T>& program) {
  T *const weight = rows_of<T>(view.memory.weight), *const soft = rows_of<T>(view.memory.soft);
  T free(0.0), joints(0.0);
  for (int k = 0; k < view.topology.nv; ++k) weight[k] = soft[k] = T(0.0);
  for (int i = 0; i < program.count; ++i) {
    const auto valid = mask_from_bits<T>(program.lanes[i]);
    const int* dofs = program.path(i);
    T sum(0.0);
    for (int d = 6 * view.free_count; d < program.dofs_above(i); ++d) {
      const T own = norm2(program.jacobian[program.room * i + d]);
      sum += own;
      soft[dofs[d]] += select(valid, own, T(0.0));
    }
    free += select(valid, T(3.0) * program.contacts[i].a, T(0.0));
    joints += select(valid, sum, T(0.0));
  }
  for (int k = view.joint_begin; k < view.joint_end; ++k) {
    const T felt = view.grips() ? soft[k] : joints;
    const auto some = felt > T(0.0);
    const T s = select(some, free * recip(select(some, felt, T(1.0))), T(1.0));
    soft[k] = T(view.stiffness) * s;
    weight[k] = recip(soft[k]);
  }
}

/// torque = what gives the joints' velocities `want` in the step, less the contacts' part; rows of all dofs.
template <class T>
inline void joint_torques(const InverseDynamicsView& view, const TreeT<T>& tree, const ContactProgramT<T>& program,
                          const T* v, const T* want, T* torque) {
  const T rate(1.0 / view.h);
  T* a = rows_of<T>(view.memory.step);
  for (int k = 0; k < view.topology.nv; ++k) a[k] = rate * (want[k] - v[k]);
  inverse_dynamics<T>(tree, v, a, torque);
  for (int k = 0; k < view.topology.nv; ++k) torque[k] = fma(T(view.damping[k]), want[k], torque[k]);
  for (int i = 0; i < program.count; ++i) {
    const Vec3T<T> force = rate * program.contacts[i].cone.kept;
    for (int d = 0; d < program.dofs_above(i); ++d) {
      T& at = torque[program.path(i)[d]];
      at -= dot(program.jacobian[program.room * i + d], force);
    }
  }
}

/// Where the program's joints move otherwise than wished, the contacts do not allow what is wished: then the nearest
/// velocities that they allow take its place (Eqs. 78-82). Returns these lanes; their impulses begin anew.
template <class T>
inline mask_of<T> mend_wish(const InverseDynamicsView& view, const TreeT<T>& tree, const mask_of<T>& open, const T* v,
                            T* want, const ContactProgramT<T>& program) {
  T off(0.0);
  for (int k = view.joint_begin; k < view.joint_end; ++k) off = max(off, abs(program.z[k] - want[k]));
  const mask_of<T> contradicts = view.grips() ? open : open & (off > T(kContradiction * view.stiffness));
  if (!any(contradicts)) return contradicts;
  const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
  for (int k = view.joint_begin; k < view.joint_end; ++k) want[k] = select(contradicts, program.z[k], want[k]);
  T* const before = program.trial;
  for (int k = 0; k < view.topology.nv; ++k) before[k] = want[k];
  move_free_bodies(view, tree, v, want);
  take_free(view, !contradicts, before, want);
  for (int i = 0; i < program.count; ++i) {
    program.contacts[i].cone.kept = select(contradicts, none, program.contacts[i].cone.kept);
  }
  return contradicts;
}

/// The contacts begin with the impulses of the step before.
template <class T>
inline void recall_impulses(const InverseDynamicsView& view, const ContactProgramT<T>& program) {
  const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
  for (int i = 0; i < program.count; ++i) {
    const T* then = rows_of<T>(view.memory.impulse) + 3 * view.memory.place_of_contact[i];
    program.contacts[i].cone.kept =
        select(mask_from_bits<T>(program.lanes[i]), Vec3T<T>{then[0], then[1], then[2]}, none);
  }
}

/// What the contacts have come to in the lanes of `open` is remembered, and nothing else of the active ones.
template <class T>
inline void remember_impulses(const InverseDynamicsView& view, unsigned active, const mask_of<T>& open,
                              const ContactProgramT<T>& program) {
  T* const then = rows_of<T>(view.memory.impulse);
  const auto acts = mask_from_bits<T>(active);
  for (int k = 0; k < 3 * view.memory.places; ++k) then[k] = select(acts, T(0.0), then[k]);
  for (int i = 0; i < program.count; ++i) {
    const auto valid = open & mask_from_bits<T>(program.lanes[i]);
    const Vec3T<T>& now = program.contacts[i].cone.kept;
    T* const own = then + 3 * view.memory.place_of_contact[i];
    own[0] = select(valid, now.x, own[0]), own[1] = select(valid, now.y, own[1]);
    own[2] = select(valid, now.z, own[2]);
  }
}

/// Impulses of the lanes that have contacts, and the velocities that go with them: the base's part of `want` becomes
/// what it will be, the joints' what can be had. Twice, because the torques that shall be least depend on how the base
/// moves. Where hands grip, the first time without torques: joints then move as the program's do (mend_wish), and one
/// that gives way to its torque would sink, onto what it does not touch.
template <class T>
GRAZE_OUT_OF_LINE void predict_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                        const TreeT<T>& tree, const T* v, T* want, const ContactProgramT<T>& program) {
  const int nv = view.topology.nv;
  T *const torque = rows_of<T>(view.memory.torque), *const free = rows_of<T>(view.memory.free), *const z = program.z;
  unsigned touched = 0;
  for (int i = 0; i < program.count; ++i) touched |= program.lanes[i];
  const auto open = mask_from_bits<T>(touched & call.active);
  weigh_joints(view, program);
  const T wrench(kWrenchError * view.weight * view.h), last(kLastR * view.stiffness);
  const T* const soft = rows_of<T>(view.memory.soft);
  ContactProgramT<T> without = program;
  without.count = 0;
  recall_impulses(view, program);
  T share(kFirstR);
  for (int k = 0; k < nv; ++k) z[k] = want[k];
  take_free(view, open, v, z);
  for (int round = 0; round < 2; ++round) {
    joint_torques(view, tree, without, v, z, torque);
    for (int k = 0; k < nv; ++k) free[k] = want[k];
    const T h(view.grips() && round == 0 ? 0.0 : view.h);
    for (int k = view.joint_begin; k < view.joint_end; ++k) free[k] = fnma(soft[k] * h, torque[k], want[k]);
    program.solve(open, share, view.stiffness, wrench, round > 0);
    if (round > 0) break;
    if (view.grips()) program.solve(open, last, view.stiffness, wrench, true, kMendedError);
    const mask_of<T> mended = mend_wish(view, tree, open, v, want, program);
    share = select(mended, T(kFirstR), last);
    for (int k = view.joint_begin; k < view.joint_end; ++k) z[k] = want[k];
  }
  take_free(view, open, z, want);
  remember_impulses(view, call.active, open, program);
}

/// The free bodies' velocities in `want`, which are those without contacts, become those under the impulses that are
/// kept.
template <class T>
inline void push_free_bodies(const TreeT<T>& tree, const ContactProgramT<T>& program, T* want) {
  for (int b = 0; b < program.free_count; ++b) {
    const int first = program.bodies[b].dof, depth = program.tree.topology.dof_depth[first];
    T x[6] = {T(0.0), T(0.0), T(0.0), T(0.0), T(0.0), T(0.0)};
    for (int i = 0; i < program.count; ++i) {
      if (program.dofs_above(i) <= depth) continue;  // beside its way
      for (int k = 0; k < 6; ++k) {
        x[k] += dot(program.jacobian[program.room * i + depth + k], program.contacts[i].cone.kept);
      }
    }
    solve_free_body(tree, program.bodies[b], x);
    for (int k = 0; k < 6; ++k) want[first + k] += x[k];
  }
}

/// The program's impulses give way to those of the lanes' complementarity problems, for the same joint velocities.
template <class T>
GRAZE_OUT_OF_LINE void pivot_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                      const TreeT<T>& tree, const T* v, T* want, const ContactProgramT<T>& program) {
  move_free_bodies(view, tree, v, want);
  T* const pivot = rows_of<T>(view.memory.pivot);
  unsigned touched = 0;
  for (int i = 0; i < program.count; ++i) {
    const ProgramContactT<T>& c = program.contacts[i];
    const Vec3T<T>* J = program.jacobian + program.room * i;
    const int* dofs = program.path(i);
    Vec3T<T> u{c.gap, T(0.0), T(0.0)};
    for (int d = 0; d < program.dofs_above(i); ++d) u = axpy(want[dofs[d]], J[d], u);
    T* row = pivot + kPivotRows * i;
    row[kPivotFriction] = c.friction;
    row[kPivotVelocity] = u.x, row[kPivotVelocity + 1] = u.y, row[kPivotVelocity + 2] = u.z;
    row[kPivotImpulse] = c.cone.kept.x, row[kPivotImpulse + 1] = c.cone.kept.y, row[kPivotImpulse + 2] = c.cone.kept.z;
    touched |= program.lanes[i];
  }
  for (int lane = 0; lane < kWidth<T>; ++lane) {
    if ((touched & call.active) >> lane & 1u) view.pivot(view.solver, lane, program.count);
  }
  for (int i = 0; i < program.count; ++i) {
    const T* found = pivot + kPivotRows * i + kPivotImpulse;
    program.contacts[i].cone.kept = {found[0], found[1], found[2]};
  }
  push_free_bodies(tree, program, want);
}

/// Impulses of what touches, and the velocities of the base and of objects that go with them.
template <class T>
GRAZE_OUT_OF_LINE void find_impulses(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                     const TreeT<T>& tree, const T* v, T* want, ContactProgramT<T>& program) {
  if (view.law == PredictedContact::none) return;
  if (view.law == PredictedContact::sensed) {
    find_sensed_contacts(view, call, tree, program);
    push_free_bodies(tree, program, want);
    return;
  }
  find_program_contacts(view, call, tree, program);
  if (program.count == 0) {
    remember_impulses(view, call.active, mask_from_bits<T>(0u), program);
    return;
  }
  predict_contacts(view, call, tree, v, want, program);
  if (view.law == PredictedContact::pivoted) pivot_contacts(view, call, tree, v, want, program);
}

/// Normal forces on the links that the torques count on.
template <class T>
inline void sum_forces(const InverseDynamicsView& view, unsigned active, const ContactProgramT<T>& program) {
  const T rate(1.0 / view.h);
  T* force = rows_of<T>(view.memory.normal_force);
  for (int k = 0; k < view.link_count; ++k) force[k] = select(mask_from_bits<T>(active), T(0.0), force[k]);
  for (int i = 0; i < program.count; ++i) {
    if (view.memory.link_of_contact[i] < 0) continue;  // of an object on what it stands on
    const auto valid = mask_from_bits<T>(program.lanes[i]);
    T& sum = force[view.memory.link_of_contact[i]];
    sum = select(valid, fma(rate, program.contacts[i].cone.kept.x, sum), sum);
  }
}

/// One control step of all lanes.
template <class T>
void inverse_dynamics(const InverseDynamicsView& view, const InverseDynamicsCall& call) {
  const TreeT<T> tree = tree_of<T>(view);
  const InverseDynamicsMemory& m = view.memory;
  T *const q = rows_of<T>(m.q), *const v = rows_of<T>(m.v), *const want = rows_of<T>(m.want);
  T* const torque = rows_of<T>(m.torque);
  read_state(view, call, q, v);
  wish(view, call, q, v, want);
  update_poses<T>(tree, q);
  ContactProgramT<T> program = program_of<T>(view, tree);
  if (view.free_count > 0 || view.law != PredictedContact::none) {
    update_mass<T>(tree);
    update_bias<T>(tree, v);
    move_free_bodies(view, tree, v, want);
    find_impulses(view, call, tree, v, want, program);
    sum_forces(view, call.active, program);
  }
  joint_torques(view, tree, program, v, want, torque);
  for (int i = 0; i < view.follower_count; ++i) {
    const FollowerView& f = view.followers[i];
    torque[f.other_v] = fma(T(f.multiplier), torque[f.v], torque[f.other_v]);
  }
  const auto active = mask_from_bits<T>(call.active);
  const auto set = [&](double* rows, int k, const T& value) {
    double* const at = rows + k * kWidth<T>;
    store(at, select(active, value, load<T>(at)));
  };
  for (int k = 0; k < view.na; ++k) {
    set(call.tau, k, torque[view.v[k]] + load<T>(call.target_tau + k * kWidth<T>));
    set(call.kp, k, T(0.0)), set(call.kd, k, T(0.0)), set(call.ki, k, T(0.0));
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
