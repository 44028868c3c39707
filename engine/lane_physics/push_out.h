#pragma once
// Overlaps that no impulse shall part: links of one robot that are in each other. The solve of velocities only keeps
// them from closing, which a body at rest always satisfies, however it is wedged. A motion of its own then takes the
// overlap back over the step: a speed w that moves q and is forgotten, so that it is never part of v and has no kinetic
// energy (the pseudo-velocities of split impulses). Its impulses solve
//   0 <= lambda  _|_  n . w + R lambda + b >= 0
// with b = -(speed of recovery) where there is something to take back, and elsewhere the room that v* leaves, so that
// no contact and no limit is broken by it. R makes what wants to go two ways at once stay between the two.

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"
#include "engine/lane_physics/integrate.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// R as a share of A's trace. What one point carries parts at half of the speed that is asked for or more; where joints
/// hardly let it part, so that the trace is many times A's normal entry, it is hardly tried. Our choice.
inline constexpr double kPushCompliance = 0.25;
/// No joint turns faster than this to take an overlap back, rad/s (m/s): a contact near a joint's axis would have it
/// whirl about. Our choice.
inline constexpr double kPushTurn = 1.0;
/// The error falls by a factor of (1 + R/A)^-2 or better in each sweep.
inline constexpr int kPushSweeps = 20;

/// A contact in the solve of w; kept in the memory of its sweeps.
template <class T>
struct PushT {
  T b;           // m/s
  T lambda;      // N s
  T compliance;  // R, 1/kg
  T inverse;     // 1 / (A + R), kg
  mask_of<T> turn;
};

/// n . w
template <class T>
inline T push_speed(const PathView& path, const ContactT<T>& c, ChangeT<T>& dw) {
  T u(0.0);
  const int loose = path.base < 0 ? path.count : path.count - 6;
  for (int i = 0; i < loose; ++i) u = fma(dw[path.dofs[i]], c.y[i].x, u);
  if (path.base < 0) return u;
  for (int d = 0; d < 6; ++d) u = fma(dw.base(5 - d), c.y[loose + d].x, u);
  return u;
}

/// The speed of recovery of an overlap, less what v* parts it with, m/s. The contact alone turns no joint faster than
/// kPushTurn.
template <class T>
inline T wanted_push(const PathView& path, const ContactLawT<T>& law, const ContactT<T>& c, const T& h,
                     const T& parting) {
  T most(0.0);
  for (int i = 0; i < path.count; ++i) most = max(most, abs(c.y[path.count + i].x));
  const T turning = T(kPushTurn) * c.ann * recip(max(most, T(1e-300)));
  const T speed = min(min(law.correction * -c.phi * recip(h), law.recovery), turning);
  return max(speed - max(parting, T(0.0)), T(0.0));
}

/// `change`: of L v by the step.
template <class T>
inline PushT<T> push_of(const PathView& path, const ContactLawT<T>& law, const ContactT<T>& c, const T& h,
                        const mask_of<T>& pushing, ChangeT<T>& change) {
  // The velocity of the bodies themselves beyond what the solve has asked for.
  const T past = fnma(c.compliance, c.lambda.x, contact_velocity(path, c, change).x);
  const auto deep = c.phi < -c.deep;
  PushT<T> push;
  push.turn = pushing & mask_from_bits<T>(c.lanes);
  push.b = select(deep, -wanted_push<T>(path, law, c, h, past + c.target), max(past, T(0.0)));
  push.lambda = T(0.0);
  push.compliance = select(deep, T(kPushCompliance) * (c.ann + c.ass + c.att), T(0.0));
  push.inverse = recip(c.ann + push.compliance);
  return push;
}

/// Limits of a joint: how far v* leaves room, as gap terms of w, rad/s.
template <class T>
inline void leave_room(JointRowT<T>& row, const T* change) {
  const T u = speed_of(row, change);
  row.lower_gap = max(u + row.lower_gap, T(0.0));
  row.upper_gap = max(row.upper_gap - u, T(0.0));
  row.b = row.lower = row.upper = row.dry = T(0.0);
  row.dry_low = row.dry_high = T(0.0);
}

/// Sweeps over all that w must not break. dw becomes L w.
template <class T>
inline void sweep_pushes(ConstraintsT<T>& set, PushT<T>* pushes, const mask_of<T>& pushing, T* dw) {
  ChangeT<T> change(dw);
  for (int sweep = 0; sweep < kPushSweeps; ++sweep) {
    for (int i = 0; i < set.contact_count; ++i) {
      const ContactT<T>& c = set.contacts[i];
      const PathView& path = set.paths[c.path];
      PushT<T>& push = pushes[i];
      change.turn_to(path);
      const T u = fma(push.compliance, push.lambda, push_speed<T>(path, c, change) + push.b);
      const T next = max(fnma(u, push.inverse, push.lambda), T(0.0));
      const T more = select(push.turn, next - push.lambda, T(0.0));
      push.lambda += more;
      apply_impulse(path, c, Vec3T<T>{more, T(0.0), T(0.0)}, change);
    }
    // Last, because a limit is held to rounding.
    for (int i = 0; i < set.joint_count - set.servo_count; ++i) {
      relax_joint<T>(pushing, set.joints[i], change.in_memory());
    }
  }
  change.in_memory();
}

