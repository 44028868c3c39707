#include "engine/control/base_command.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/control/rows.h"
#include "engine/lanes/scalar.h"

namespace graze {

namespace {

constexpr int kForward = 0, kStrafe = 1, kTurn = 5;  // rows of a command

class ConstantVelocity : public Steering {
 public:
  explicit ConstantVelocity(const std::array<double, kCommandRows>& command) : command_(command) {}
  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }
  void steer(const Observation&, LaneMask active, BlockArray& command) override {
    for (int i = 0; i < kCommandRows; ++i) fill_lanes(command.row(i), command_[i], active);
  }

 private:
  std::array<double, kCommandRows> command_;
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
  void carry(int lane, LaneTape& tape) override { tape.carry(next_[lane]); }
  unsigned reads() const override { return kBasePlace | kBaseYaw; }

  void steer(const Observation& observation, LaneMask active, BlockArray& command) override {
    for (int i = 0; i < kCommandRows; ++i) fill_lanes(command.row(i), 0.0, active);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) steer_lane(observation, lane, command);
    }
  }

 private:
  void steer_lane(const Observation& observation, int lane, BlockArray& command) {
    std::size_t& next = next_[lane];
    const Eigen::Vector2d here(observation.base_position(0, lane), observation.base_position(1, lane));
    if (next < points_.size() && (points_[next] - here).norm() < tolerance_) {
      ++next;
      if (loop_) next %= points_.size();
    }
    if (next >= points_.size()) return;
    const Eigen::Vector2d way = points_[next] - here;
    const double turn = 2 * std::numbers::pi;
    double angle = pinned::atan2(way.y(), way.x()) - observation.base_rpy(2, lane);
    angle -= turn * std::round(angle / turn);
    const bool facing = std::abs(angle) < std::numbers::pi / 4;
    if (facing || holonomic_) command(kForward, lane) = forward_ * pinned::cos(angle);
    if (holonomic_) command(kStrafe, lane) = strafe_ * pinned::sin(angle);
    command(kTurn, lane) = facing ? std::clamp(angle, -turn_, turn_) : std::copysign(turn_, angle);
  }

  std::vector<Eigen::Vector2d> points_;         // m, world
  double tolerance_ = 0.1;                      // m
  double forward_ = 0, strafe_ = 0, turn_ = 0;  // largest speeds, m/s and rad/s
  bool holonomic_ = false, loop_ = false;
  std::array<std::size_t, kLanes> next_{};
};

std::array<double, kCommandRows> read_velocity(const Settings& settings) {
  const std::vector<double> values = settings.numbers(-1);
  std::array<double, kCommandRows> command{};
  if (values.size() == 3) {
    command[kForward] = values[0];
    command[kStrafe] = values[1];
    command[kTurn] = values[2];
  } else if (values.size() == kCommandRows) {
    std::copy(values.begin(), values.end(), command.begin());
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
