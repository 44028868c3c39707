#pragma once
// The law of the tracker `inverse_dynamics` on lanes (inverse_dynamics.cpp says what it is), at the velocity level
// (Eqs. 68-71): joints shall move at v + h a_des at the end of the control step; contact impulses are predicted from
// that (contact_program.h); torques follow from the equation of motion.

#include "engine/contact/collide.h"
#include "engine/control/contact_program.h"
#include "engine/control/kernel.h"
#include "engine/control/operational_wish.h"
#include "engine/dynamics/equation.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Gap terms as the lane engine's rigid contacts have them (gap_term in constraint.h): Eq. 67 where bodies are apart, a
/// fifth of an overlap and at most 0.1 m/s where they are not.
inline constexpr double kOverlapShare = 0.2, kOverlapSpeed = 0.1;
/// Joint velocities that the contacts change by more than that contradict them, rad/s or m/s for each unit of the
/// weight of torques: what torques alone do is a hundredth of it.
inline constexpr double kContradiction = 10;

template <class T>
inline T* rows_of(double* p) {
  return reinterpret_cast<T*>(p);
}

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

/// The base's velocity after the step but for contacts, if the joints move as wished: its rows of M want = M v - h
/// bias.
template <class T>
inline void move_base(const InverseDynamicsView& view, const TreeT<T>& tree, const T* v, T* want) {
  for (int k = 0; k < 6; ++k) want[k] = T(0.0);
  const SpatialT<T> now = momentum_of_tree(tree, 0, v), joints = momentum_of_tree(tree, 0, want);
  const T h(view.h), *bias = tree.bias;
  T x[6] = {now.w.x - joints.w.x, now.w.y - joints.w.y, now.w.z - joints.w.z,
            now.l.x - joints.l.x, now.l.y - joints.l.y, now.l.z - joints.l.z};
  T A[36];
  for (int k = 0; k < 6; ++k) {
    x[k] = fnma(h, bias[k], x[k]);
    for (int d = 0; d <= k; ++d) A[6 * k + d] = tree.M[base_entry(k, d)];
  }
  solve_spd<T, 6, 6>(6, A, x);
  for (int k = 0; k < 6; ++k) want[k] = x[k];
}

template <class T>
inline ShapeT<T> shape_of(const GroundPairView::Part& part) {
  return {constant_vec3<T>(part.size), part.terrain, part.hull};
}

template <class T>
inline PoseT<T> pose_of(const GroundPairView::Part& part) {
  return {constant_matrix<T>(part.pose), constant_vec3<T>(part.pose + 9)};
}

/// Lanes in which a pair may have contacts.
template <class T>
inline unsigned watched(const InverseDynamicsView& view, const InverseDynamicsCall& call, const GroundPairView& pair) {
  if (!view.told) return call.active;
  const TouchingLinkView& link = view.links[pair.link];
  T force(0.0);
  for (int i = 0; i < link.frames; ++i) force += load<T>(call.link_force + link.frame[i] * kWidth<T>);
  return call.active & bits(force > T(view.force));
}

static_assert(sizeof(ProgramContactT<double>) == kProgramContactRows * sizeof(double));

template <class T>
inline ContactProgramT<T> program_of(const InverseDynamicsView& view, const TreeT<T>& tree) {
  const InverseDynamicsMemory& m = view.memory;
  ContactProgramT<T> out{};
  out.tree = tree;
  out.tree.M = rows_of<T>(m.H);
  out.A = tree.M;
  out.contacts = reinterpret_cast<ProgramContactT<T>*>(m.contacts);
  out.jacobian = reinterpret_cast<Vec3T<T>*>(m.jacobian);
  out.room = view.topology.nv;
  out.last_dof = m.dof_of_contact;
  out.lanes = m.lanes_of_contact;
  out.free = rows_of<T>(m.free), out.weight = rows_of<T>(m.weight);
  out.z = rows_of<T>(m.z), out.step = rows_of<T>(m.step), out.trial = rows_of<T>(m.trial);
  out.gradient = rows_of<T>(m.gradient);
  out.slips = view.law != PredictedContact::no_slip;
  return out;
}

