#pragma once
// Joint accelerations that pull effectors to their targets, for inverse dynamics in operational space.

#include "engine/control/leg_ik.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Adds the joint accelerations for one effector, whose tip shall accelerate by a = kp (x_des - x) + kd (xd_des - xd),
/// to those of its chain: J^T a, as the published code has it, or those with J q'' = a of least squares, which near a
/// stretched leg is damped.
template <class T, int N>
inline void accelerate_chain(const OperationalWishView& wish, const ChainView& chain, const T* q, const T* v,
                             const Vec3T<T>& x_des, const Vec3T<T>& xd_des, T* acceleration) {
  constexpr int room = kChainRoom<N>;
  const int n = chain_size<N>(chain);
  ChainPose<T, N> pose;
  walk_chain(chain, q, pose, [](int, const RotT<T>&, const Vec3T<T>&) {});
  Vec3T<T> J[room], slip = xd_des;
  for (int i = 0; i < n; ++i) {
    J[i] = tip_column(chain, pose, i);
    slip -= v[i] * J[i];
  }
  const Vec3T<T> a = axpy(T(wish.kp), x_des - pose.tip, T(wish.kd) * slip);
  T part[room];
  if (wish.transposed) {
    for (int i = 0; i < n; ++i) part[i] = dot(J[i], a);
  } else {
    damped_step<T, N>(n, J, a, T(1e-3), part);
  }
  for (int i = 0; i < n; ++i) acceleration[i] = acceleration[i] + part[i];
}

/// Joint velocities at the end of the step: v + h a, with a of all effectors; joints of none keep theirs.
template <class T, int N>
inline void wish_of_effector(const InverseDynamicsView& view, const InverseDynamicsCall& call, int effector, T* want) {
  const ChainView& chain = view.operational.chains[effector];
  const int n = chain_size<N>(chain);
  T q[kChainRoom<N>], v[kChainRoom<N>], a[kChainRoom<N>];
  for (int i = 0; i < n; ++i) {
    const int row = chain.joint[i].actuator;
    q[i] = load<T>(call.joint_position + row * kWidth<T>);
    v[i] = load<T>(call.joint_velocity + row * kWidth<T>);
    a[i] = T(0.0);
  }
  accelerate_chain<T, N>(view.operational, chain, q, v, load_vec3<T>(call.target_x + 3 * effector * kWidth<T>),
                         load_vec3<T>(call.target_xd + 3 * effector * kWidth<T>), a);
  for (int i = 0; i < n; ++i) {
    T& at = want[view.v[chain.joint[i].actuator]];
    at = fma(T(view.h), a[i], at);
  }
}

template <class T>
inline void wish_of_effectors(const InverseDynamicsView& view, const InverseDynamicsCall& call, const T* v, T* want) {
  for (int k = 0; k < view.na; ++k) want[view.v[k]] = v[view.v[k]];
  for (int e = 0; e < view.operational.effectors; ++e) {
    view.operational.chains[e].n == 3 ? wish_of_effector<T, 3>(view, call, e, want)
                                      : wish_of_effector<T, 0>(view, call, e, want);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
