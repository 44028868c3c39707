#include "engine/control/base_command.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace graze {

Vec3 PlanarPose::transform(const Vec3& p) const {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return {x + c * p.x() - s * p.y(), y + s * p.x() + c * p.y(), p.z()};
}

PlanarPose predict(const BaseCommand& command, double duration) {
  const double yaw = command.w.z() * duration;
  // Integral of R(w s) v over s: (sin yaw / yaw, (1 - cos yaw) / yaw) times the distance; series for small angles.
  const bool small = std::abs(yaw) < 1e-6;
  const double a = small ? 1 - yaw * yaw / 6 : std::sin(yaw) / yaw;
  const double b = small ? yaw / 2 : (1 - std::cos(yaw)) / yaw;
  const double dx = command.v.x() * duration, dy = command.v.y() * duration;
  return {a * dx - b * dy, b * dx + a * dy, yaw};
}

namespace {

class ConstantVelocity : public Steering {
 public:
  explicit ConstantVelocity(const BaseCommand& command) : command_(command) {}
  void start(int) override {}
  unsigned reads() const override { return 0; }
  BaseCommand command(const Observation&, int) override { return command_; }

 private:
  BaseCommand command_;
};

/// Steers as the published code does: within 45 degrees of the waypoint's direction it walks toward it and turns by the
/// remaining angle per second; otherwise it turns at full speed, on the spot when it drives like a car.
class Waypoints : public Steering {
 public:
  explicit Waypoints(const Settings& settings) {
    settings.allow({"points", "tolerance", "speed", "steering", "loop"});
    const Settings list = settings.at("points");
    for (const Settings& point : list.items()) {
      const std::vector<double> xy = point.numbers(2, Quantity::length);
      points_.emplace_back(xy[0], xy[1]);
    }
    if (points_.empty()) list.fail("has no points; at least one [x, y] must stand here");
    if (settings.has("tolerance")) tolerance_ = settings.at("tolerance").positive(Quantity::length);
    const Settings speed = settings.at("speed");
    speed.allow({"forward", "strafe", "turn"});
    forward_ = speed.at("forward").non_negative(Quantity::velocity);
    turn_ = speed.at("turn").non_negative(Quantity::angular_velocity);
    if (speed.has("strafe")) strafe_ = speed.at("strafe").non_negative(Quantity::velocity);
    if (settings.has("steering")) {
      holonomic_ = settings.at("steering").choice({"driving", "holonomic"}) == "holonomic";
    }
    loop_ = settings.flag_or("loop", false);
  }

  void start(int lane) override { next_[lane] = 0; }
  unsigned reads() const override { return kBasePosition | kBaseRpy; }

  BaseCommand command(const Observation& observation, int lane) override {
    std::size_t& next = next_[lane];
    const Eigen::Vector2d here(observation.base_position(0, lane), observation.base_position(1, lane));
    if (next < points_.size() && (points_[next] - here).norm() < tolerance_) {
      ++next;
      if (loop_) next %= points_.size();
    }
    if (next >= points_.size()) return {};
    const Eigen::Vector2d way = points_[next] - here;
    const double turn = 2 * std::numbers::pi;
    double angle = std::atan2(way.y(), way.x()) - observation.base_rpy(2, lane);
    angle -= turn * std::round(angle / turn);
    return steer(angle);
  }

 private:
  BaseCommand steer(double angle) const {
    const bool facing = std::abs(angle) < std::numbers::pi / 4;
    BaseCommand command;
    if (facing || holonomic_) command.v.x() = forward_ * std::cos(angle);
    if (holonomic_) command.v.y() = strafe_ * std::sin(angle);
    command.w.z() = facing ? std::clamp(angle, -turn_, turn_) : std::copysign(turn_, angle);
    return command;
  }

  std::vector<Eigen::Vector2d> points_;         // m, world
  double tolerance_ = 0.1;                      // m
  double forward_ = 0, strafe_ = 0, turn_ = 0;  // largest speeds, m/s and rad/s
  bool holonomic_ = false, loop_ = false;
  std::array<std::size_t, kLanes> next_{};
};

BaseCommand read_velocity(const Settings& settings) {
  const std::vector<double> values = settings.numbers(-1);
  BaseCommand command;
  if (values.size() == 3) {
    command.v = {values[0], values[1], 0};
    command.w.z() = values[2];
  } else if (values.size() == 6) {
    command.v = {values[0], values[1], values[2]};
    command.w = {values[3], values[4], values[5]};
  } else {
    settings.fail("has " + std::to_string(values.size()) +
                  " numbers; it must be [forward, strafe, turn] or [vx, vy, vz, wx, wy, wz] in m/s and rad/s");
  }
  return command;
}

}  // namespace

std::unique_ptr<Steering> read_steering(const Settings& gait, bool floating_base) {
  if (gait.has("velocity") == gait.has("waypoints")) {
    gait.fail("either `velocity` or `waypoints` must say where the base goes, and not both");
  }
  if (gait.has("velocity")) return std::make_unique<ConstantVelocity>(read_velocity(gait.at("velocity")));
  if (!floating_base) gait.at("waypoints").fail_key("a robot with a fixed base cannot go to waypoints");
  return std::make_unique<Waypoints>(gait.at("waypoints"));
}

}  // namespace graze
