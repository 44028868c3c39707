#include "engine/actuation/actuators.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace graze {

Actuators::Actuators(const Model& nominal, bool torque_speed)
    : torque_speed_(torque_speed),
      effort_(nominal.na()),
      speed_(nominal.na()),
      integral_(nominal.na()),
      headroom_(nominal.na()),
      asked_(nominal.na()) {
  for (const int body : nominal.actuated) {
    v_index_.push_back(nominal.bodies[body].v);
    q_index_.push_back(nominal.bodies[body].q);
  }
}

void Actuators::start(int lane, const Particle& particle) {
  limbs_[lane] = limbs_of(particle.model);
  for (int k = 0; k < effort_.rows(); ++k) {
    const Body& body = particle.model.bodies[particle.model.actuated[k]];
    effort_(k, lane) = body.effort;
    speed_(k, lane) = body.velocity;
    integral_(k, lane) = 0;
    headroom_(k, lane) = body.effort;
  }
}

double Actuators::available(int k, int lane, double sign, double v) const {
  const double effort = effort_(k, lane);
  if (!torque_speed_ || !(speed_(k, lane) > 0) || !std::isfinite(effort)) return effort;
  // A motor that is driven against its torque (braking) keeps its full torque: the line falls only where torque and
  // motion point the same way.
  const double along = std::max(sign * v, 0.0);
  return effort * std::clamp(1.0 - along / speed_(k, lane), 0.0, 1.0);
}

void Actuators::add_damping(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                            int lane) {
  for (LimbInertia& limb : limbs_[lane]) {
    const auto& links = limb.links();
    const int n = static_cast<int>(links.size());
    bool damped = false;
    for (const LimbInertia::Link& link : links) damped = damped || command.kd(link.actuator, lane) != 0;
    if (!damped) continue;
    q_.resize(n);
    error_.resize(n);
    for (int i = 0; i < n; ++i) {
      const int k = links[i].actuator;
      q_[i] = state.q(links[i].q, lane);
      error_[i] = command.v(k, lane) - (state.v(v_index_[k], lane) + sensors.encoder_velocity_error()(k, lane));
    }
    // tau = K w with w = e - h M^-1 K w, that is (M + h K) w = M e.
    limb.evaluate(q_, M_);
    error_ = M_ * error_;
    for (int i = 0; i < n; ++i) M_(i, i) += h * command.kd(links[i].actuator, lane);
    solver_.compute(M_);
    error_ = solver_.solve(error_);
    for (int i = 0; i < n; ++i) asked_[links[i].actuator] += command.kd(links[i].actuator, lane) * error_[i];
  }
}

void Actuators::apply_lane(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                           int lane, BlockArray& tau) {
  std::fill(asked_.begin(), asked_.end(), 0.0);
  add_damping(command, state, sensors, h, lane);
  for (int k = 0; k < effort_.rows(); ++k) {
    const double q_error = command.q(k, lane) - (state.q(q_index_[k], lane) + sensors.encoder_error()(k, lane));
    const double ki = command.ki(k, lane);
    const double asked = command.tau(k, lane) + command.kp(k, lane) * q_error + asked_[k] + ki * integral_(k, lane) +
                         sensors.torque_error()(k, lane);
    const double limit = available(k, lane, asked < 0 ? -1.0 : 1.0, state.v(v_index_[k], lane));
    tau(k, lane) = std::clamp(asked, -limit, limit);
    headroom_(k, lane) = limit - std::abs(asked);
    // Anti-windup by conditional integration: a cut torque is not asked to grow further. Without ki there is no
    // integral, so that switching ki on later starts from nothing.
    const bool grows = asked * q_error > 0;
    if (ki == 0) {
      integral_(k, lane) = 0;
    } else if (headroom_(k, lane) >= 0 || !grows) {
      integral_(k, lane) += h * q_error;
    }
  }
}

void Actuators::apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                      LaneMask active, BlockArray& tau) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane]) apply_lane(command, state, sensors, h, lane, tau);
  }
}

}  // namespace graze
