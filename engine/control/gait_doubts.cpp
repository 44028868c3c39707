#include "engine/control/gait_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/control/base_command.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

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

/// A foot stands still while the base goes on, so from touchdown to liftoff it is moved by velocity * stance, which can
/// be no more than from one end of its leg's reach to the other.
void doubt_speed(const Settings& settings, double speed, const GaitSetup& gait) {
  const double reach = longest_reach(gait), stance = longest_stance(gait.parameters.timing);
  const auto fits = [&](double v) { return v * stance <= 2 * reach; };
  if (fits(speed)) return;
  const bool asks = speed >= 1 && (settings.is_list() || is_bare(settings));
  std::string meant;
  for (const auto& [unit, factor] : {std::pair{"cm/s", 0.01}, std::pair{"mm/s", 0.001}}) {
    if (asks && meant.empty() && fits(speed * factor)) {
      meant = fmt::format("; did you mean {:.6g}, which is {:g} {}?", speed * factor, speed, unit);
    }
  }
  warn(settings, fmt::format("{:g} m/s: while a foot stands, for {:.3g} s, the base would go {:.3g} m; its leg reaches "
                             "{:.3g} m{}",
                             speed, stance, speed * stance, reach, meant));
}

/// Half a turn while a foot stands: no joint turns that far.
void doubt_turn(const Settings& settings, double rate, const GaitSetup& gait) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double stance = longest_stance(gait.parameters.timing);
  const auto fits = [&](double w) { return w * stance <= std::numbers::pi; };
  if (fits(rate)) return;
  warn(settings, fmt::format("{:g} rad/s: while a foot stands, for {:.3g} s, the base would turn by {:.3g} deg{}", rate,
                             stance, rate * stance / kDegree,
                             rate >= 1 && (settings.is_list() || is_bare(settings)) && fits(rate * kDegree)
                                 ? fmt::format("; did you mean {:.6g}, which is {:g} deg/s?", rate * kDegree, rate)
                                 : ""));
}

void doubt_velocity(const Settings& settings, const GaitSetup& gait) {
  const std::array<double, kCommandRows> v = read_velocity(settings);
  doubt_speed(settings, std::hypot(v[0], v[1], v[2]), gait);
  doubt_turn(settings, std::hypot(v[3], v[4], v[5]), gait);
}

void doubt_waypoints(const Settings& speed, const GaitSetup& gait) {
  for (const char* key : {"forward", "strafe"}) {
    if (const auto value = speed.find(key)) doubt_speed(*value, value->number(Quantity::velocity), gait);
  }
  const Settings turn = speed.at("turn");
  doubt_turn(turn, turn.number(Quantity::angular_velocity), gait);
}

}  // namespace

void doubt_gait(const Settings& settings, const GaitSetup& gait) {
  doubt_step(settings.at("step_height"), gait);
  if (doubt_period(settings.at("duration"), gait.parameters.timing.period)) return;  // what follows, follows from it
  if (const auto velocity = settings.find("velocity")) doubt_velocity(*velocity, gait);
  if (const auto waypoints = settings.find("waypoints")) doubt_waypoints(waypoints->at("speed"), gait);
}

}  // namespace graze
