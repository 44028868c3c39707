#include "engine/control/gait_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/control/base_command.h"
#include "engine/control/command_file.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

double longest_reach(const GaitSetup& gait) {
  double out = 0;
  for (const Leg& leg : gait.legs) out = std::max(out, leg.reach);
  return out;
}

double longest_stance(const GaitTiming& timing) {
  return timing.period * *std::max_element(timing.duty, timing.duty + timing.feet);
}

void doubt_step(const Settings& settings, const GaitSetup& gait) {
  const double height = gait.parameters.step_height, reach = longest_reach(gait);
  if (height <= reach) return;
  warn(settings, fmt::format("{:g} m: is more than the {:.3g} m that a leg reaches{}", height, reach,
                             unit_meant(settings, Quantity::length, [&](double x) { return x <= reach; })));
}

/// True if it is strange.
bool doubt_period(const Settings& settings, double period) {
  constexpr double kLong = 30;  // s; what creeps on six legs takes a few
  if (period <= kLong || !is_bare(settings)) return false;
  warn(settings, fmt::format("{:g} s: is long for one cycle of a gait{}", period,
                             unit_meant(settings, Quantity::time, [&](double t) { return t <= kLong; })));
  return true;
}

/// What a foot that stands lets the base do.
class Stance {
 public:
  explicit Stance(const GaitSetup& gait) : reach_(longest_reach(gait)), time_(longest_stance(gait.parameters.timing)) {}

  /// A foot stands still while the base goes on, so from touchdown to liftoff it is moved by velocity * time, which can
  /// be no more than from one end of its leg's reach to the other.
  bool fits_speed(double v) const { return v * time_ <= 2 * reach_; }
  /// Half a turn while a foot stands: no joint turns that far.
  bool fits_turn(double w) const { return w * time_ <= std::numbers::pi; }

  std::string speed_told(double v) const {
    return fmt::format(
        "{:g} m/s: while a foot stands, for {:.3g} s, the base would go {:.3g} m; its leg reaches {:.3g} m", v, time_,
        v * time_, reach_);
  }
  std::string turn_told(double w) const {
    return fmt::format("{:g} rad/s: while a foot stands, for {:.3g} s, the base would turn by {:.3g} deg", w, time_,
                       w * time_ / kDegree);
  }

 private:
  double reach_, time_;  // m, s
};

void doubt_speed(const Settings& settings, double speed, const Stance& stance) {
  if (stance.fits_speed(speed)) return;
  const bool asks = speed >= 1 && (settings.is_list() || is_bare(settings));
  std::string meant;
  for (const auto& [unit, factor] : {std::pair{"cm/s", 0.01}, std::pair{"mm/s", 0.001}}) {
    if (asks && meant.empty() && stance.fits_speed(speed * factor)) {
      meant = fmt::format("; did you mean {:.6g}, which is {:g} {}?", speed * factor, speed, unit);
    }
  }
  warn(settings, stance.speed_told(speed) + meant);
}

void doubt_turn(const Settings& settings, double rate, const Stance& stance) {
  if (stance.fits_turn(rate)) return;
  const bool asks = rate >= 1 && (settings.is_list() || is_bare(settings)) && stance.fits_turn(rate * kDegree);
  warn(settings, stance.turn_told(rate) +
                     (asks ? fmt::format("; did you mean {:.6g}, which is {:g} deg/s?", rate * kDegree, rate) : ""));
}

void doubt_velocity(const Settings& settings, const Stance& stance) {
  const std::array<double, kCommandRows> v = read_velocity(settings);
  doubt_speed(settings, std::hypot(v[0], v[1], v[2]), stance);
  doubt_turn(settings, std::hypot(v[3], v[4], v[5]), stance);
}

void doubt_waypoints(const Settings& speed, const Stance& stance) {
  for (const char* key : {"forward", "strafe"}) {
    if (const auto value = speed.find(key)) doubt_speed(*value, value->number(Quantity::velocity), stance);
  }
  const Settings turn = speed.at("turn");
  doubt_turn(turn, turn.number(Quantity::angular_velocity), stance);
}

/// Tells the first row of the file that asks for too much.
void doubt_commands(const Settings& file, const Stance& stance) {
  for (const CommandRow& row : load_commands(file)) {
    const double speed = std::hypot(row.forward, row.strafe), turn = std::abs(row.turn);
    if (stance.fits_speed(speed) && stance.fits_turn(turn)) continue;
    const std::string told = stance.fits_speed(speed) ? stance.turn_told(turn) : stance.speed_told(speed);
    warn(file, fmt::format("{}:{}: {}", file.text(), row.line, told));
    return;
  }
}

}  // namespace

void doubt_gait(const Settings& settings, const GaitSetup& gait) {
  doubt_step(settings.at("step_height"), gait);
  if (doubt_period(settings.at("duration"), gait.parameters.timing.period)) return;  // what follows, follows from it
  const Stance stance(gait);
  if (const auto velocity = settings.find("velocity")) doubt_velocity(*velocity, stance);
  if (const auto waypoints = settings.find("waypoints")) doubt_waypoints(waypoints->at("speed"), stance);
  if (const auto commands = settings.find("commands")) doubt_commands(*commands, stance);
}

}  // namespace graze
