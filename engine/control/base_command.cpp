#include "engine/control/base_command.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/control/command_file.h"
#include "engine/control/rows.h"
#include "engine/lanes/scalar.h"

namespace graze {

namespace {

constexpr int kForward = 0, kStrafe = 1, kTurn = 5, kFirstTurn = 3;  // rows of a command

const Description& speed_description() {
  const Form speed = Form::number(Quantity::velocity, Bound::not_negative);
  static const Description text = {
      "the largest speeds",
      {{"forward", {speed}, Default::required(), "ahead"},
       {"strafe", {speed}, Default::value("0 m/s"), "to the side, of a holonomic base"},
       {"turn", {Form::number(Quantity::angular_velocity, Bound::not_negative)}, Default::required(), "either way"}}};
  return text;
}

const Description& waypoints_description() {
  static const Description text = {
      "points to go to one after the other, by the sensed pose of the base",
      {{"points", {Form::rows(2, Quantity::length)}, Default::required(), "`[[x, y], …]` in the world, at least one"},
       {"tolerance",
        {Form::number(Quantity::length, Bound::positive)},
        Default::value("10 cm"),
        "a point is reached when the base is nearer than this"},
       {"speed", {Form::map(speed_description())}, Default::required(), speed_description().help},
       {"steering",
        {Form::word({"driving", "holonomic", "car"})},
        Default::value("driving"),
        "turns on the spot; or while walking, and strafes; or goes forward at all times and turns by curves alone"},
       {"radius",
        {Form::number(Quantity::length, Bound::positive)},
        Default::words("what `speed` gives: forward / turn"),
        "of the narrowest curve of a `car`"},
       {"loop",
        {Form::flag()},
        Default::value("false"),
        "begin anew behind the last point, instead of stepping in place"}}};
  return text;
}

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

/// What a file says, to all lanes alike.
class RecordedCommands : public Steering {
 public:
  explicit RecordedCommands(std::vector<CommandRow> rows) : rows_(std::move(rows)) {}
  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }
  void steer(const Observation& observation, LaneMask active, BlockArray& command) override {
    for (int i = 0; i < kCommandRows; ++i) fill_lanes(command.row(i), 0.0, active);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const double now = observation.time[lane] + kCommandSlack;
      const auto after =
          std::partition_point(rows_.begin(), rows_.end(), [&](const CommandRow& row) { return row.time <= now; });
      if (after == rows_.begin()) continue;
      const CommandRow& row = *(after - 1);
      command(kForward, lane) = row.forward;
      command(kStrafe, lane) = row.strafe;
      command(kTurn, lane) = row.turn;
    }
  }

 private:
  std::vector<CommandRow> rows_;
};

/// Steers as the published code does: within 45 degrees of the waypoint's direction it walks toward it and turns by the
/// remaining angle per second; otherwise it turns at full speed, on the spot when it is driving. A car, whose front
/// axle steers (Figure 75), goes forward at all times along no narrower a curve than it can.
class Waypoints : public Steering {
 public:
  explicit Waypoints(const Settings& settings) {
    const Described own(settings, waypoints_description());
    const Settings list = own.at("points");
    for (const Settings& point : list.items()) {
      const std::vector<double> xy = point.numbers(2, Quantity::length);
      points_.emplace_back(xy[0], xy[1]);
    }
    if (points_.empty()) list.fail("has no points; at least one [x, y] must stand here");
    tolerance_ = own.number("tolerance");
    const Described speed(own.at("speed"), speed_description());
    forward_ = speed.number("forward");
    turn_ = speed.number("turn");
    strafe_ = speed.number("strafe");
    holonomic_ = own.word("steering") == "holonomic";
    if (own.word("steering") == "car") read_car(own);
    if (radius_ == 0 && own.has("radius"))
      own.at("radius").fail_key("is of steering: car; the others turn on the spot");
    loop_ = own.flag("loop");
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
  void read_car(const Described& own) {
    if (!(forward_ > 0)) own.at("speed").fail("a car that does not go forward comes to no point; forward must be > 0");
    if (own.has("radius")) {
      radius_ = own.number("radius");
    } else if (turn_ > 0) {
      radius_ = forward_ / turn_;
    } else {
      own.at("speed").fail("a car that does not turn comes to no point; turn must be > 0");
    }
    turn_ = std::min(turn_, forward_ / radius_);
  }

  /// Straight on while the point lies within the narrowest curve to its side, where no curve leads. One that is behind
  /// has to come out of it by half the tolerance, so that whatever the robot does on its way around does not put it
  /// inside again.
  double turn_of_car(double distance, double angle) const {
    const double forward = distance * pinned::cos(angle), aside = distance * std::abs(pinned::sin(angle));
    const double margin = forward > 0 ? tolerance_ : tolerance_ / 2;
    const bool within = pinned::hypot(forward, aside - radius_) < radius_ - margin;
    return within ? 0 : std::clamp(angle, -turn_, turn_);
  }

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
    if (radius_ > 0) {
      command(kForward, lane) = forward_;
      command(kTurn, lane) = turn_of_car(way.norm(), angle);
      return;
    }
    const bool facing = std::abs(angle) < std::numbers::pi / 4;
    if (facing || holonomic_) command(kForward, lane) = forward_ * pinned::cos(angle);
    if (holonomic_) command(kStrafe, lane) = strafe_ * pinned::sin(angle);
    command(kTurn, lane) = facing ? std::clamp(angle, -turn_, turn_) : std::copysign(turn_, angle);
  }