/// A contact of a link in some lanes, about the frame whose normal and point it has. What it says in other lanes does
/// not matter, but that it is a number.
template <class T>
inline ProgramContactT<T>& add_program_contact(const InverseDynamicsView& view, const TreeT<T>& tree, int link,
                                               unsigned lanes, const Vec3T<T>& n, const Vec3T<T>& p,
                                               ContactProgramT<T>& program) {
  const int i = program.count++;
  const TopologyView& t = tree.topology;
  ProgramContactT<T>& c = program.contacts[i];
  const auto valid = mask_from_bits<T>(lanes);
  c.n = select(valid, n, Vec3T<T>{T(0.0), T(0.0), T(1.0)});
  c.p = select(valid, p, tree.origin[0]);
  make_tangents(c);
  Vec3T<T>* J = program.jacobian + program.room * i;
  for (int body = view.links[link].body; body > 0; body = t.parent[body]) {
    J[t.dof_depth[t.v[body]]] = joint_jacobian(tree, body, 1.0, c);
  }
  Vec3T<T> base[6];
  base_jacobian(tree, 0, 1.0, c, base);
  for (int k = 0; k < 6; ++k) J[k] = base[k];
  const T moment = T(1.0 / 3.0) * (program.A[0] + program.A[2] + program.A[5]);
  c.a = fma(norm2(c.p - tree.origin[0]), recip(moment), T(9.81 / view.weight));
  c.friction = c.gap = T(0.0);
  c.cone.kept = {T(0.0), T(0.0), T(0.0)};
  view.memory.dof_of_contact[i] = view.links[link].dof;
  view.memory.link_of_contact[i] = link;
  view.memory.lanes_of_contact[i] = lanes;
  return c;
}

/// Gap term of a point. One that the controller is told of touches, whatever its own geometry says.
template <class T>
inline T gap_of(const InverseDynamicsView& view, const ContactPointT<T>& point, unsigned lanes) {
  if (view.told) return T(0.0);
  const T rate = T(1.0 / view.h) * select(mask_from_bits<T>(lanes), point.phi, T(0.0));
  return select(rate < T(0.0), max(T(kOverlapShare) * rate, T(-kOverlapSpeed)), rate);
}

/// All contacts that the nominal robot may have within the step.
template <class T>
GRAZE_OUT_OF_LINE void find_program_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                             const TreeT<T>& tree, ContactProgramT<T>& program) {
  for (int k = 0; k < view.pair_count; ++k) {
    const GroundPairView& pair = view.pairs[k];
    const unsigned watch = watched<T>(view, call, pair);
    if (watch == 0) continue;
    ManifoldT<T> manifold;
    const PoseT<T> pose = tree.pose[view.links[pair.link].body] * pose_of<T>(pair.own);
    collide<T>(pair.own.kind, shape_of<T>(pair.own), pose, pair.ground.kind, shape_of<T>(pair.ground),
               pose_of<T>(pair.ground), T(view.within), manifold);
    for (int i = 0; i < manifold.count && program.count < view.memory.room; ++i) {
      const ContactPointT<T>& point = manifold.point[i];
      const unsigned lanes = bits(point.valid) & watch;
      if (lanes == 0) continue;
      ProgramContactT<T>& c = add_program_contact(view, tree, pair.link, lanes, point.n, point.p, program);
      c.friction = T(pair.friction);
      c.gap = gap_of(view, point, lanes);
    }
  }
}

/// Forces on links as they were sensed become contacts with their impulses, each frame at its point.
template <class T>
GRAZE_OUT_OF_LINE void find_sensed_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                            const TreeT<T>& tree, ContactProgramT<T>& program) {
  const Vec3T<T> up{T(0.0), T(0.0), T(1.0)};
  for (int k = 0; k < view.link_count; ++k) {
    for (int i = 0; i < view.links[k].frames; ++i) {
      const double* row = call.link_push + 6 * kWidth<T> * view.links[k].frame[i];
      const Vec3T<T> force = load_vec3<T>(row);
      const unsigned lanes = call.active & bits(norm2(force) > T(0.0));
      if (lanes == 0) continue;
      ProgramContactT<T>& c = add_program_contact(view, tree, k, lanes, up, load_vec3<T>(row + 3 * kWidth<T>), program);
      const Vec3T<T> impulse = T(view.h) * select(mask_from_bits<T>(lanes), force, Vec3T<T>{T(0.0), T(0.0), T(0.0)});
      c.cone.kept = to_local(c, impulse);
    }
  }
}

