#include "scenarios/doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "engine/model/measures.h"
#include "engine/model/mesh_size.h"
#include "engine/model/newton_limit.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Widths beyond which a bare number was hardly meant: of a normal distribution its std, of a uniform one half its
/// width. None: infinite.
struct WidestMeant {
  double std = std::numeric_limits<double>::infinity(), half = std::numeric_limits<double>::infinity();
};

bool begins(const std::string& text, std::string_view head) { return text.compare(0, head.size(), head) == 0; }

WidestMeant widest_meant(const Parameter& parameter, const Vec3& extent, double distance) {
  const std::string& path = parameter.path;
  if (parameter.quantity == Quantity::angle) {
    // An encoder or a joint's zero that is off by a radian tells nothing. A robot may begin in any attitude, which is
    // uniform; a normal error of more than a right angle is no error of a nominal one.
    constexpr double kError = 0.5;  // rad
    const bool error = begins(path, "sensor.encoder.") || path.ends_with(".zero");
    if (error) return {kError, kError};
    return {std::numbers::pi / 2, std::numbers::pi * (1 + 1e-6)};
  }
  const double size = extent.norm();
  if (parameter.quantity != Quantity::length || !(size > 0)) return {};
  if (begins(path, "robot.link.") && path.find(".com.") != std::string::npos) return {size / 4, size / 4};
  // A normal error of the place where a robot is put is small against the robot; a uniform one may be a whole field.
  if (begins(path, "initial.base.")) return {size, 5 * size};
  // What is put in a robot's way is put there on purpose; what lies far off may be known less well.
  if (begins(path, "environment.") && path.find(".position.") != std::string::npos) {
    return {2 * size + distance, std::numeric_limits<double>::infinity()};
  }
  return {};
}

/// A bare number of SI value `width`. Beyond a turn or 100 m the number has been doubted where it was read.
void doubt_number(const Settings& value, double width, double widest, bool angle, double size) {
  if (!(width > widest) || width > (angle ? 2 * std::numbers::pi : 100) || !is_bare(value)) return;
  if (angle) {
    warn(value,
         fmt::format("{0:g} rad: is a spread of {1:.3g} deg{2} (if not, write {0:g} rad)", width, width / kDegree,
                     unit_meant(value, Quantity::angle, [&](double x) { return std::abs(x) <= widest; })));
    return;
  }
  warn(value,
       fmt::format("{0:g} m: is a spread of {1:.3g} times the robot's size of {2:.3g} m{3} (if not, write {0:g} m)",
                   width, width / size, size,
                   unit_meant(value, Quantity::length, [&](double x) { return std::abs(x) <= widest; })));
}

/// One distribution, `{normal: …}` or `{uniform: …}`; others have no such width.
void doubt_distribution(const Settings& map, const Parameter& parameter, const Vec3& extent, double distance) {
  const WidestMeant widest = widest_meant(parameter, extent, distance);
  const bool angle = parameter.quantity == Quantity::angle;
  if (const auto normal = map.find("normal")) {
    const Settings std = normal->at("std");
    if (is_bare(std)) doubt_number(std, std.number(parameter.quantity), widest.std, angle, extent.norm());
  }
  const auto uniform = map.find("uniform");
  if (!uniform) return;
  if (uniform->is_map() && uniform->has("spread")) {
    const Settings spread = uniform->at("spread");
    if (is_bare(spread)) doubt_number(spread, spread.number(parameter.quantity), widest.half, angle, extent.norm());
    return;
  }
  const std::vector<Settings> ends =
      uniform->is_map() ? std::vector<Settings>{uniform->at("min"), uniform->at("max")} : uniform->items();
  if (ends.size() != 2 || !is_bare(ends[0]) || !is_bare(ends[1])) return;
  const double half = (ends[1].number(parameter.quantity) - ends[0].number(parameter.quantity)) / 2;
  doubt_number(ends[1], half, widest.half, angle, extent.norm());
}

