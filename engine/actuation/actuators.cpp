#include "engine/actuation/actuators.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace graze {

namespace {

/// Actuators of each limb: joints that hang together without the base. By their first actuator.
std::vector<std::vector<int>> limbs_of(const Model& model) {
  std::vector<std::vector<int>> limbs;
  std::vector<int> limb(model.bodies.size(), -1);
  for (int k = 0; k < model.na(); ++k) {
    const int body = model.actuated[k], parent = model.bodies[body].parent;
    limb[body] = parent < 0 ? -1 : limb[parent];
    if (limb[body] < 0) {
      limb[body] = static_cast<int>(limbs.size());
      limbs.emplace_back();
    }
    limbs[limb[body]].push_back(k);
  }
  return limbs;
}

}  // namespace

Actuators::Actuators(const Model& nominal, bool torque_speed, bool drives_solved)
    : nominal_(nominal),
      torque_speed_(torque_speed),
      drives_solved_(drives_solved),
      effort_(nominal.na()),
      speed_(nominal.na()),
      integral_(nominal.na()),
      headroom_(nominal.na()),
      q_error_(nominal.na()),
      drive_(nominal.na()),
      result_(nominal.na()),
      limbs_(limbs_of(nominal)),
      demand_(nominal.na()),
      q_(nominal.nq) {
  for (const int body : nominal.actuated) {
    v_index_.push_back(nominal.bodies[body].v);
    q_index_.push_back(nominal.bodies[body].q);
  }
}

