#pragma once
// A robot, its controller and its physics in a closed loop, as the runner drives them, and what its walk came to.

#include "engine/physics.h"
#include "tests/engine/control/support.h"

namespace graze {

class ClosedLoop {
 public:
  /// Control and physics both step by `step`, s.
  ClosedLoop(const Scene& scene, const std::string& policy_yaml, double step = 1e-3,
             const std::string& back_end = "bullet")
      : step_(step),
        physics_(make_physics(back_end, scene.model)),
        sensors_(scene.model, channel_names(scene.world.robot), SensorNoise{}),
        actuators_(scene.model, false, physics_->solves_drives()),
        controller_(scene.context(step), Settings::parse(policy_yaml, "policy.yaml")),
        command_(scene.model.na()),
        tau_(scene.model.na()) {}

  void start(int lane, const Particle& particle) {
    physics_->start(lane, particle);
    sensors_.start(lane, particle);
    actuators_.start(lane, particle);
    controller_.start(lane, particle.control_lag, particle.id);
    active_.set(lane);
    count_[lane] = 0;
    time_[lane] = 0;
    for (int k = 0; k < tau_.rows(); ++k) tau_(k, lane) = 0;
  }

  void stop(int lane) { active_.set(lane, false); }

  void advance() {
    sensors_.sense(*physics_, tau_, step_, count_, time_, active_, observation_);
    controller_.act(observation_, nullptr, active_, command_);
    actuators_.step(command_, *physics_, sensors_, step_, active_, tau_);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active_[lane]) time_[lane] = ++count_[lane] * step_;
    }
  }

  const BlockPhysics& physics() const { return *physics_; }
  const BlockState& state() const { return physics_->state(); }
  const Controller& controller() const { return controller_; }
  const ActuatorCommand& command() const { return command_; }
  const Observation& observation() const { return observation_; }
  const BlockArray& tau() const { return tau_; }
  double step() const { return step_; }
  double time(int lane = 0) const { return time_[lane]; }

 private:
  double step_;
  std::unique_ptr<BlockPhysics> physics_;
  Sensors sensors_;
  Actuators actuators_;
  Controller controller_;
  ActuatorCommand command_;
  BlockArray tau_;
  Observation observation_;
  LaneMask active_;
  std::array<std::uint32_t, kLanes> count_{};
  std::array<double, kLanes> time_{};
};

/// Means over a stretch of walking. Speeds are those of the base over ground: along and across its own heading.
struct Walk {
  double forward = 0, strafe = 0, turn = 0;  // m/s, m/s, rad/s
  double height = 0, tilt = 0;               // m, mean; rad, largest
  std::array<double, 4> stance{};            // share of the time that each foot carries
  double x = 0, y = 0, yaw = 0;              // m, m, rad over the stretch
  bool fault = false;
};

/// Walks lane 0 for `settle` seconds, then measures for `measure` seconds.
inline Walk walk(ClosedLoop& loop, const Scene& scene, double settle, double measure) {
  const std::array<int, 4> feet = {scene.model.frame("LF_FOOT"), scene.model.frame("RF_FOOT"),
                                   scene.model.frame("LH_FOOT"), scene.model.frame("RH_FOOT")};
  while (loop.time() < settle && !loop.physics().fault(0)) loop.advance();
  Walk out;
  const BlockState& state = loop.physics().state();
  const auto yaw = [&] { return rpy_from_rotation(state.rotation(0, 0)).z(); };
  const int steps = static_cast<int>(std::lround(measure / loop.step()));
  const Vec3 begin = state.position(0, 0);
  for (int k = 0; k < steps && !loop.physics().fault(0); ++k) {
    const double heading = yaw();
    const Vec3 before = state.position(0, 0);
    loop.advance();
    const Vec3 moved = state.position(0, 0) - before;
    out.forward += (std::cos(heading) * moved.x() + std::sin(heading) * moved.y()) / measure;
    out.strafe += (-std::sin(heading) * moved.x() + std::cos(heading) * moved.y()) / measure;
    out.yaw += std::remainder(yaw() - heading, 2 * M_PI);
    out.height += state.position(0, 0).z() / steps;
    out.tilt = std::max(out.tilt, std::acos(std::min(1.0, state.rotation(0, 0)(2, 2))));
    for (int i = 0; i < 4; ++i) out.stance[i] += (loop.observation().link_force(feet[i], 0) > 0) / double(steps);
  }
  out.turn = out.yaw / measure;
  out.x = state.position(0, 0).x() - begin.x();
  out.y = state.position(0, 0).y() - begin.y();
  out.fault = loop.physics().fault(0).has_value();
  return out;
}

}  // namespace graze