/// Whether a shape's size has no unit: `5`, `[1, 2, 3]` or `{radius: 1, length: 2}`; a unit may stand last in a list.
bool is_bare_size(const Settings& shape) {
  if (shape.is_scalar()) return is_bare(shape);
  std::vector<Settings> numbers = shape.items();
  if (shape.is_map()) {
    numbers.clear();
    for (const auto& [key, value] : shape.entries()) numbers.push_back(value);
  }
  return std::any_of(numbers.begin(), numbers.end(), is_bare) && (shape.is_map() || is_bare(numbers.back()));
}

/// A list of which every number is bare; a unit may stand last.
bool is_bare_list(const Settings& list) {
  const std::vector<Settings> items = list.items();
  return list.is_list() && std::all_of(items.begin(), items.end(), is_bare);
}

/// How far a mesh's parts lie from its origin at most, along an axis, m.
double reach_of(const Object& object) {
  double most = largest_coordinate(object.shape);
  for (const Shape& part : object.more) most = std::max(most, largest_coordinate(part));
  return most;
}

/// The z of the highest point of a fixed object, or a little more; -inf for a wall.
double top_of(const Object& object) {
  const Shape& shape = object.shape;
  const double z = object.X_WO.translation().z();
  const Vec3 up = object.X_WO.linear().row(2).transpose();  // the world's z axis as the object sees it
  switch (shape.kind) {
    case ShapeKind::plane:
      return up.z() > 0.5 ? z : -std::numeric_limits<double>::infinity();
    case ShapeKind::box:
      return z + 0.5 * up.cwiseAbs().dot(shape.size);
    case ShapeKind::mesh:
      return z + std::sqrt(3.0) * reach_of(object);
    case ShapeKind::heightfield:
      return z + shape.size.z() * *std::max_element(shape.grid->height.begin(), shape.grid->height.end());
    default:
      return z + shape.size.x() + 0.5 * shape.size.y();
  }
}

/// About the largest extent of a movable object, m.
double size_of(const Object& object) {
  const Shape& shape = object.shape;
  if (shape.kind == ShapeKind::mesh) return 2 * reach_of(object);
  return shape.kind == ShapeKind::box ? shape.size.norm() : 2 * shape.size.x() + shape.size.y();
}

/// The z at which a robot's base was put by a bare number, if it was.
std::optional<Settings> bare_height(const Settings& scenario) {
  const auto initial = scenario.at("robot").find("initial");
  if (!initial) return std::nullopt;
  const auto height = initial->find("height"), position = initial->find("position");
  if (height && is_bare(*height)) return height;
  if (!height && position && is_bare_list(*position)) return position->items()[2];
  return std::nullopt;
}

/// The largest bare number of a distribution, which its unit was forgotten of.
std::optional<std::string> largest_bare(const Settings& value) {
  if (is_bare(value)) return value.text();
  if (value.is_scalar() || value.is_null()) return std::nullopt;
  std::vector<Settings> parts;
  if (value.is_map()) {
    for (const auto& [key, part] : value.entries()) {
      if (key != "jitter" && key != "weights" && key != "log_std") parts.push_back(part);
    }
  } else {
    parts = value.items();
  }
  std::optional<std::string> most;
  for (const Settings& part : parts) {
    const auto one = largest_bare(part);
    if (one && (!most || split_number(*one)->value > split_number(*most)->value)) most = one;
  }
  return most;
}

/// "; is its size meant in cm?": the first unit in which a volume `fits`, which is asked with m^3.
std::string size_meant(double volume, const std::function<bool(double)>& fits) {
  for (const auto& [unit, factor] : {std::pair{"cm", 1e-2}, std::pair{"mm", 1e-3}}) {
    if (fits(volume * std::pow(factor, 3))) return fmt::format("; is its size meant in {}?", unit);
  }
  return "";
}

}  // namespace

