// The kernels of policies and trackers for one instruction set; compiled once for each (see CMakeLists.txt).

#include "engine/control/kernel.h"

#include <cstddef>

#include "engine/control/base_stabilizer.h"
#include "engine/control/gait_planner.h"
#include "engine/control/inverse_dynamics.h"
#include "engine/control/leg_ik.h"
#include "engine/control/operational_pd.h"

namespace graze {

namespace {

template <class T>
struct Rows {
  mask_of<T> active;
  static T at(const double* array, int row) { return load<T>(array + row * kWidth<T>); }
  static Vec3T<T> vec3_at(const double* array, int row) { return load_vec3<T>(array + row * kWidth<T>); }
  void set(double* array, int row, const T& value) const {
    double* const p = array + row * kWidth<T>;
    store(p, select(active, value, load<T>(p)));
  }
  void set_vec3(double* array, int row, const Vec3T<T>& a) const {
    set(array, row, a.x);
    set(array, row + 1, a.y);
    set(array, row + 2, a.z);
  }
};

template <class T, int N, class Number>
Vec3T<T> sensed_tip(const ChainOf<Number>& chain, const double* joint_position) {
  T q[kChainRoom<N>];
  for (int i = 0; i < chain_size<N>(chain); ++i) q[i] = Rows<T>::at(joint_position, chain.joint[i].actuator);
  return chain_tip<T, N>(chain, q);
}

template <class T, class Number>
GaitSenses<T> sense(const GaitOf<Number>& view, const GaitCall& call) {
  const GaitParametersOf<Number>& p = view.p;
  GaitSenses<T> in;
  in.t = Rows<T>::at(call.time, 0);
  in.dt = select(mask_from_bits<T>(call.fresh), T(0.0), in.t - Rows<T>::at(call.last_time, 0));
  in.command = {Rows<T>::vec3_at(call.command, 0), Rows<T>::vec3_at(call.command, 3)};
  in.roll = in.pitch = T(0.0);
  if (p.global_up) {
    in.roll = Rows<T>::at(call.base_rpy, 0);
    in.pitch = Rows<T>::at(call.base_rpy, 1);
  }
  for (int i = 0; i < p.timing.feet; ++i) {
    const LegOf<Number>& leg = view.legs[i];
    in.x[i] = leg.chain.n == 3 ? sensed_tip<T, 3>(leg.chain, call.joint_position)
                               : sensed_tip<T, 0>(leg.chain, call.joint_position);
    if (!p.recovery) continue;
    in.force[i] = T(0.0);
    for (int k = 0; k < leg.forces; ++k) in.force[i] += Rows<T>::at(call.link_force, leg.force[k]);
  }
  return in;
}

/// Joint targets of one leg.
template <class T, int N, class Number>
void solve_leg(const LegOf<Number>& leg, const FootPlan<T>& foot, const Rows<T>& rows, unsigned fresh, double* guess,
               const GaitCall& call) {
  const ChainOf<Number>& chain = leg.chain;
  const int n = chain_size<N>(chain);
  T q[kChainRoom<N>], v[kChainRoom<N>];
  if (leg.closed != nullptr) {
    solve_hip_knee(*leg.closed, foot.x, q);
  } else {
    for (int j = 0; j < n; ++j) {
      q[j] = select(mask_from_bits<T>(fresh), lanes_of<T>(leg.reference[j]), Rows<T>::at(guess, j));
    }
    solve_damped(chain, foot.x, q);
    for (int j = 0; j < n; ++j) rows.set(guess, j, q[j]);
  }
  tip_velocity_to_joints<T, N>(chain, q, foot.xd, v);
  for (int j = 0; j < n; ++j) {
    rows.set(call.q, chain.joint[j].actuator, q[j]);
    rows.set(call.v, chain.joint[j].actuator, v[j]);
  }
}

template <class T, int N, class Number>
void push_with_leg(const LegOf<Number>& leg, const Vec3T<T>& up, const T& push, const Rows<T>& rows,
                   const GaitCall& call) {
  const ChainOf<Number>& chain = leg.chain;
  const int n = chain_size<N>(chain);
  T q[kChainRoom<N>], tau[kChainRoom<N>];
  for (int j = 0; j < n; ++j) {
    q[j] = Rows<T>::at(call.joint_position, chain.joint[j].actuator);
    tau[j] = Rows<T>::at(call.tau, chain.joint[j].actuator);
  }
  push_foot<T, N>(chain, q, up, push, tau);
  for (int j = 0; j < n; ++j) rows.set(call.tau, chain.joint[j].actuator, tau[j]);
}

/// Feed-forward torques that right the base by the feet that stand and, if forces are sensed, carry.
template <class T, class Number>
void stabilize(const GaitOf<Number>& view, const GaitCall& call, const GaitSenses<T>& in, const FootPlan<T>* feet,
               const Rows<T>& rows) {
  const GaitParametersOf<Number>& p = view.p;
  const T roll = Rows<T>::at(call.base_rpy, 0), pitch = Rows<T>::at(call.base_rpy, 1);
  unsigned stands[kMaxFeet];
  for (int i = 0; i < p.timing.feet; ++i) {
    stands[i] = call.active & ~feet[i].swing;
    if (p.recovery) stands[i] &= bits(in.force[i] > lanes_of<T>(p.contact_force));
  }
  const Vec3T<T> up = up_of(roll, pitch);
  const Vec3T<T> moment =
      righting_moment<T>(p.stabilizer, roll, pitch, Rows<T>::at(call.base_rpy, 2), Rows<T>::vec3_at(call.base_rate, 0));
  T push[kMaxFeet];
  righting_pushes<T>(p.timing.feet, in.x, stands, up, moment, push);
  for (int i = 0; i < p.timing.feet; ++i) {
    const LegOf<Number>& leg = view.legs[i];
    leg.chain.n == 3 ? push_with_leg<T, 3>(leg, up, push[i], rows, call)
                     : push_with_leg<T, 0>(leg, up, push[i], rows, call);
  }
}

template <class T, class Number>
void gait(const GaitOf<Number>& view, const GaitCall& call) {
  const Rows<T> rows{mask_from_bits<T>(call.active)};
  FootPlan<T>* const feet = reinterpret_cast<FootPlan<T>*>(call.feet);
  const GaitSenses<T> in = sense<T>(view, call);
  if (call.fresh) start_feet(view.p, in, call.fresh, feet);
  plan(view.p, in, call.active, feet);
  rows.set(call.last_time, 0, in.t);
  for (int k = 0; k < view.na; ++k) {
    rows.set(call.q, k, lanes_of<T>(view.initial[k]));
    rows.set(call.v, k, T(0.0));
    rows.set(call.tau, k, T(0.0));
  }
  for (int i = 0; i < view.p.timing.feet; ++i) {
    rows.set_vec3(call.x, 3 * i, feet[i].x);
    rows.set_vec3(call.xd, 3 * i, feet[i].xd);
    if (!view.by_joints) continue;
    double* const guess = call.guess + i * kMaxChainJoints * kWidth<T>;
    const LegOf<Number>& leg = view.legs[i];
    leg.chain.n == 3 ? solve_leg<T, 3>(leg, feet[i], rows, call.fresh, guess, call)
                     : solve_leg<T, 0>(leg, feet[i], rows, call.fresh, guess, call);
  }
  if (view.p.stabilizer.on) stabilize(view, call, in, feet, rows);
}

template <class T, int N, class Number>
void track_chain(const OperationalPdOf<Number>& view, const OperationalPdCall& call, int effector,
                 const Rows<T>& rows) {
  const ChainOf<Number>& chain = view.chains[effector];
  const int n = chain_size<N>(chain);
  T q[kChainRoom<N>], v[kChainRoom<N>], tau[kChainRoom<N>];
  for (int i = 0; i < n; ++i) {
    q[i] = Rows<T>::at(call.joint_position, chain.joint[i].actuator);
    v[i] = Rows<T>::at(call.joint_velocity, chain.joint[i].actuator);
    tau[i] = Rows<T>::at(call.tau, chain.joint[i].actuator);
  }
  track_effector<T, N>(view, chain, q, v, Rows<T>::vec3_at(call.x, 3 * effector),
                       Rows<T>::vec3_at(call.xd, 3 * effector), tau);
  for (int i = 0; i < n; ++i) rows.set(call.tau, chain.joint[i].actuator, tau[i]);
}

template <class T, class Number>
void operational_pd(const OperationalPdOf<Number>& view, const OperationalPdCall& call) {
  const Rows<T> rows{mask_from_bits<T>(call.active)};
  for (int k = 0; k < view.na; ++k) {
    rows.set(call.tau, k, Rows<T>::at(call.target_tau, k));
    rows.set(call.kp, k, T(0.0));
    rows.set(call.kd, k, T(0.0));
    rows.set(call.ki, k, T(0.0));
  }
  for (int e = 0; e < view.effectors; ++e) {
    view.chains[e].n == 3 ? track_chain<T, 3>(view, call, e, rows) : track_chain<T, 0>(view, call, e, rows);
  }
}

template <class T>
void foot_modes(const double* feet, int count, int lane, double* out) {
  const FootPlan<T>* const plan = reinterpret_cast<const FootPlan<T>*>(feet);
  const unsigned bit = 1u << static_cast<unsigned>(lane);
  for (int i = 0; i < count; ++i) {
    const FootMode mode = plan[i].swing & bit     ? FootMode::swing
                          : plan[i].reach & bit   ? FootMode::reach
                          : plan[i].support & bit ? FootMode::support
                                                  : FootMode::stance;
    out[i] = static_cast<int>(mode);
  }
}

/// Numbers of a FootPlan that stand before its masks.
template <class T>
constexpr int kFootRows = static_cast<int>(offsetof(FootPlan<T>, swing) / sizeof(T));

template <class T>
void copy_feet(double* feet, int count, int lane, double* numbers, bool back) {
  const unsigned bit = 1u << static_cast<unsigned>(lane);
  for (int i = 0; i < count; ++i) {
    FootPlan<T>& plan = reinterpret_cast<FootPlan<T>*>(feet)[i];
    double* const rows = reinterpret_cast<double*>(&plan);
    for (int k = 0; k < kFootRows<T>; ++k, ++numbers) {
      double& row = rows[k * kWidth<T> + lane];
      back ? row = *numbers : * numbers = row;
    }
    unsigned* const masks[] = {&plan.swing, &plan.reach, &plan.support};
    for (unsigned* const mask : masks) {
      if (back) *mask = *numbers != 0 ? *mask | bit : *mask & ~bit;
      if (!back) *numbers = *mask & bit ? 1 : 0;
      ++numbers;
    }
  }
}

}  // namespace

const ControlKernel& GRAZE_OF_ISA(find_control_kernel)() {
  using T = Pack<8>;
  static constexpr ControlKernel kernel{static_cast<int>(sizeof(FootPlan<T>) / sizeof(double)),
                                        &gait<T, double>,
                                        &gait<T, LaneNumber>,
                                        &operational_pd<T, double>,
                                        &operational_pd<T, LaneNumber>,
                                        &inverse_dynamics<T>,
                                        &foot_modes<T>,
                                        kFootRows<T> + 3,
                                        &copy_feet<T>};
  return kernel;
}

}  // namespace graze
