#pragma once
// The law of the tracker `operational_pd` on lanes (operational_pd.cpp says what it is).

#include "engine/control/kernel.h"
#include "engine/dynamics/chain_motion.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Torques J^T (kp (x_des - x) + D (xd_des - J v)) of one effector, added to tau. D is kd, or, implicit over h,
/// (1/kd + h J M^-1 J^T)^-1. With S = M + h kd J^T J that is J^T D e = kd M S^-1 J^T e (Woodbury), which asks for
/// one factorisation and no inverse.
template <class T, int N, class Number>
inline void track_effector(const OperationalPdOf<Number>& pd, const ChainOf<Number>& chain, const T* q, const T* v,
                           const Vec3T<T>& x_des, const Vec3T<T>& xd_des, T* tau) {
  constexpr int row = kChainRoom<N>;
  const int n = chain_size<N>(chain);
  const bool implicit = pd.period > 0 && pd.kd > 0;
  ChainPose<T, N> pose;
  ChainInertia<T, ValueOf<T, Number>> body[row];
  if (implicit) {
    walk_chain(chain, q, pose,
               [&](int i, const RotT<T>& R, const Vec3T<T>& p) { body[i] = body_inertia(chain.joint[i], R, p); });
  } else {
    walk_chain(chain, q, pose, [](int, const RotT<T>&, const Vec3T<T>&) {});
  }
  Vec3T<T> J[row], slip = xd_des;
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) {
    J[i] = tip_column(chain, pose, i);
    slip -= v[i] * J[i];
  }
  const Vec3T<T> spring = T(pd.kp) * (x_des - pose.tip), damper = T(pd.kd) * slip;
  T damping[row];
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) damping[i] = dot(J[i], damper);
  if (implicit) {
    T M[row * row], S[row * row], y[row];
    chain_inertia(chain, pose, body, M);
    const T weight = T(pd.period * pd.kd);
    GRAZE_UNROLL_JOINTS
    for (int i = 0; i < n; ++i) {
      y[i] = damping[i];
      GRAZE_UNROLL_JOINTS
      for (int j = 0; j <= i; ++j) S[i * row + j] = fma(weight, dot(J[i], J[j]), M[i * row + j]);
    }
    solve_spd<T, N, row>(n, S, y);
    GRAZE_UNROLL_JOINTS
    for (int i = 0; i < n; ++i) {
      T sum = M[i * row + i] * y[i];
      GRAZE_UNROLL_JOINTS
      for (int j = 0; j < n; ++j) {
        if (j != i) sum = fma(j < i ? M[i * row + j] : M[j * row + i], y[j], sum);
      }
      damping[i] = sum;
    }
  }
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) tau[i] = dot_add(J[i], spring, tau[i] + damping[i]);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