void Actuators::start(int lane, const Particle& particle) {
  if (!drives_solved_) {
    if (!dynamics_[lane]) dynamics_[lane] = std::make_unique<DynamicsData<double>>(nominal_);
    dynamics_[lane]->set_lane(0, DynamicsModel(particle.model));
  }
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

void Actuators::update_inertia(const BlockState& state, int lane) {
  for (std::size_t i = 0; i < q_.size(); ++i) q_[i] = state.q(static_cast<int>(i), lane);
  update_poses(dynamics_[lane]->tree(), q_.data());
  update_mass(dynamics_[lane]->tree());
}

void Actuators::add_damping(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                            int lane) {
  bool fresh = false;
  for (const std::vector<int>& limb : limbs_) {
    const int n = static_cast<int>(limb.size());
    if (std::all_of(limb.begin(), limb.end(), [&](int k) { return command.kd(k, lane) == 0; })) continue;
    if (!fresh) update_inertia(state, lane);
    fresh = true;
    // tau = K w with w = e - h M^-1 K w, that is (M + h K) w = M e.
    M_.resize(n, n);
    error_.resize(n);
    for (int i = 0; i < n; ++i) {
      const int k = limb[i], dof = v_index_[k];
      error_[i] = command.v(k, lane) - (state.v(dof, lane) + sensors.encoder_velocity_error()(k, lane));
      for (int j = 0; j <= i; ++j) M_(i, j) = M_(j, i) = mass_entry(dynamics_[lane]->tree(), dof, v_index_[limb[j]]);
    }
    error_ = M_ * error_;
    for (int i = 0; i < n; ++i) M_(i, i) += h * command.kd(limb[i], lane);
    solver_.compute(M_);
    error_ = solver_.solve(error_);
    for (int i = 0; i < n; ++i) demand_[limb[i]] += command.kd(limb[i], lane) * error_[i];
  }
}

void Actuators::apply_lane(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                           int lane, BlockArray& tau) {
  std::fill(demand_.begin(), demand_.end(), 0.0);
  add_damping(command, state, sensors, h, lane);
  for (int k = 0; k < effort_.rows(); ++k) {
    const double q_error = command.q(k, lane) - (state.q(q_index_[k], lane) + sensors.encoder_error()(k, lane));
    const double ki = command.ki(k, lane);
    const double demand = command.tau(k, lane) + command.kp(k, lane) * q_error + demand_[k] + ki * integral_(k, lane) +
                          sensors.torque_error()(k, lane);
    const double limit = available(k, lane, demand < 0 ? -1.0 : 1.0, state.v(v_index_[k], lane));
    tau(k, lane) = std::clamp(demand, -limit, limit);
    headroom_(k, lane) = limit - std::abs(demand);
    // Anti-windup by conditional integration: a cut torque is not asked to grow further. Without ki there is no
    // integral, so that switching ki on later starts from nothing.
    const bool grows = demand * q_error > 0;
    if (ki == 0) {
      integral_(k, lane) = 0;
    } else if (headroom_(k, lane) >= 0 || !grows) {
      integral_(k, lane) += h * q_error;
    }
  }
}

void Actuators::fill_drive(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (int k = 0; k < effort_.rows(); ++k) {
    const double *q = state.q.row(q_index_[k]), *v = state.v.row(v_index_[k]);
    const double *q_bias = sensors.encoder_error().row(k), *v_bias = sensors.encoder_velocity_error().row(k);
    const double *tau_bias = sensors.torque_error().row(k), *ki = command.ki.row(k), *integral = integral_.row(k);
    const double *effort = effort_.row(k), *speed = speed_.row(k), *tau = command.tau.row(k);
    const double *q_target = command.q.row(k), *v_target = command.v.row(k);
    const double* prescribed = command.prescribed.row(k);
    double *q_error = q_error_.row(k), *q_ref = drive_.q.row(k), *v_ref = drive_.v.row(k);
    double *feed = drive_.tau.row(k), *lower = drive_.lower.row(k), *upper = drive_.upper.row(k);
    for (int lane = 0; lane < kLanes; ++lane) {
      q_ref[lane] = q_target[lane] - q_bias[lane];
      v_ref[lane] = v_target[lane] - v_bias[lane];
      q_error[lane] = q_ref[lane] - q[lane];
      feed[lane] = tau[lane] + ki[lane] * (ki[lane] == 0 ? 0 : integral[lane]) + tau_bias[lane];
      // As available().
      const bool line = torque_speed_ && speed[lane] > 0 && effort[lane] < infinity;
      const double share = line ? v[lane] / speed[lane] : 0.0;
      const double full = line ? effort[lane] : 1.0;
      const bool limited = prescribed[lane] < 2;
      const double forward = full * (1 - std::min(std::max(share, 0.0), 1.0));
      const double backward = full * (1 - std::min(std::max(-share, 0.0), 1.0));
      upper[lane] = limited ? (line ? forward : effort[lane]) : infinity;
      lower[lane] = limited ? (line ? -backward : -effort[lane]) : -infinity;
    }
  }
  drive_.kp = command.kp;
  drive_.kd = command.kd;
  drive_.prescribed = command.prescribed;
}

void Actuators::follow_drive(const ActuatorCommand& command, double h, LaneMask active, BlockArray& tau) {
  bool on[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) on[lane] = active[lane];
  for (int k = 0; k < effort_.rows(); ++k) {
    const double *torque = result_.torque.row(k), *demand = result_.demand.row(k);
    const double *lower = drive_.lower.row(k), *upper = drive_.upper.row(k);
    const double *q_error = q_error_.row(k), *ki = command.ki.row(k);
    double *out = tau.row(k), *headroom = headroom_.row(k), *integral = integral_.row(k);
    for (int lane = 0; lane < kLanes; ++lane) {
      const double limit = demand[lane] < 0 ? -lower[lane] : upper[lane];
      const double room = limit - std::abs(demand[lane]);
      // As apply_lane().
      const bool grows = demand[lane] * q_error[lane] > 0;
      const double more = integral[lane] + (room >= 0 || !grows ? h * q_error[lane] : 0.0);
      const double next = ki[lane] == 0 ? 0.0 : more;
      out[lane] = on[lane] ? torque[lane] : out[lane];
      headroom[lane] = on[lane] ? room : headroom[lane];
      integral[lane] = on[lane] ? next : integral[lane];
    }
  }
}

void Actuators::step(const ActuatorCommand& command, BlockPhysics& physics, const Sensors& sensors, double h,
                     LaneMask active, BlockArray& tau) {
  if (!physics.solves_drives()) {
    apply(command, physics.state(), sensors, h, active, tau);
    physics.step(h, active, tau);
    return;
  }
  fill_drive(command, physics.state(), sensors);
  physics.drive(h, active, drive_, result_);
  follow_drive(command, h, active, tau);
}

void Actuators::apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                      LaneMask active, BlockArray& tau) {
  assert(!drives_solved_);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane]) apply_lane(command, state, sensors, h, lane, tau);
  }
}

}  // namespace graze