/// Largest share of w that turns no joint and no base faster than kPushTurn, and moves none faster than the recovery.
template <class T>
inline T push_share(const TopologyView& t, const T& recovery, const T* w) {
  T share(1.0);
  for (int i = 0; i < t.bodies; ++i) {
    for (int k = 0; k < (t.kind[i] == kFloating ? 6 : 1); ++k) {
      const bool turns = t.kind[i] == kFloating ? k < 3 : t.kind[i] == kRevolute;
      const T most = turns ? T(kPushTurn) : recovery;
      share = min(share, most * recip(max(abs(w[t.v[i] + k]), most)));
    }
  }
  return share;
}

/// Finds w of the lanes that have something to take back, and how it moves the trees' centres of mass. After the
/// impulses of the step; `dz`: the change of v.
template <class T>
inline void push_out(LaneBlock& block, const TreeT<T>& tree, ConstraintsT<T>& set, double h, unsigned active) {
  unsigned lanes = 0;
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    lanes |= bits(c.phi < -c.deep) & c.lanes & active;
  }
  block.pushing = lanes;
  if (lanes == 0) return;
  const TopologyView& t = tree.topology;
  const auto pushing = mask_from_bits<T>(lanes);
  const ContactLawT<T>& law = *reinterpret_cast<const ContactLawT<T>*>(block.law);
  T *w = rows<T>(block.push), *change = rows<T>(block.free);
  times_L<T>(tree, rows<T>(block.dz), change);
  PushT<T>* pushes = reinterpret_cast<PushT<T>*>(set.memory);
  static_assert(sizeof(PushT<T>) <= sizeof(SweepMemoryT<T>));
  {
    ChangeT<T> of_step(change);
    for (int i = 0; i < set.contact_count; ++i) {
      const PathView& path = set.paths[set.contacts[i].path];
      of_step.turn_to(path);
      pushes[i] = push_of<T>(path, law, set.contacts[i], T(h), pushing, of_step);
    }
    of_step.in_memory();
  }
  for (int i = 0; i < set.joint_count - set.servo_count; ++i) leave_room<T>(set.joints[i], change);
  for (int k = 0; k < t.nv; ++k) w[k] = T(0.0);
  sweep_pushes<T>(set, pushes, pushing, w);
  solve_L<T>(tree, w);
  const T share = push_share<T>(t, law.recovery, w);
  for (int k = 0; k < t.nv; ++k) w[k] = fma(share, w[k], T(0.0));
  Vec3T<T>* shift = reinterpret_cast<Vec3T<T>*>(w + t.nv);
  for (int i = 0; i < t.bodies; ++i) shift[i] = {T(0.0), T(0.0), T(0.0)};
  for (int i = 0; i < set.contact_count; ++i) {
    const PathView& path = set.paths[set.contacts[i].path];
    const Vec3T<T> impulse = (share * pushes[i].lambda) * set.contacts[i].n;
    const int a = path.body_a < 0 ? -1 : t.root[path.body_a], b = path.body_b < 0 ? -1 : t.root[path.body_b];
    if (a == b) continue;
    if (a >= 0) shift[a] += impulse;
    if (b >= 0) shift[b] -= impulse;
  }
}

/// Moves q by h w. After integrate.
template <class T>
inline void move_pushed(const LaneBlock& block, const TreeT<T>& tree, double h) {
  const TopologyView& t = tree.topology;
  const auto pushing = mask_from_bits<T>(block.pushing);
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  T* q = rows<T>(block.q);
  const T* w = rows<T>(block.push);
  const Vec3T<T>* shift = reinterpret_cast<const Vec3T<T>*>(w + t.nv);
  for (int i = 0; i < t.bodies; ++i) {
    T* qi = q + t.q[i];
    const T* wi = w + t.v[i];
    if (t.kind[i] != kFloating) {
      qi[0] = select(pushing, fma(T(h), wi[0], qi[0]), qi[0]);
      continue;
    }
    turn_base<T>(qi, Vec3T<T>{wi[0], wi[1], wi[2]}, h, pushing);
    BalanceT<T>& to = balance[i];
    const Vec3T<T> way = (T(h) * recip(tree.motion[i].C.m)) * shift[i];
    to.com = select(pushing, to.com + way, to.com);
    // The spin about the centre of mass stays.
    to.momentum.w = select(pushing, to.momentum.w + cross(way, to.momentum.l), to.momentum.w);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