  std::vector<Eigen::Vector2d> points_;         // m, world
  double tolerance_ = 0;                        // m
  double forward_ = 0, strafe_ = 0, turn_ = 0;  // largest speeds, m/s and rad/s
  double radius_ = 0;                           // m, of the narrowest curve; 0: it is no car
  bool holonomic_ = false, loop_ = false;
  std::array<std::size_t, kLanes> next_{};
};

}  // namespace

std::array<double, kCommandRows> read_velocity(const Settings& settings) {
  const std::vector<Settings> items = settings.items();
  // A list in quotes has one unit for all, which none of these has: its numbers are bare.
  const std::vector<double> bare = settings.is_scalar() ? settings.numbers(-1) : std::vector<double>{};
  const std::size_t count = settings.is_scalar() ? bare.size() : items.size();
  static const std::vector<int> kPlanar = {kForward, kStrafe, kTurn}, kAll = {0, 1, 2, 3, 4, 5};
  if (count != kPlanar.size() && count != kAll.size()) {
    settings.fail("has " + std::to_string(count) +
                  " numbers; it must be [forward, strafe, turn] or [vx, vy, vz, wx, wy, wz] in m/s and rad/s");
  }
  std::array<double, kCommandRows> command{};
  const std::vector<int>& rows = count == kAll.size() ? kAll : kPlanar;
  for (std::size_t i = 0; i < count; ++i) {
    const Quantity quantity = rows[i] < kFirstTurn ? Quantity::velocity : Quantity::angular_velocity;
    command[rows[i]] = settings.is_scalar() ? bare[i] : items[i].number(quantity);
  }
  return command;
}

Key velocity_key() {
  return {"velocity",
          {Form::mixed_numbers(3, Quantity::velocity, Quantity::angular_velocity),
           Form::mixed_numbers(6, Quantity::velocity, Quantity::angular_velocity)},
          {},
          "`[forward, strafe, turn]` or `[vx, vy, vz, wx, wy, wz]`, m/s and rad/s, in the base's level frame; positive "
          "turn is to the left"};
}

Key waypoints_key() { return {"waypoints", {Form::map(waypoints_description())}, {}, waypoints_description().help}; }

Key commands_key() {
  return {"commands",
          {Form::text("FILE")},
          {},
          "CSV `time,forward,strafe,turn` in s, m/s and rad/s, as `graze drive --record` writes it; a row holds until "
          "the next"};
}

const std::vector<std::string>& steering_keys() {
  static const std::vector<std::string> names = {velocity_key().name, waypoints_key().name, commands_key().name};
  return names;
}

std::unique_ptr<Steering> read_steering(const Settings& gait, bool floating_base) {
  if (gait.has("commands")) return std::make_unique<RecordedCommands>(load_commands(gait.at("commands")));
  if (gait.has("velocity")) return std::make_unique<ConstantVelocity>(read_velocity(gait.at("velocity")));
  if (!floating_base) gait.at("waypoints").fail_key("a robot with a fixed base cannot go to waypoints");
  return std::make_unique<Waypoints>(gait.at("waypoints"));
}

}  // namespace graze
