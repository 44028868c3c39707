#pragma once
// Servos and prescribed motion in a step (docs/physics.md, "Drives"). A servo's torque follows its law at the step's
// end,
//   f = tau + kp (q_ref - q - h v+) + kd (v_ref - v+),
// which adds h kd + h^2 kp to the diagonal of M; a joint with prescribed motion is the limit of infinite gains, which
// makes its D infinite. Both hold while f lies within its bounds. A joint outside of them gets the bound as a constant
// torque, and the step is solved again; so until every joint is consistent (an active set). One that has changed sides
// twice becomes a row of the sweeps instead, with its impulse bounded and the law as compliance. What a lane goes
// through depends on that lane alone: a lane that is consistent comes out the same when its neighbours need another
// round.

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// How a drive takes part in the step, and what came out; rows of block.servo.
template <class T>
struct ServoT {
  T mode;    // 0: follows its law; +-1: at its upper, lower bound; 2: a row of the sweeps. Kept for the next step
  T flips;   // changes of mode in this step
  T torque;  // N m or N
  T demand;  // without bounds
  T warm;    // torque that a row of the sweeps starts from: of the last round that its lane needed, or the last step

  mask_of<T> free() const { return abs(mode) < T(0.5); }
  mask_of<T> high() const { return (mode > T(0.5)) & (mode < T(1.5)); }
  mask_of<T> low() const { return mode < T(-0.5); }
  mask_of<T> swept() const { return mode > T(1.5); }
};

/// A drive's numbers, loaded.
template <class T>
struct DriveT {
  T tau, kp, kd, lower, upper;
  T q_error;  // q_ref - q at the beginning
  T v_ref;
  T speed;  // prescribed: (q_ref - q) / h
  mask_of<T> prescribed;

  DriveT(const LaneBlock& block, const DriveView& view, int k, double h)
      : tau(at(view.tau, k)),
        kp(at(view.kp, k)),
        kd(at(view.kd, k)),
        lower(at(view.lower, k)),
        upper(at(view.upper, k)),
        q_error(at(view.q, k) - rows<T>(block.q)[block.topology.q[block.actuated_body[k]]]),
        v_ref(at(view.v, k)),
        speed(q_error * T(1.0 / h)),
        prescribed(abs(view.prescribed ? at(view.prescribed, k) : T(0.0)) > T(0.0)) {}

  static T at(const double* rows, int k) { return load<T>(rows + k * kWidth<T>); }
  /// f at the speed v+.
  T law(double h, const T& v) const { return fma(kp, fnma(T(h), v, q_error), fma(kd, v_ref - v, tau)); }
  /// What the law loses per speed, times h: N m s/(rad/s).
  T gain(double h) const { return T(h) * fma(T(h), kp, kd); }
};

template <class T>
inline ServoT<T>* servos_of(const LaneBlock& block) {
  return reinterpret_cast<ServoT<T>*>(block.servo);
}

/// Where a servo begins a step: as it ended the last one, or as its constant torque says.
template <class T>
inline void begin_servos(const LaneBlock& block, const DriveView& view, double h) {
  for (int k = 0; k < block.na; ++k) {
    ServoT<T>& servo = servos_of<T>(block)[k];
    const DriveT<T> drive(block, view, k, h);
    const auto constant = !((drive.gain(h) > T(0.0)) | drive.prescribed);
    const T side = select(drive.tau > drive.upper, T(1.0), select(drive.tau < drive.lower, T(-1.0), T(0.0)));
    const T last = select(servo.swept(), T(0.0), servo.mode);
    servo.mode = select(constant, side, block.settings.sweep_servos ? T(2.0) : last);
    servo.flips = T(0.0);
    servo.warm = servo.torque;
  }
}

