// Torque-speed planes of a redesign (Figure 45).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jobs/campaign/improvement_page.h"

namespace graze {
namespace {

/// What bounds a drive in the plane.
enum class LimitShape {
  line,       // effort (1 - |v| / velocity), in all four quadrants: a requirement says so
  motor,      // the same where torque and motion point the same way: the actuators are cut there
  rectangle,  // each by itself
};

LimitShape limit_shape(const Scenario& scenario, const DriveTrace& drive) {
  if (!std::isfinite(drive.effort) || !std::isfinite(drive.velocity)) return LimitShape::rectangle;
  for (const int k : scenario.redesign->limits) {
    if (scenario.task.requirements[static_cast<std::size_t>(k)].kind == "torque_speed") return LimitShape::line;
  }
  return scenario.torque_speed ? LimitShape::motor : LimitShape::rectangle;
}

/// How far a point lies within the torque limit.
double torque_room(const DriveTrace& drive, LimitShape shape, double speed, double torque) {
  const double along = shape == LimitShape::line    ? std::abs(speed)
                       : shape == LimitShape::motor ? std::max(0.0, torque < 0 ? -speed : speed)
                                                    : 0;
  return drive.effort * (along > 0 ? 1 - along / drive.velocity : 1) - std::abs(torque);
}

struct PlaneLine {
  std::vector<double> speed, torque;
};

/// `far`: a speed beyond all that are drawn, for limits that have no end.
PlaneLine limit_line(const DriveTrace& drive, LimitShape shape, double far, double far_torque) {
  const double v = drive.velocity, e = drive.effort;
  switch (shape) {
    case LimitShape::line:
      return {{-v, 0, v, 0, -v}, {0, e, 0, -e, 0}};
    case LimitShape::motor:
      return {{-far, 0, v, v, far, 0, -v, -v}, {e, e, 0, 0, -e, -e, 0, 0}};
    case LimitShape::rectangle:
      break;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PlaneLine out;
  if (std::isfinite(e)) out = {{-far, far, nan, -far, far, nan}, {e, e, nan, -e, -e, nan}};
  if (!std::isfinite(v)) return out;
  for (const double x : {v, v, nan, -v, -v}) out.speed.push_back(x);
  for (const double y : {far_torque, -far_torque, nan, far_torque, -far_torque}) out.torque.push_back(y);
  return out;
}

/// The line judges what the joint got, limits judge what was asked for.
PlaneLine judged_part(const DesignTrace& trace, std::size_t drive, const Window& judged, LimitShape shape) {
  const DriveTrace& one = trace.drives[drive];
  PlaneLine out;
  for (std::size_t i = 0; i < trace.time.size(); ++i) {
    if (!judged.contains(trace.time[i])) continue;
    out.speed.push_back(one.speed[i]);
    out.torque.push_back(shape == LimitShape::line ? one.torque[i] : one.asked[i]);
  }
  return out;
}

double largest(const std::vector<double>& values) {
  double out = 0;
  for (const double x : values) out = std::isfinite(x) ? std::max(out, std::abs(x)) : out;
  return out;
}

/// "outside by 0.52 N m"; "inside, 0.02 N m to spare"; "inside, 0.02 N m to spare, but too fast by 3 rad/s".
std::string room_words(const DriveTrace& drive, LimitShape shape, const PlaneLine& path) {
  if (path.speed.empty()) return "has nothing to judge";
  double least = std::numeric_limits<double>::infinity(), slow = least;
  for (std::size_t i = 0; i < path.speed.size(); ++i) {
    least = std::min(least, torque_room(drive, shape, path.speed[i], path.torque[i]));
    slow = std::min(slow, drive.velocity - std::abs(path.speed[i]));
  }
  const char* const torque = drive.slides ? "N" : "N m";
  const char* const speed = drive.slides ? "m/s" : "rad/s";
  std::string out = !std::isfinite(least) ? "has no torque limit"
                    : least < 0           ? fmt::format("outside by {:.3g} {}", -least, torque)
                                          : fmt::format("inside, {:.3g} {} to spare", least, torque);
  if (shape == LimitShape::line || !(slow < 0)) return out;
  return fmt::format("{}{} too fast by {:.3g} {}", out, least < 0 ? " and" : ", but", -slow, speed);
}

Json plane_line(const char* name, const char* color, const PlaneLine& line, NumberForm form) {
  return {{"name", name}, {"color", color}, {"x", numbers(line.speed, form)}, {"y", numbers(line.torque, form)}};
}

}  // namespace

Window window_of_motors(const Scenario& scenario) {
  Window out{std::numeric_limits<double>::infinity(), 0};
  for (const int k : scenario.redesign->limits) {
    const Requirement& one = scenario.task.requirements[static_cast<std::size_t>(k)];
    if (one.kind != "torque_speed" && one.kind != "torque_limits") continue;
    out.from = std::min(out.from, one.window.from), out.to = std::max(out.to, one.window.to);
  }
  return out.from <= out.to ? out : Window{};
}

Json torque_speed_plot(const Redesign& redesign, std::size_t drive, const Window& judged, NumberForm form) {
  const DriveTrace& before = redesign.traces.before.drives[drive];
  const DriveTrace& after = redesign.traces.improved.drives[drive];
  const LimitShape shape = limit_shape(redesign.scenario, before);
  const PlaneLine first = judged_part(redesign.traces.before, drive, judged, shape);
  const PlaneLine last = judged_part(redesign.traces.improved, drive, judged, shape);
  const auto reach = [](double path, double a, double b) {  // of an axis: all of the path, and the limits
    for (const double limit : {a, b}) path = std::isfinite(limit) ? std::max(path, limit) : path;
    return path > 0 ? 1.08 * path : 1;
  };
  const double speed = reach(std::max(largest(first.speed), largest(last.speed)), before.velocity, after.velocity);
  const double torque = reach(std::max(largest(first.torque), largest(last.torque)), before.effort, after.effort);
  const std::string speed_unit = before.slides ? "m/s" : "rad/s", torque_unit = before.slides ? "N" : "N m";
  Json lines = Json::array({plane_line("Limit", "ink", limit_line(before, shape, speed, torque), form)});
  lines.front()["dash"] = true;
  if (after.effort != before.effort || after.velocity != before.velocity) {
    lines.front()["name"] = "Limit, first robot";
    lines.push_back(plane_line("Limit, improved", "ink", limit_line(after, shape, speed, torque), form));
  }
  lines.push_back(plane_line("First robot", "known", first, form));
  lines.push_back(plane_line("Improved", "success", last, form));
  return {
      {"type", "lines"},
      {"title", before.joint},
      {"note", fmt::format("First {}; improved {}.", room_words(before, shape, first), room_words(after, shape, last))},
      {"legend", false},
      {"height", 250},
      {"x", {{"title", "Speed"}, {"unit", speed_unit}, {"domain", {-speed, speed}}}},
      {"y", {{"title", before.slides ? "Force" : "Torque"}, {"unit", torque_unit}, {"domain", {-torque, torque}}}},
      {"lines", lines}};
}

}  // namespace graze