void doubt_clearance(const Settings& scenario, const Vec3& extent) {
  const auto initial = scenario.at("robot").find("initial");
  const auto clearance = initial ? initial->find("clearance") : std::nullopt;
  if (!clearance || !is_bare(*clearance)) return;
  const double size = extent.maxCoeff(), height = clearance->number(Quantity::length);
  const auto fits = [&](double x) { return x <= 2 * size; };
  const std::string meant = unit_meant(*clearance, Quantity::length, fits);
  if (!(size > 0) || fits(height) || meant.empty()) return;
  warn(*clearance,
       fmt::format("{0:g} m: a fall from {1:.3g} times the robot's size of {2:.3g} m{3} (if not, write {0:g} "
                   "m)",
                   height, height / size, size, meant));
}

void doubt_support(const Settings& scenario, const World& world) {
  if (!world.robot.floating_base || world.objects.empty() || world.gravity.norm() == 0) return;
  const auto has_shape = [](const Link& link) { return !link.collisions.empty(); };
  if (std::any_of(world.robot.links.begin(), world.robot.links.end(), has_shape)) return;
  warn(
      scenario.at("robot"),
      "none of its links has a collision shape, so that it touches nothing and falls for ever; <collision> in the URDF "
      "makes contacts");
}

void doubt_places(const Settings& scenario, const World& world, const Model& model, const State& initial) {
  const double size = robot_extent(model, initial).norm();
  if (!(size > 0)) return;
  const Vec3 base = world.initial.position;
  constexpr double kHigh = 20, kFar = 40;  // sizes of a robot
  double top = -std::numeric_limits<double>::infinity();
  for (const Object& object : world.objects) {
    if (!object.movable) top = std::max(top, top_of(object));
  }
  const auto height = bare_height(scenario);
  if (height && std::isfinite(top) && base.z() - top > kHigh * size) {
    const std::string meant = unit_meant(*height, Quantity::length, [&](double z) { return z - top <= kHigh * size; });
    warn(*height,
         fmt::format("{0:g} m: is {1:.3g} m above all that the robot could stand on, {2:.3g} times its size of "
                     "{3:.3g} m{4} (if not, write {0:g} m)",
                     base.z(), base.z() - top, (base.z() - top) / size, size, meant));
  }
  if (height && base.z() - top > kHigh * size) return;
  for (const Object& object : world.objects) {
    const Vec3 place = object.X_WO.translation();
    const double far = (place - base).norm(), most = kFar * (size + size_of(object));
    if (!object.movable || far <= most) continue;
    const auto position = scenario.at("environment").at(object.name).find("position");
    if (!position || !is_bare_list(*position)) continue;
    for (const auto& [unit, factor] : {std::pair{"cm", 1e-2}, std::pair{"mm", 1e-3}}) {
      if ((factor * place - base).norm() > most) continue;
      warn(*position,
           fmt::format("is {:.3g} m from the robot, {:.3g} times its size of {:.3g} m; is it meant in {}? (if "
                       "not, write m behind the numbers)",
                       far, far / size, size, unit));
      break;
    }
  }
}

void doubt_waits(const Settings& policy, double end) {
  const auto doubt = [&](const std::optional<Settings>& map, const char* key, const char* what) {
    const auto wait = map && map->is_map() ? map->find(key) : std::nullopt;
    if (!wait || !wait->is_scalar()) return;
    const double seconds = wait->number(Quantity::time);
    if (seconds < end) return;
    const auto fits = [&](double t) { return t < end; };
    warn(*wait, fmt::format("{:g} s, and no trace is longer than {:g} s: {}{}", seconds, end, what,
                            unit_meant(*wait, Quantity::time, fits)));
  };
  doubt(policy.find("gait"), "settle", "no foot is ever lifted");
  const auto control = policy.find("control");
  if (!control || !control->is_map()) return;
  for (const auto& [name, tracker] : control->entries()) {
    if (tracker.is_map()) doubt(tracker.find("contacts"), "delay", "nothing that is sensed of contacts ever arrives");
  }
}

