#include "engine/actuation/actuators.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/lane_physics/kernel.h"
#include "engine/lane_physics/lane_engine.h"

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

Actuators::Actuators(const Model& nominal, bool torque_speed, bool drives_solved, Isa isa)
    : kernel_(&kernel_of(isa, kLanes)),
      nominal_(nominal),
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

ActuatorRows Actuators::rows_of_step(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors,
                                     double h, LaneMask active, BlockArray& tau) {
  return {effort_.rows(),
          h,
          active.bits(),
          torque_speed_,
          q_index_.data(),
          v_index_.data(),
          state.q.row(0),
          state.v.row(0),
          command.tau.row(0),
          command.q.row(0),
          command.v.row(0),
          command.ki.row(0),
          command.prescribed.row(0),
          sensors.encoder_error().row(0),
          sensors.encoder_velocity_error().row(0),
          sensors.torque_error().row(0),
          effort_.row(0),
          speed_.row(0),
          integral_.row(0),
          q_error_.row(0),
          drive_.tau.row(0),
          drive_.q.row(0),
          drive_.v.row(0),
          drive_.lower.row(0),
          drive_.upper.row(0),
          result_.torque.row(0),
          result_.demand.row(0),
          tau.row(0),
          headroom_.row(0)};
}

void Actuators::step(const ActuatorCommand& command, BlockPhysics& physics, const Sensors& sensors, double h,
                     LaneMask active, BlockArray& tau) {
  if (!physics.solves_drives()) {
    apply(command, physics.state(), sensors, h, active, tau);
    physics.step(h, active, tau);
    return;
  }
  if (effort_.rows() == 0) return physics.drive(h, active, drive_, result_);
  const ActuatorRows rows = rows_of_step(command, physics.state(), sensors, h, active, tau);
  kernel_->fill_drive(rows);
  drive_.kp = command.kp;
  drive_.kd = command.kd;
  drive_.prescribed = command.prescribed;
  physics.drive(h, active, drive_, result_);
  kernel_->follow_drive(rows);
}

void Actuators::apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                      LaneMask active, BlockArray& tau) {
  assert(!drives_solved_);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane]) apply_lane(command, state, sensors, h, lane, tau);
  }
}

}  // namespace graze
