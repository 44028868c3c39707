#pragma once
// The base stabiliser of §7.6.3 on lanes: feet that stand push along the vertical, and only push, such that the base
// rolls and pitches back (viip of the published code, after the variable impedant inverted pendulum of Sugihara &
// Nakamura 2003). Forces are virtual: joints get the torques -J^T f that would hold them against the ground, as feed-
// forward.

#include "engine/control/gait_planner.h"
#include "engine/dynamics/chain_motion.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Sweeps over the feet; the moment of four feet is found to about 1 % (our choice: the feedback is no exacter).
inline constexpr int kStabilizerSweeps = 12;
/// Of the feet's squared lever arms: what the forces themselves weigh, so that feet in line share them.
inline constexpr double kStabilizerDamping = 1e-3;

/// Moment wanted about the base's x and y axes, N m, in its z nothing. rate: of the base, world axes, rad/s.
template <class T>
inline Vec3T<T> righting_moment(const BaseStabilizer& s, const T& roll, const T& pitch, const T& yaw,
                                const Vec3T<T>& rate) {
  T sr, cr, sp, cp, sy, cy;
  sin_cos(roll, sr, cr);
  sin_cos(pitch, sp, cp);
  sin_cos(yaw, sy, cy);
  // The rate in base axes: Rx(-roll) Ry(-pitch) Rz(-yaw) rate.
  const T ahead = fma(cy, rate.x, sy * rate.y), aside = fma(cy, rate.y, -(sy * rate.x));
  const T x = fma(cp, ahead, -(sp * rate.z)), z = fma(sp, ahead, cp * rate.z);
  const T y = fma(cr, aside, sr * z);
  return {-fma(T(s.kp), roll - T(s.roll), T(s.kd) * x), -fma(T(s.kp), pitch - T(s.pitch), T(s.kd) * y), T(0.0)};
}

/// Pushes f >= 0 of the feet along `up` (base frame) whose moment about the base's x and y axes is nearest to `moment`:
/// least |sum (x_i x up) f_i - moment|^2 + weight |f|^2, by Gauss and Seidel. stands: lanes as bits, per foot.
template <class T>
inline void righting_pushes(int feet, const Vec3T<T>* x, const unsigned* stands, const Vec3T<T>& up,
                            const Vec3T<T>& moment, T* push) {
  const T zero(0.0);
  T arm_x[kMaxFeet], arm_y[kMaxFeet], longest(1e-6);  // m^2; a millimetre, where all feet are below the base
  for (int i = 0; i < feet; ++i) {
    const mask_of<T> here = mask_from_bits<T>(stands[i]);
    const Vec3T<T> arm = cross(x[i], up);
    arm_x[i] = select(here, arm.x, zero), arm_y[i] = select(here, arm.y, zero);
    longest = max(longest, fma(arm_x[i], arm_x[i], arm_y[i] * arm_y[i]));
    push[i] = zero;
  }
  const T weight = T(kStabilizerDamping) * longest;
  T left_x = moment.x, left_y = moment.y;
  for (int sweep = 0; sweep < kStabilizerSweeps; ++sweep) {
    for (int i = 0; i < feet; ++i) {
      const T own = fma(arm_x[i], arm_x[i], fma(arm_y[i], arm_y[i], weight));
      const T pull = fma(arm_x[i], left_x, arm_y[i] * left_y) - weight * push[i];
      const T next = max(zero, push[i] + pull / own), more = next - push[i];
      left_x = left_x - arm_x[i] * more, left_y = left_y - arm_y[i] * more;
      push[i] = next;
    }
  }
}

/// Adds the torques of a foot that pushes by `push` to tau, which holds the chain's joints.
template <class T, int N, class Number>
inline void push_foot(const ChainOf<Number>& chain, const T* q, const Vec3T<T>& up, const T& push, T* tau) {
  ChainPose<T, N> pose;
  walk_chain(chain, q, pose, [](int, const RotT<T>&, const Vec3T<T>&) {});
  const Vec3T<T> force = -(push * up);
  const int n = chain_size<N>(chain);
  for (int i = 0; i < n; ++i) tau[i] = dot_add(tip_column(chain, pose, i), force, tau[i]);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