/// x += the column of `body`'s joint in tree.M (M, or L below the diagonal) times `change`, without the diagonal.
template <class T>
inline void add_column(const TreeT<T>& tree, int body, const T& change, bool ancestors, T* x) {
  const TopologyView& t = tree.topology;
  const int dof = t.v[body], depth = t.dof_depth[dof];
  if (ancestors) {
    for (int d = 0; d < depth; ++d) {
      T& above = x[t.chain[t.row[dof] + d]];
      above = fma(tree.M[t.row[dof] + d], change, above);
    }
  }
  for (int j = body + 1; j < t.bodies; ++j) {
    const int below = t.v[j];
    if (t.dof_depth[below] <= depth || t.chain[t.row[below] + depth] != dof) continue;
    x[below] = fma(tree.M[t.row[below] + depth], change, x[below]);
  }
}

/// Adds the drives to M and to the impulses `dz`, before the factorisation. Fills block.locked: per body, the lanes in
/// which its joint is held by prescribed motion.
template <class T>
inline void add_drives(LaneBlock& block, const TreeT<T>& tree, const DriveView& view, double h, unsigned active,
                       T* dz) {
  const TopologyView& t = tree.topology;
  const T* v = rows<T>(block.v);
  for (int k = 0; k < block.na; ++k) {
    const int body = block.actuated_body[k], dof = t.v[body];
    const ServoT<T>& servo = servos_of<T>(block)[k];
    const DriveT<T> drive(block, view, k, h);
    const auto free = servo.free();
    const auto locked = free & drive.prescribed;
    block.locked[body] = bits(locked) & active;
    const T bound = select(servo.high(), drive.upper, select(servo.low(), drive.lower, T(0.0)));
    dz[dof] = fma(T(h), select(locked, T(0.0), select(free, drive.law(h, v[dof]), bound)), dz[dof]);
    T& diagonal = tree.M[t.row[dof] + t.dof_depth[dof]];
    diagonal += select(free & !drive.prescribed, drive.gain(h), T(0.0));
  }
}

/// Change of speed that prescribed motion wants of a joint, 0 where it is not held.
template <class T>
inline T wanted_change(const LaneBlock& block, const DriveView& view, int k, double h) {
  const int body = block.actuated_body[k];
  const DriveT<T> drive(block, view, k, h);
  const T change = drive.speed - rows<T>(block.v)[block.topology.v[body]];
  return select(mask_from_bits<T>(block.locked[body]), change, T(0.0));
}

/// Prescribed joints before the factorisation: their motion as impulses on the others, and an infinite inertia.
template <class T>
inline void hold_joints(LaneBlock& block, const TreeT<T>& tree, const DriveView& view, double h, T* impulse) {
  const TopologyView& t = tree.topology;
  for (int k = 0; k < block.na; ++k) {
    if (block.locked[block.actuated_body[k]] == 0) continue;
    add_column<T>(tree, block.actuated_body[k], -wanted_change<T>(block, view, k, h), true, impulse);
  }
  const T infinite(__builtin_inf());
  for (int k = 0; k < block.na; ++k) {
    const int body = block.actuated_body[k], dof = t.v[body];
    if (block.locked[body] == 0) continue;
    T& diagonal = tree.M[t.row[dof] + t.dof_depth[dof]];
    diagonal = select(mask_from_bits<T>(block.locked[body]), infinite, diagonal);
    impulse[dof] = select(mask_from_bits<T>(block.locked[body]), T(0.0), impulse[dof]);
  }
}

/// And after it: their change of L v.
template <class T>
inline void move_joints(const LaneBlock& block, const TreeT<T>& tree, const DriveView& view, double h, T* dz) {
  for (int k = 0; k < block.na; ++k) {
    const int body = block.actuated_body[k], dof = tree.topology.v[body];
    if (block.locked[body] == 0) continue;
    const T change = wanted_change<T>(block, view, k, h);
    dz[dof] += change;
    add_column<T>(tree, body, change, false, dz);
  }
}

