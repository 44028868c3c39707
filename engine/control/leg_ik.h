#pragma once
// Inverse kinematics of a chain (position of its tip only) on lanes: damped least squares for any chain, and a closed
// form for legs whose first axis is perpendicular to two further, parallel ones (hip roll, hip pitch, knee).

#include "engine/dynamics/chain_motion.h"
#include "engine/lanes/arc.h"

namespace graze {

/// The geometry of a leg that has a closed form; filled by detect_hip_knee (ik.h).
template <class Number>
struct HipKneeOf {
  Number o1[3], w1[3], w2[3], b[3];      // first origin; axes; b = w1 x w2
  Number d;                              // tip along w2 from o1, m
  Number o2[2], upper[2];                // o2 - o1 and o3 - o2 in the plane (w1, w2 x w1), m
  Number lower_length, bend;             // of tip - o3, m; angle from `upper` to it at q3 = 0, rad
  Number sign3;                          // of the third axis along w2
  Number hip, knee;                      // branches: side of the hip, direction of the knee, +-1
  Number reference[3], low[3], high[3];  // rad; angles are given in the turn of the reference
};
using HipKneeView = HipKneeOf<double>;

inline namespace GRAZE_ISA_NAMESPACE {

/// The angle's turn that is nearest to the reference.
template <class T, class Number>
inline T wrap_near(const T& angle, const Number& reference) {
  constexpr double kTurn = 6.283185307179586, kPerTurn = 0.15915494309189535;
  return fnma(T(kTurn), round_to_integer((angle - lanes_of<T>(reference)) * T(kPerTurn)), angle);
}

/// Cuts a cosine to [-1, 1] and returns the sine of the angle in [0, pi]; `reached` ends where there is no such angle.
template <class T>
inline T sine_of(T& cosine, mask_of<T>& reached) {
  reached = reached & (abs(cosine) <= T(1.0));
  cosine = max(min(cosine, T(1.0)), T(-1.0));
  return sqrt((T(1.0) - cosine) * (T(1.0) + cosine));
}

/// Joint angles without regard to limits. The tip's coordinate along w2 does not change with q2 and q3, which gives q1;
/// the rest is a planar arm of two links. Out of reach, the nearest stretched or folded posture in the leg's plane.
template <class T, class Number>
inline void solve_hip_knee_freely(const HipKneeOf<Number>& leg, const Vec3T<T>& x, T* q, mask_of<T>& reached) {
  const Vec3T<T> y = x - constant_vec3<T>(leg.o1);
  const T ya = dot(constant_vec3<T>(leg.w2), y), yb = dot(constant_vec3<T>(leg.b), y);
  // Turning the target back by q1 about w1 must bring its coordinate along w2 to d: ya cos q1 + yb sin q1 = d. With
  // (ya, yb) at the angle alpha and distance r, cos(q1 - alpha) = d / r; its other coordinate is then r sin(q1 -
  // alpha).
  const T r = sqrt(fma(yb, yb, ya * ya));
  T c1 = select(r > T(0.0), lanes_of<T>(leg.d) / r, T(2.0));
  const T s1 = lanes_of<T>(leg.hip) * sine_of(c1, reached);
  q[0] = wrap_near(atan2(fma(yb, c1, ya * s1), fnma(yb, s1, ya * c1)), leg.reference[0]);
  const T u = dot(constant_vec3<T>(leg.w1), y) - lanes_of<T>(leg.o2[0]), w = fma(r, s1, T(-value_of<T>(leg.o2[1])));
  // Two links a, c with the angle phi between them: |target|^2 = |a|^2 + |c|^2 + 2 |a| |c| cos(phi).
  using Value = ValueOf<T, Number>;
  const Value upper[2] = {value_of<T>(leg.upper[0]), value_of<T>(leg.upper[1])}, c = value_of<T>(leg.lower_length);
  const Value a2 = upper[0] * upper[0] + upper[1] * upper[1], c2 = c * c;
  const Value a = sqrt(a2), ratio = c / a;
  T cosine = (fma(w, w, u * u) - T(a2 + c2)) * T(Value(1.0) / (Value(2.0) * a * c));
  const T sine = lanes_of<T>(leg.knee) * sine_of(cosine, reached);
  q[2] = wrap_near(lanes_of<T>(leg.sign3) * (atan2(sine, cosine) - lanes_of<T>(leg.bend)), leg.reference[2]);
  // The folded leg at q2 = 0, and the angle from it to the target.
  const T along = fma(T(ratio), cosine, T(1.0)), across = T(ratio) * sine;
  const T fu = fnma(across, T(upper[1]), along * T(upper[0]));
  const T fw = fma(across, T(upper[0]), along * T(upper[1]));
  q[1] = wrap_near(atan2(fnma(fw, u, fu * w), fma(fw, w, fu * u)), leg.reference[1]);
}

/// The same within joint limits. Returns where x is reached.
template <class T, class Number>
inline mask_of<T> solve_hip_knee(const HipKneeOf<Number>& leg, const Vec3T<T>& x, T* q) {
  mask_of<T> reached = T(0.0) == T(0.0);
  solve_hip_knee_freely(leg, x, q, reached);
  for (int i = 0; i < 3; ++i) {
    const T free = q[i];
    q[i] = min(max(free, lanes_of<T>(leg.low[i])), lanes_of<T>(leg.high[i]));
    reached = reached & (q[i] == free);
  }
  return reached;
}

/// J^T (J J^T + lambda^2 1)^-1 e. J: n columns; step: n.
template <class T, int N>
inline void damped_step(int size, const Vec3T<T>* J, const Vec3T<T>& e, const T& lambda, T* step) {
  const int n = N > 0 ? N : size;
  T A[9], y[3] = {e.x, e.y, e.z};
  A[0] = A[4] = A[8] = lambda * lambda;
  A[3] = A[6] = A[7] = T(0.0);
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) {
    A[0] = fma(J[i].x, J[i].x, A[0]);
    A[3] = fma(J[i].y, J[i].x, A[3]);
    A[4] = fma(J[i].y, J[i].y, A[4]);
    A[6] = fma(J[i].z, J[i].x, A[6]);
    A[7] = fma(J[i].z, J[i].y, A[7]);
    A[8] = fma(J[i].z, J[i].z, A[8]);
  }
  solve_spd<T, 3, 3>(3, A, y);
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) step[i] = dot(J[i], Vec3T<T>{y[0], y[1], y[2]});
}

