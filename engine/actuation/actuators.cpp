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
      headroom_(nominal.na()) {
  for (const int body : nominal.actuated) {
    v_index_.push_back(nominal.bodies[body].v);
    q_index_.push_back(nominal.bodies[body].q);
  }
}

void Actuators::start(int lane, const Particle& particle) {
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

void Actuators::apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                      LaneMask active, BlockArray& tau) {
  for (int k = 0; k < effort_.rows(); ++k) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const double v = state.v(v_index_[k], lane);
      const double q_error = command.q(k, lane) - (state.q(q_index_[k], lane) + sensors.encoder_error()(k, lane));
      const double v_error = command.v(k, lane) - (v + sensors.encoder_velocity_error()(k, lane));
      const double ki = command.ki(k, lane);
      const double asked = command.tau(k, lane) + command.kp(k, lane) * q_error + command.kd(k, lane) * v_error +
                           ki * integral_(k, lane) + sensors.torque_error()(k, lane);
      const double limit = available(k, lane, asked < 0 ? -1.0 : 1.0, v);
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
}

}  // namespace graze