/// Rows of the drives that are solved in the sweeps.
template <class T>
inline int add_servo_rows(const LaneBlock& block, const TreeT<T>& tree, const MimicsT<T>& mimics, const DriveView& view,
                          double h, unsigned active, JointRowT<T>* joints) {
  const TopologyView& t = tree.topology;
  T* free_rows = rows<T>(block.servo_rows);
  int count = 0;
  for (int k = 0; k < block.na; ++k) {
    const ServoT<T>& servo = servos_of<T>(block)[k];
    const unsigned lanes = bits(servo.swept()) & active;
    if (lanes == 0) continue;
    const DriveT<T> drive(block, view, k, h);
    JointRowT<T>& row = joints[count++];
    row.body = -1;
    row.lanes = lanes;
    row.y = free_rows;
    const int dof = t.v[block.actuated_body[k]];
    const JointPathView& path = block.joint_paths[dof];
    free_rows += 2 * path.count;
    set_up_joint<T>(tree, rows<T>(block.v), dof, path, mimics, rows<T>(block.scratch), row);
    // h f = K (target - v+), that is v+ - target + R h f = 0 with R = 1/K.
    const T R = select(drive.prescribed, T(0.0), recip(drive.gain(h)));
    row.dry_gap = select(drive.prescribed, -drive.speed, -(T(h) * R * drive.law(h, T(0.0))));
    row.dry_compliance = R;
    row.inverse_dry = recip(recip(row.inverse_a) + R);
    row.dry_low = T(h) * drive.lower, row.dry_high = T(h) * drive.upper;
    row.lower_gap = row.upper_gap = T(__builtin_inf());
    row.lower = row.upper = T(0.0);
    const auto in_force = mask_from_bits<T>(row.lanes);
    row.dry = select(in_force, min(max(T(h) * servo.warm, row.dry_low), row.dry_high), T(0.0));
  }
  return count;
}

/// What a joint's row of M dv = h (torque - bias - D v+) + J^T lambda lacks, M without drives.
template <class T>
inline T lacking_torque(const LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, int body, double h,
                        const T* dv) {
  const TopologyView& t = tree.topology;
  const int dof = t.v[body], depth = t.dof_depth[dof];
  const T* M = rows<T>(block.M_kept);
  T impulse(0.0);
  for (int d = 0; d <= depth; ++d) impulse = fma(M[t.row[dof] + d], dv[t.chain[t.row[dof] + d]], impulse);
  for (int j = body + 1; j < t.bodies; ++j) {
    const int below = t.v[j];
    if (t.dof_depth[below] <= depth || t.chain[t.row[below] + depth] != dof) continue;
    impulse = fma(M[t.row[below] + depth], dv[below], impulse);
  }
  const SpatialT<T>& S = tree.motion[body].S;
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    for (int m = 0; m < path.moving_count; ++m) {
      if (path.bodies[m] != body) continue;
      const Vec3T<T> r = from_origin(tree, body, c.p);
      const T along = dot(to_local(c, cross_add(S.w, r, S.l)), c.lambda);
      impulse = fnma(T(path.signs[m]), select(mask_from_bits<T>(c.lanes), along, T(0.0)), impulse);
    }
  }
  const T speed = rows<T>(block.v)[dof] + dv[dof];
  return fma(tree.body[body].damping, speed, fma(T(1.0 / h), impulse, tree.bias[dof]));
}

/// Torque that holds a prescribed joint, and moves those that follow it: mimic rows do no work, so that what they take
/// from it is what the others lack.
template <class T>
inline T holding_torque(const LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, int body, double h,
                        const T* dv) {
  T torque = lacking_torque<T>(block, tree, set, body, h, dv);
  for (int i = 0; i < block.mimic_count; ++i) {
    if (block.mimics[i].other_body != body) continue;
    torque = fma(rows<T>(block.mimic)[2 * i], lacking_torque<T>(block, tree, set, block.mimics[i].body, h, dv), torque);
  }
  return torque;
}