/// Weights of the joints, 1 / (eps s). s makes the two parts of the objective comparable: it has the unit 1/(kg m^2).
template <class T>
inline T weigh_joints(const InverseDynamicsView& view, const ContactProgramT<T>& program) {
  T free(0.0), joints(0.0);
  for (int i = 0; i < program.count; ++i) {
    const auto valid = mask_from_bits<T>(program.lanes[i]);
    T sum(0.0);
    for (int d = 6; d < program.dofs_above(i); ++d) sum += norm2(program.jacobian[program.room * i + d]);
    free += select(valid, T(3.0) * program.contacts[i].a, T(0.0));
    joints += select(valid, sum, T(0.0));
  }
  const auto some = joints > T(0.0);
  const T s = select(some, free * recip(select(some, joints, T(1.0))), T(1.0));
  T* weight = rows_of<T>(view.memory.weight);
  for (int k = 0; k < view.topology.nv; ++k) weight[k] = k < 6 ? T(0.0) : recip(T(view.stiffness) * s);
  return T(view.stiffness) * s;
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
  const int nv = view.topology.nv;
  T off(0.0);
  for (int k = 6; k < nv; ++k) off = max(off, abs(program.z[k] - want[k]));
  const mask_of<T> contradicts = open & (off > T(kContradiction * view.stiffness));
  if (!any(contradicts)) return contradicts;
  const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
  for (int k = 6; k < nv; ++k) want[k] = select(contradicts, program.z[k], want[k]);
  T base[6];
  for (int k = 0; k < 6; ++k) base[k] = want[k];
  move_base(view, tree, v, want);
  for (int k = 0; k < 6; ++k) want[k] = select(contradicts, want[k], base[k]);
  for (int i = 0; i < program.count; ++i) {
    program.contacts[i].cone.kept = select(contradicts, none, program.contacts[i].cone.kept);
  }
  return contradicts;
}

/// Impulses of the lanes that have contacts, and the velocities that go with them: the base's part of `want` becomes
/// what it will be, the joints' what can be had. Twice, because the torques that shall be least depend on how the base
/// moves.
template <class T>
GRAZE_OUT_OF_LINE void predict_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                        const TreeT<T>& tree, const T* v, T* want, const ContactProgramT<T>& program) {
  const int nv = view.topology.nv;
  T *const torque = rows_of<T>(view.memory.torque), *const free = rows_of<T>(view.memory.free), *const z = program.z;
  unsigned touched = 0;
  for (int i = 0; i < program.count; ++i) touched |= program.lanes[i];
  const auto open = mask_from_bits<T>(touched & call.active);
  const T s = weigh_joints(view, program), wrench(kWrenchError * view.weight * view.h);
  ContactProgramT<T> without = program;
  without.count = 0;
  T share(kFirstR);
  for (int k = 0; k < nv; ++k) z[k] = k < 6 ? v[k] : want[k];
  for (int i = 0; i < program.count; ++i) program.contacts[i].cone.kept = {T(0.0), T(0.0), T(0.0)};
  for (int round = 0; round < 2; ++round) {
    joint_torques(view, tree, without, v, z, torque);
    for (int k = 0; k < nv; ++k) free[k] = k < 6 ? want[k] : fnma(s * T(view.h), torque[k], want[k]);
    program.solve(open, share, view.stiffness, wrench, round > 0);
    if (round > 0) break;
    const mask_of<T> mended = mend_wish(view, tree, open, v, want, program);
    share = select(mended, T(kFirstR), T(kLastR * view.stiffness));
    for (int k = 6; k < nv; ++k) z[k] = want[k];
  }
  for (int k = 0; k < 6; ++k) want[k] = select(open, z[k], want[k]);
}

/// The base's velocity in `want`, which is that without contacts, becomes that under the impulses that are kept.
template <class T>
inline void push_base(const TreeT<T>& tree, const ContactProgramT<T>& program, T* want) {
  T x[6], A[36];
  for (int k = 0; k < 6; ++k) {
    x[k] = T(0.0);
    for (int i = 0; i < program.count; ++i) {
      x[k] += dot(program.jacobian[program.room * i + k], program.contacts[i].cone.kept);
    }
    for (int d = 0; d <= k; ++d) A[6 * k + d] = tree.M[base_entry(k, d)];
  }
  solve_spd<T, 6, 6>(6, A, x);
  for (int k = 0; k < 6; ++k) want[k] += x[k];
}

/// The program's impulses give way to those of the lanes' complementarity problems, for the same joint velocities.
template <class T>
GRAZE_OUT_OF_LINE void pivot_contacts(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                      const TreeT<T>& tree, const T* v, T* want, const ContactProgramT<T>& program) {
  move_base(view, tree, v, want);
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
  push_base(tree, program, want);
}

/// Impulses of what touches, and the base's velocity that goes with them.
template <class T>
GRAZE_OUT_OF_LINE void find_impulses(const InverseDynamicsView& view, const InverseDynamicsCall& call,
                                     const TreeT<T>& tree, const T* v, T* want, ContactProgramT<T>& program) {
  if (view.law == PredictedContact::none) return;
  if (view.law == PredictedContact::sensed) {
    find_sensed_contacts(view, call, tree, program);
    push_base(tree, program, want);
    return;
  }
  find_program_contacts(view, call, tree, program);
  if (program.count == 0) return;
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
  if (view.floating) {
    update_mass<T>(tree);
    update_bias<T>(tree, v);
    move_base(view, tree, v, want);
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
