#pragma once
// The gait planner (Chapter 9, Algorithm 7) on lanes: desired position and velocity of every foot in the base frame,
// from the clock, the commanded velocity of the base, and what is sensed of the feet. Every lane has its own clock and
// modes.

#include "engine/control/gait_clock.h"
#include "engine/control/planar_motion.h"
#include "engine/control/swing_path.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Memory and output of one foot. Modes are lanes as bits; a foot in none of them is in stance. All zero before start.
template <class T>
struct FootPlan {
  Vec3T<T> x, xd;               // desired, base frame, m and m/s
  SwingPath<T> path;            // while in swing, or settling
  BaseCommandT<T> planned_for;  // the command that `path` was made for
  unsigned swing, reach, support;
};

/// What the planner is told at a control step.
template <class T>
struct GaitSenses {
  T t, dt;                  // s since the start of the trace; since the last call (0 at first)
  BaseCommandT<T> command;  // level frame
  Vec3T<T> x[kMaxFeet];     // sensed feet, base frame, m
  T force[kMaxFeet];        // normal force on each foot, N; read if p.recovery
  T roll, pitch;            // of the base, rad; read if p.global_up
};

// A support phase can eat into the swing that follows. With less than this fraction of the planned swing left, the foot
// stays where it is until its next planned stance: shorter swings would ask for more than four times the planned speed.
inline constexpr double kShortestSwing = 0.25;

template <class T, class Number>
inline Vec3T<T> within_reach(const GaitParametersOf<Number>& p, int foot, const Vec3T<T>& x) {
  const Vec3T<T> hip = constant_vec3<T>(p.hip[foot]), from_hip = x - hip;
  const T reach = lanes_of<T>(p.reach[foot]), distance2 = norm2(from_hip);
  const mask_of<T> beyond = distance2 > reach * reach;
  if (!any(beyond)) return x;
  return select(beyond, axpy(reach / sqrt(distance2), from_hip, hip), x);
}

/// Velocity of a standing foot that moves the base at `command`: -J_{foot,base} command (§9.2.4). Base frame.
template <class T, class Number>
inline Vec3T<T> stance_velocity(const GaitParametersOf<Number>& p, const Vec3T<T>& x, const BaseCommandT<T>& command) {
  const RotT<T> R_GB = constant_matrix<T>(p.R_GB);
  return -transposed_times(R_GB, cross_add(command.w, R_GB * x, command.v));
}

/// Where a foot shall touch down: where its origin will be at mid-stance, seen from the base at touchdown (Figure 72).
/// Base frame.
template <class T, class Number>
inline Vec3T<T> touchdown(const GaitParametersOf<Number>& p, int foot, const BaseCommandT<T>& command) {
  const PlanarPoseT<T> middle = predict(command, 0.5 * stance_duration(p.timing, foot));
  const Vec3T<T> goal = middle.transform(constant_vec3<T>(p.origin[foot]));
  return within_reach(p, foot, transposed_times(constant_matrix<T>(p.R_GB), goal));
}

/// World's z in the base frame: the last row of Rz(yaw) Ry(pitch) Rx(roll).
template <class T>
inline Vec3T<T> up_of(const T& roll, const T& pitch) {
  T sr, cr, sp, cp;
  sin_cos(roll, sr, cr);
  sin_cos(pitch, sp, cp);
  return {-sp, cp * sr, cp * cr};
}

template <class T, class Number>
inline SwingPath<T> plan_path(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, int foot, const Vec3T<T>& x,
                              const Vec3T<T>& xd, const T& t0, const T& duration) {
  const Vec3T<T> goal = touchdown(p, foot, in.command);
  Vec3T<T> end_velocity = stance_velocity(p, goal, in.command);
  const T speed = max(sqrt(norm2(end_velocity)), T(1e-12));
  end_velocity = min(T(1.0), T(p.max_speed) / speed) * end_velocity;
  const Vec3T<T> vertical = p.global_up ? up_of(in.roll, in.pitch) : Vec3T<T>{T(0.0), T(0.0), T(1.0)};
  Vec3T<T> knot[4];
  swing_knots(x, goal, T(p.step_height) * vertical, p.overshoot, knot);
  return path_through(knot, xd, end_velocity, t0, duration);
}

