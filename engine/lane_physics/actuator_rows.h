#pragma once
// Actuators around a step, for back ends that solve servos themselves: what a command becomes as a Drive, and what
// follows from its result. The same sums as Actuators::apply_lane, on lanes.

#include "engine/lane_physics/kernel.h"
#include "engine/lanes/pack.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Largest torque at `share` = speed / no-load speed, in the direction that counts as forward. Linear (6.1.1), but for
/// a motor that is driven against its torque, which keeps all of it.
template <class T>
inline T available(const T& effort, const T& share) {
  return effort * (T(1.0) - min(max(share, T(0.0)), T(1.0)));
}

template <class T>
void fill_drive(const ActuatorRows& rows) {
  constexpr int W = kWidth<T>;
  const T infinity(__builtin_inf());
  for (int k = 0; k < rows.na; ++k) {
    const auto row = [&](const double* p) { return load<T>(p + k * W); };
    const auto put = [&](double* p, const T& x) { store(p + k * W, x); };
    const T q_ref = row(rows.q_target) - row(rows.q_bias), ki = row(rows.ki);
    put(rows.q_ref, q_ref);
    put(rows.v_ref, row(rows.v_target) - row(rows.v_bias));
    put(rows.q_error, q_ref - load<T>(rows.q + rows.q_index[k] * W));
    const T integral = select(ki == T(0.0), T(0.0), row(rows.integral));
    put(rows.feed, row(rows.tau) + ki * integral + row(rows.tau_bias));
    const T effort = row(rows.effort), speed = row(rows.speed);
    T lower = -effort, upper = effort;
    const mask_of<T> line = (speed > T(0.0)) & (effort < infinity);
    if (rows.torque_speed && any(line)) {
      const T share = load<T>(rows.v + rows.v_index[k] * W) / select(line, speed, T(1.0));
      upper = select(line, available(effort, share), upper);
      lower = select(line, -available(effort, -share), lower);
    }
    const mask_of<T> limited = row(rows.prescribed) < T(2.0);
    put(rows.upper, select(limited, upper, infinity));
    put(rows.lower, select(limited, lower, -infinity));
  }
}

template <class T>
void follow_drive(const ActuatorRows& rows) {
  constexpr int W = kWidth<T>;
  const mask_of<T> active = mask_from_bits<T>(rows.active);
  for (int k = 0; k < rows.na; ++k) {
    const auto row = [&](const double* p) { return load<T>(p + k * W); };
    const auto put = [&](double* p, const T& x) { store(p + k * W, select(active, x, row(p))); };
    const T demand = row(rows.demand), q_error = row(rows.q_error), integral = row(rows.integral);
    const T limit = select(demand < T(0.0), -row(rows.lower), row(rows.upper));
    const T room = limit - abs(demand);
    const mask_of<T> grows = demand * q_error > T(0.0);  // anti-windup: a cut torque is not asked to grow further
    const T more = integral + select((room >= T(0.0)) | !grows, T(rows.h) * q_error, T(0.0));
    put(rows.integral, select(row(rows.ki) == T(0.0), T(0.0), more));
    put(rows.headroom, room);
    put(rows.out, row(rows.torque));
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