void doubt_lag(const Settings& scenario, const std::optional<Settings>& written, double typical, double end) {
  if (typical < end) return;
  const auto bare = written ? largest_bare(*written) : std::nullopt;
  const std::string meant = bare && typical / 1000 < end ? fmt::format("; did you mean {} ms?", *bare) : std::string();
  const std::string text = fmt::format(
      "{:g} s, and no trace is longer than {:g} s: no command of a policy ever arrives{}", typical, end, meant);
  warn(written.value_or(scenario), written ? text : "control.lag: " + text);
}

void doubt_task(const Settings& scenario, const Task& task) {
  const bool judges = std::any_of(task.requirements.begin(), task.requirements.end(),
                                  [](const Requirement& one) { return !one.measure; });
  if (judges || task.objective.witness || !task.objective.parts.empty()) return;
  const auto place = scenario.find("task");
  warn(place.value_or(scenario), fmt::format("{}no requirement and no objective: every trace that reaches its end is a "
                                             "success",
                                             place ? "" : "the key 'task' is missing, so there is "));
}

void doubt_gravity(const Settings& scenario) {
  const auto gravity = scenario.find("gravity");
  if (!gravity || !gravity->is_list()) return;
  const std::vector<double> g = gravity->numbers(3, Quantity::acceleration);
  if (g[2] > 0) {
    warn(*gravity, fmt::format("points upward: things fall up; did you mean [{:g}, {:g}, {:g}]?", g[0], g[1], -g[2]));
  }
}

void doubt_last(const Settings& scenario, const Timing& timing) {
  const auto record = scenario.find("record");
  const auto last = record ? record->find("last") : std::nullopt;
  if (!last) return;
  const double seconds = last->number(Quantity::time);
  const auto fits = [&](double t) { return t >= timing.step && t <= timing.end; };
  if (seconds <= 2 * timing.end || record->text_or("telemetry", "none") != "last") return;
  warn(*last,
       fmt::format("{:g} s: no trace is longer than {:g} s, so all of it is kept, as 'telemetry: failures' does{}",
                   seconds, timing.end, unit_meant(*last, Quantity::time, fits)));
}

void doubt_width(const Settings& value, const Parameter& parameter, const Vec3& extent, double distance) {
  if (!value.is_map()) return;
  doubt_distribution(value, parameter, extent, distance);
  if (const auto jitter = value.find("jitter")) doubt_distribution(*jitter, parameter, extent, distance);
}

void doubt_cone(const Settings& std) {
  constexpr double kWidest = 0.5;  // rad, of an axis that someone has drilled
  if (is_bare(std)) doubt_number(std, std.number(Quantity::angle), kWidest, true, 0);
}

void doubt_mass(const Settings& mass, const Settings& shape, double kilograms, double volume) {
  constexpr double kAir = 1.2, kOsmium = 23000;  // kg/m^3
  const auto fits = [&](double density) { return density >= kAir && density <= kOsmium; };
  const double density = kilograms / volume;
  if (fits(density)) return;
  std::string meant;
  if (density < kAir) {
    meant = size_meant(volume, [&](double v) { return fits(kilograms / v); });
    warn(shape, fmt::format("{:g} kg in {:.3g} m^3 are lighter than air{}", kilograms, volume, meant));
  } else {
    meant = unit_meant(mass, Quantity::mass, [&](double m) { return fits(m / volume); });
    warn(mass, fmt::format("{:g} kg in {:.3g} m^3 are denser than any metal{}", kilograms, volume, meant));
  }
}

void doubt_weight(const Settings& shape, double density, double volume, double robot) {
  const double kilograms = density * volume;
  if (!(robot > 0 && kilograms > kHeaviest * robot) || !is_bare_size(shape)) return;
  warn(shape, fmt::format("{:.3g} m^3 of {:g} kg/m^3 weigh {:.3g} kg, {:.3g} times the robot's {:g} kg{}", volume,
                          density, kilograms, kilograms / robot, robot,
                          size_meant(volume, [&](double v) { return density * v <= kHeaviest * robot; })));
}