/// Joint velocities for a tip that shall move at xd. Below a singular value of about 1 mm/rad the leg is stretched, and
/// joint speed is bounded instead of exact.
template <class T, int N, class Number>
inline void tip_velocity_to_joints(const ChainOf<Number>& chain, const T* q, const Vec3T<T>& xd, T* v) {
  Vec3T<T> J[kChainRoom<N>];
  chain_jacobian<T, N>(chain, q, J);
  damped_step<T, N>(chain.n, J, xd, T(1e-3), v);
}

template <class T, class Number>
inline T within_limits(const ChainJointOf<Number>& joint, const T& q) {
  return min(max(q, lanes_of<T>(joint.lower)), lanes_of<T>(joint.upper));
}

/// The damped step from q with joints left out that stand at a limit and would leave it. J is spoiled.
template <class T, class Number>
inline void limited_step(const ChainOf<Number>& chain, Vec3T<T>* J, const T* q, const Vec3T<T>& e, const T& lambda,
                         T* step) {
  damped_step<T, 0>(chain.n, J, e, lambda, step);
  for (int pass = 0; pass < chain.n; ++pass) {
    bool dropped = false;
    for (int i = 0; i < chain.n; ++i) {
      const T lower = lanes_of<T>(chain.joint[i].lower), upper = lanes_of<T>(chain.joint[i].upper);
      const auto blocked = ((q[i] <= lower) & (step[i] < T(0.0))) | ((q[i] >= upper) & (step[i] > T(0.0)));
      J[i] = select(blocked, Vec3T<T>{T(0.0), T(0.0), T(0.0)}, J[i]);
      dropped = dropped || any(blocked);
    }
    if (!dropped) return;  // lanes without a dropped joint find the step that they have
    damped_step<T, 0>(chain.n, J, e, lambda, step);
  }
}

/// Damped least squares (Levenberg-Marquardt on |x(q) - x|^2, Nakamura & Hanafusa 1986) from the guess in q, within
/// joint limits. A lane rests once its tip is within `tolerance` (m) or no step helps. Returns the remaining distance,
/// m; for a target out of reach q is a local minimum of the distance.
template <class T, class Number>
inline T solve_damped(const ChainOf<Number>& chain, const Vec3T<T>& x, T* q, double tolerance = 1e-9,
                      int iterations = 60) {
  constexpr int room = kMaxChainJoints;
  const int n = chain.n;
  for (int i = 0; i < n; ++i) q[i] = within_limits(chain.joint[i], q[i]);
  Vec3T<T> J[room];
  Vec3T<T> e = x - chain_jacobian<T, 0>(chain, q, J);
  T lambda = T(1e-3);  // m/rad; legs of a few decimetres have singular values of about 0.1
  mask_of<T> open = sqrt(norm2(e)) > T(tolerance);
  for (int k = 0; k < iterations && any(open); ++k) {
    T trial[room], step[room];
    Vec3T<T> J_trial[room];
    for (int i = 0; i < n; ++i) J_trial[i] = J[i];
    limited_step(chain, J_trial, q, e, lambda, step);
    for (int i = 0; i < n; ++i) trial[i] = within_limits(chain.joint[i], q[i] + step[i]);
    const Vec3T<T> e_trial = x - chain_jacobian<T, 0>(chain, trial, J_trial);
    const mask_of<T> better = open & (norm2(e_trial) < norm2(e));
    for (int i = 0; i < n; ++i) {
      q[i] = select(better, trial[i], q[i]);
      J[i] = select(better, J_trial[i], J[i]);
    }
    e = select(better, e_trial, e);
    lambda = select(better, max(T(0.25) * lambda, T(1e-7)), T(4.0) * lambda);
    const mask_of<T> hopeful = lambda <= T(1e3);  // else a local minimum: no step helps
    open = open & (better | hopeful) & (sqrt(norm2(e)) > T(tolerance));
  }
  return sqrt(norm2(e));
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