/// All feet of `lanes` (bits) in stance where they are, ready to settle.
template <class T, class Number>
inline void start_feet(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, unsigned lanes, FootPlan<T>* feet) {
  const mask_of<T> here = mask_from_bits<T>(lanes);
  for (int i = 0; i < p.timing.feet; ++i) {
    FootPlan<T>& foot = feet[i];
    foot.swing &= ~lanes;
    foot.reach &= ~lanes;
    foot.support &= ~lanes;
    foot.x = select(here, in.x[i], foot.x);
    if (p.settle <= 0) continue;
    // A smooth step (3 s^2 - 2 s^3, at thirds 7/27 and 20/27) to the commanded height; feet stay where they stand.
    const RotT<T> R_GB = constant_matrix<T>(p.R_GB);
    Vec3T<T> level = R_GB * in.x[i];
    level.z = lanes_of<T>(p.origin[i][2]);
    const Vec3T<T> way = transposed_times(R_GB, level) - in.x[i], still{T(0.0), T(0.0), T(0.0)};
    const Vec3T<T> knot[4] = {in.x[i], axpy(T(7.0 / 27), way, in.x[i]), axpy(T(20.0 / 27), way, in.x[i]),
                              in.x[i] + way};
    foot.path.replace(here, path_through(knot, still, still, T(0.0), T(p.settle)));
  }
}

/// Transitions of all feet in `lanes` (bits), Figure 67. t: s since the gait began.
template <class T, class Number>
inline void switch_modes(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, const T& t, const T& phase,
                         unsigned lanes, FootPlan<T>* feet) {
  for (int i = 0; i < p.timing.feet; ++i) {
    FootPlan<T>& foot = feet[i];
    const unsigned planned = bits(in_stance(p.timing, i, phase)) & lanes;
    const unsigned landed = foot.swing & planned;
    if (landed) {
      Vec3T<T> x, xd;
      sample(foot.path, t, x, xd);
      foot.x = select(mask_from_bits<T>(landed), x, foot.x);
    }
    foot.swing &= ~landed;
    foot.reach |= landed;
    foot.support &= ~planned;
    if (foot.reach & lanes) {
      foot.reach &= p.recovery ? ~(bits(in.force[i] > lanes_of<T>(p.contact_force)) & lanes) : ~lanes;
    }
    const unsigned lifting = lanes & ~planned & ~foot.swing;
    foot.reach &= ~lifting;
    foot.support |= lifting;
  }
}

template <class T, class Number>
inline void stand(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, const BaseCommandT<T>& command, int i,
                  unsigned lanes, FootPlan<T>& foot) {
  const mask_of<T> here = mask_from_bits<T>(lanes & ~foot.swing);
  Vec3T<T> xd = stance_velocity(p, in.x[i], command);
  if (foot.reach & lanes) {
    xd.z = select(mask_from_bits<T>(foot.reach), xd.z - sqrt(norm2(xd)), xd.z);
  }
  foot.x = select(here, within_reach(p, i, axpy(in.dt, xd, foot.x)), foot.x);
  foot.xd = select(here, xd, foot.xd);
}