bool is_welded_mass(const std::string& path, const Model& nominal) {
  constexpr std::string_view kLink = "robot.link.";
  if (!path.starts_with(kLink)) return false;
  for (const char* what : {".mass", ".density", ".com.x", ".com.y", ".com.z"}) {
    if (!path.ends_with(what)) continue;
    const int frame =
        nominal.frame(path.substr(kLink.size(), path.size() - kLink.size() - std::string_view(what).size()));
    return frame >= 0 && nominal.frames[frame].body < 0;
  }
  return false;
}

void doubt_welded(const Settings& scenario, const ParameterTable& table, const Model& nominal) {
  const auto uncertain = scenario.find("uncertain");
  if (!uncertain) return;
  for (const auto& [pattern, value] : uncertain->entries()) {
    if (pattern == "correlated") continue;
    const std::vector<int> found = table.match(pattern);
    const auto idle = [&](int i) { return is_welded_mass(table.all()[i].path, nominal); };
    if (found.empty() || !std::all_of(found.begin(), found.end(), idle)) continue;
    warn(value, "a link that is welded to the world never moves, so how its mass is spread changes nothing");
  }
}

void doubt_solver(const Settings& scenario, const Model& nominal, const std::string& physics) {
  const auto contact = scenario.find("contact"), solver = contact ? contact->find("solver") : std::nullopt;
  if (!solver || physics != "lanes" || nominal.contact_solver != ContactSolver::newton) return;
  if (static_cast<std::size_t>(nominal.nv) <= kMostNewtonDofs || is_deep_tree(nominal)) return;
  warn(*solver,
       fmt::format("newton is for models of up to {} degrees of freedom, and this one has {}: its contacts are "
                   "solved by sweeps alone, as with 'sweeps'",
                   kMostNewtonDofs, nominal.nv));
}

std::string length_meant(const Settings& range, double margin, double size, double reach) {
  if (-margin <= 2 * size + reach) return "";
  for (const char* side : {"above", "below"}) {
    const auto bound = range.find(side);
    if (!bound || !is_bare(*bound)) continue;
    const double sign = side[0] == 'a' ? 1 : -1, place = bound->number(Quantity::length) + sign * margin;
    // The other bound may be the one that is missed: then no link is near this one's place.
    const std::string meant =
        unit_meant(*bound, Quantity::length, [&](double x) { return std::abs(x - place) <= size + reach; });
    if (!meant.empty()) return meant;
  }
  return "";
}

void doubt_impulse(const Settings& settings, const Model& nominal, double end) {
  const Settings below = settings.at("below");
  const auto during = settings.find("during");
  double longest = end;
  if (during) {
    const double seconds = during->number(Quantity::time);
    longest = std::min(end, seconds);
    if (seconds >= end) {
      warn(*during, fmt::format("{:g} s: no trace is longer than {:g} s, so it limits nothing{}", seconds, end,
                                unit_meant(*during, Quantity::time, [&](double t) { return t < end; })));
    }
  }
  double mass = 0;
  for (const Body& body : nominal.bodies) mass += body.mass;
  // Everything that moves, stopped from 10 m/s and pressed on with ten times its weight: no blow has more.
  const double most = mass * (10 + 10 * nominal.gravity.norm() * longest), limit = below.number(Quantity::impulse);
  const std::string meant = unit_meant(below, Quantity::impulse, [&](double x) { return x <= most; });
  if (limit <= most || meant.empty()) return;
  warn(below, fmt::format("{:g} N s: would stop all that moves, {:.3g} kg, from {:.3g} m/s{}", limit, mass,
                          limit / mass, meant));
}

}  // namespace graze