/// Torques after the solve, and which drives do not agree with their bounds: those change their mode. Returns the lanes
/// that must be solved again. `dv`: change of v.
template <class T>
inline unsigned settle_servos(const LaneBlock& block, const TreeT<T>& tree, const DriveView& view,
                              const ConstraintsT<T>& set, double h, unsigned active, const T* dv) {
  const TopologyView& t = tree.topology;
  const auto live = mask_from_bits<T>(active);
  int row = set.joint_count - set.servo_count;
  unsigned again = 0;
  for (int k = 0; k < block.na; ++k) {
    const int body = block.actuated_body[k], dof = t.v[body];
    ServoT<T>& servo = servos_of<T>(block)[k];
    const DriveT<T> drive(block, view, k, h);
    const T v = rows<T>(block.v)[dof] + dv[dof];
    const mask_of<T> free = servo.free(), high = servo.high(), low = servo.low();
    T torque = select(high, drive.upper, drive.lower), demand = drive.law(h, v);
    if ((bits(servo.swept()) & active) != 0) {
      torque = select(servo.swept(), set.joints[row++].dry * T(1.0 / h), torque);
    }
    if (any(drive.prescribed)) {
      // Off its motion the joint asks for what its composite inertia would need to be back on it.
      const T inertia = rows<T>(block.M_kept)[t.row[dof] + t.dof_depth[dof]];
      const T lacking = fma(inertia * T(1.0 / h), drive.speed - v, torque);
      demand = select(drive.prescribed, lacking, demand);
      if (block.locked[body] != 0) {
        const auto locked = mask_from_bits<T>(block.locked[body]);
        demand = select(locked, holding_torque<T>(block, tree, set, body, h, dv), demand);
      }
    }
    torque = select(free, demand, torque);
    const T slack = fma(T(1e-9), abs(torque), T(1e-12));
    T next = select(free & (demand > drive.upper), T(1.0), servo.mode);
    next = select(free & (demand < drive.lower), T(-1.0), next);
    next = select((high & (demand < drive.upper - slack)) | (low & (demand > drive.lower + slack)), T(0.0), next);
    const auto changed = live & (abs(next - servo.mode) > T(0.5));
    next = select(changed & (servo.flips >= T(2.0)), T(2.0), next);
    servo.flips = select(changed, servo.flips + T(1.0), servo.flips);
    servo.mode = select(live, next, servo.mode);
    servo.torque = select(live, torque, servo.torque);
    servo.demand = select(live, demand, servo.demand);
    again |= bits(changed);
  }
  // A lane that is done meets its own start again in the rounds of its neighbours.
  const auto unsettled = mask_from_bits<T>(again);
  for (int k = 0; k < block.na; ++k) {
    ServoT<T>& servo = servos_of<T>(block)[k];
    servo.warm = select(unsettled, servo.torque, servo.warm);
  }
  return again & active;
}

/// A servo that ended a step as a row begins the next one at the bound that it reached, or free.
template <class T>
inline void keep_servos(const LaneBlock& block, const DriveView& view, double h, unsigned active) {
  for (int k = 0; k < block.na; ++k) {
    ServoT<T>& servo = servos_of<T>(block)[k];
    const DriveT<T> drive(block, view, k, h);
    const T side = select(servo.torque >= drive.upper, T(1.0), select(servo.torque <= drive.lower, T(-1.0), T(0.0)));
    const auto live = mask_from_bits<T>(active), swept = servo.swept();
    servo.mode = select(live & swept, side, servo.mode);
  }
}

/// Torques, which are held between their bounds because a row's impulse is at its bound to rounding, and demands.
template <class T>
inline void report_drives(const LaneBlock& block, const DriveView& view, unsigned active) {
  constexpr int W = kWidth<T>;
  const auto live = mask_from_bits<T>(active);
  for (int k = 0; k < block.na; ++k) {
    const ServoT<T>& servo = servos_of<T>(block)[k];
    const T lower = load<T>(view.lower + k * W), upper = load<T>(view.upper + k * W);
    // Comparisons that keep NaN.
    const T raised = select(servo.torque < lower, lower, servo.torque);
    const T torque = select(upper < raised, upper, raised);
    store(view.torque + k * W, select(live, torque, load<T>(view.torque + k * W)));
    store(view.demand + k * W, select(live, servo.demand, load<T>(view.demand + k * W)));
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