template <class T, class Number>
inline void lift_off(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, const T& t, const T& phase,
                     unsigned lanes, FootPlan<T>* feet) {
  unsigned any_reaching = 0;
  for (int i = 0; i < p.timing.feet; ++i) any_reaching |= feet[i].reach;
  for (int i = 0; i < p.timing.feet; ++i) {
    FootPlan<T>& foot = feet[i];
    if (!(foot.support & lanes)) continue;
    const unsigned overreached =
        bits(norm2(in.x[i] - constant_vec3<T>(p.hip[i])) > lanes_of<T>(p.reach[i]) * lanes_of<T>(p.reach[i]));
    const T left = until_touchdown(p.timing, i, phase);
    const unsigned too_late = bits(left < T(kShortestSwing * swing_duration(p.timing, i)));
    const unsigned lifted = foot.support & lanes & ~(any_reaching & ~overreached) & ~too_late;
    if (!lifted) continue;
    const mask_of<T> here = mask_from_bits<T>(lifted);
    foot.support &= ~lifted;
    foot.swing |= lifted;
    foot.path.replace(here, plan_path(p, in, i, foot.x, foot.xd, t, left));
    foot.planned_for.v = select(here, in.command.v, foot.planned_for.v);
    foot.planned_for.w = select(here, in.command.w, foot.planned_for.w);
  }
}

template <class T>
inline mask_of<T> differs(const Vec3T<T>& a, const Vec3T<T>& b) {
  return !((a.x == b.x) & (a.y == b.y) & (a.z == b.z));
}

template <class T, class Number>
inline void swing(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, const T& t, int i, unsigned lanes,
                  FootPlan<T>& foot) {
  const SwingPath<T>& old = foot.path;
  const mask_of<T> here = mask_from_bits<T>(lanes & foot.swing);
  const mask_of<T> early = t - old.start <= T(p.redirect) * old.duration;
  const mask_of<T> other_v = differs(foot.planned_for.v, in.command.v);
  const mask_of<T> other_w = differs(foot.planned_for.w, in.command.w);
  const mask_of<T> redirected = here & early & (other_v | other_w);
  if (any(redirected)) {
    foot.path.replace(redirected, plan_path(p, in, i, old.knot[0], old.slope[0], old.start, old.duration));
    foot.planned_for.v = select(redirected, in.command.v, foot.planned_for.v);
    foot.planned_for.w = select(redirected, in.command.w, foot.planned_for.w);
  }
  Vec3T<T> x, xd;
  sample(foot.path, t, x, xd);
  foot.x = select(here, x, foot.x);
  foot.xd = select(here, xd, foot.xd);
}

/// One control step of `lanes` (bits) that have settled. t: s since the gait began.
template <class T, class Number>
inline void walk(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, const T& t, unsigned lanes,
                 FootPlan<T>* feet) {
  const T phase = phase_at(p.timing, t);
  BaseCommandT<T> command = in.command;
  if (p.timing.flight_count > 0) command.v.z += hop_velocity(p.timing, phase, p.gravity);
  switch_modes(p, in, t, phase, lanes, feet);
  for (int i = 0; i < p.timing.feet; ++i) {
    if (lanes & ~feet[i].swing) stand(p, in, command, i, lanes, feet[i]);
  }
  lift_off(p, in, t, phase, lanes, feet);
  for (int i = 0; i < p.timing.feet; ++i) {
    if (lanes & feet[i].swing) swing(p, in, t, i, lanes, feet[i]);
  }
}

/// One control step of `lanes` (bits); the others keep everything. Until t = settle all feet stand; the gait's clock
/// begins there.
template <class T, class Number>
inline void plan(const GaitParametersOf<Number>& p, const GaitSenses<T>& in, unsigned lanes, FootPlan<T>* feet) {
  const unsigned settled = bits(in.t >= T(p.settle)) & lanes, settling = lanes & ~settled;
  if (settled) walk(p, in, in.t - T(p.settle), settled, feet);
  if (!settling) return;
  const mask_of<T> here = mask_from_bits<T>(settling);
  for (int i = 0; i < p.timing.feet; ++i) {
    Vec3T<T> x, xd;
    sample(feet[i].path, in.t, x, xd);
    feet[i].x = select(here, x, feet[i].x);
    feet[i].xd = select(here, xd, feet[i].xd);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
