#include "engine/control/joint_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/settings/glob_alternatives.h"
#include "engine/settings/similar.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {

std::vector<std::string> actuated_names(const Model& model) {
  std::vector<std::string> names;
  for (const int body : model.actuated) names.push_back(model.bodies[body].joint);
  return names;
}

std::vector<double> actuated_positions(const Model& model, const State& state) {
  std::vector<double> q;
  for (const int body : model.actuated) q.push_back(state.q[model.bodies[body].q]);
  return q;
}

namespace {

/// Calls visit(joint, value's settings) for every joint that a map's globs match, in file order.
template <typename Visit>
void for_each_match(const Model& model, const Settings& settings, const Visit& visit) {
  const std::vector<std::string> names = actuated_names(model);
  for (const auto& [pattern, value] : settings.entries()) {
    bool matched = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!matches(pattern, names[k])) continue;
      visit(k, value);
      matched = true;
    }
    if (matched) {
      const std::string idle = idle_alternative_problem(pattern, names, "actuated joint");
      if (!idle.empty()) value.fail_key(idle);
      continue;
    }
    const int body = model.joint(pattern);
    if (body >= 0 && model.bodies[body].mimics >= 0) {
      value.fail_key(fmt::format("'{}' follows '{}' (<mimic> of the URDF) and has no drive of its own", pattern,
                                 model.bodies[model.bodies[body].mimics].joint));
    }
    value.fail_key("'" + pattern + "' matches no actuated joint" + similar_names(pattern, names, true));
  }
}

/// The quantity of a number of actuated joint k. Refuses a unit that fits joints of the other type alone.
Quantity quantity_of_joint(const Model& model, const Settings& value, int k, Quantity turning, Quantity sliding) {
  const Body& body = model.bodies[model.actuated[k]];
  const bool slides = body.type == JointType::prismatic;
  const Quantity own = slides ? sliding : turning, other = slides ? turning : sliding;
  const std::string text = value.is_scalar() ? value.text() : "";
  const auto written = split_number(text);  // looks into the text
  if (written && !to_si(own, 1, written->unit) && to_si(other, 1, written->unit)) {
    value.fail(fmt::format("{}: the unit '{}' does not fit joint {}, which {}; one of: {}", text, written->unit,
                           body.joint, slides ? "slides" : "turns", units_of(own)));
  }
  return own;
}

}  // namespace

Quantity quantity_of_joints(const Model& model, const Settings& value, const std::vector<int>& joints, Quantity turning,
                            Quantity sliding) {
  Quantity out = joints.empty() ? turning : sliding;
  for (const int k : joints) {
    if (quantity_of_joint(model, value, k, turning, sliding) == turning) out = turning;
  }
  return out;
}

std::vector<double> read_joint_values(const Model& model, const Settings& settings, Quantity quantity, double fallback,
                                      std::optional<Quantity> sliding) {
  std::vector<double> values(model.na(), fallback);
  if (!settings.is_map()) {
    std::vector<int> all(values.size());
    std::iota(all.begin(), all.end(), 0);
    const Quantity common = quantity_of_joints(model, settings, all, quantity, sliding.value_or(quantity));
    values.assign(values.size(), settings.number(common));
    return values;
  }
  for_each_match(model, settings, [&](std::size_t k, const Settings& value) {
    const int joint = static_cast<int>(k);
    values[k] = value.number(quantity_of_joint(model, value, joint, quantity, sliding.value_or(quantity)));
  });
  return values;
}

std::vector<double> read_joint_values_or(const Model& model, const Described& settings, std::string_view key,
                                         std::optional<Quantity> sliding) {
  const std::optional<Settings> found = settings.find(key);
  if (found) return read_joint_values(model, *found, settings.quantity(key), 0.0, sliding);
  return std::vector<double>(model.na(), settings.default_number(key));
}

Settings joint_entry(const Model& model, const Settings& settings, int k) {
  Settings out = settings;
  if (!settings.is_map()) return out;
  for (const auto& [pattern, value] : settings.entries()) {
    if (matches(pattern, model.bodies[model.actuated[k]].joint)) out = value;
  }
  return out;
}

namespace {

Quantity quantity_of(const JointRoom& room) { return room.turns ? Quantity::angle : Quantity::length; }

/// How far [low, high] goes beyond the limits: 0 up to what rounding makes of them.
double beyond(const JointRoom& room, double low, double high) {
  const double range = room.upper - room.lower, slack = 1e-3 + (std::isfinite(range) ? 0.01 * range : 0.0);
  const double far = std::max(high - room.upper, room.lower - low);
  return far > slack ? far : 0;
}

/// Excess that a forgotten unit explains rather than a wrong number, rad or m.
constexpr double kFar = 1;

std::string limits_text(const Settings& typed, const JointRoom& room) {
  return fmt::format("{} and {}", in_unit_of(typed, quantity_of(room), room.lower),
                     in_unit_of(typed, quantity_of(room), room.upper));
}

}  // namespace

void doubt_position(const Settings& typed, const JointRoom& room, double q) {
  const double far = beyond(room, q, q);
  if (far == 0) return;
  const auto fits = [&](double x) { return beyond(room, x, x) == 0; };
  std::string meant;
  if (far > kFar) {
    meant = is_bare(typed) && fits(-q) ? fmt::format("; did you mean {:g}?", -q)  // limits to one side of 0
                                       : unit_meant(typed, quantity_of(room), fits);
  }
  warn(typed,
       fmt::format("{}: the limits of joint {} are {}{}", typed.text(), room.name, limits_text(typed, room), meant));
}

void doubt_targets(const Model& model, int k, double low, double high, const Settings& typed) {
  const Body& body = model.bodies[model.actuated[k]];
  const JointRoom room{body.joint, body.lower, body.upper, body.type == JointType::revolute};
  const double far = beyond(room, low, high), factor = room.turns ? std::numbers::pi / 180 : 1e-3;
  if (far == 0) return;
  // A number with a unit is believed; a table's numbers have none.
  const std::string text = typed.text();
  const bool bare = is_bare(typed) || !split_number(text);
  const double middle = is_bare(typed) ? (low + high) / 2 : 0;  // which a unit of the amplitude leaves where it is
  const bool meant =
      far > kFar && bare && beyond(room, middle + factor * (low - middle), middle + factor * (high - middle)) == 0;
  const Quantity quantity = quantity_of(room);
  warn(typed, fmt::format("targets of joint {} reach from {} to {}, and its limits are {}{}", room.name,
                          in_unit_of(typed, quantity, low), in_unit_of(typed, quantity, high), limits_text(typed, room),
                          meant ? fmt::format("; are they meant in {}?", room.turns ? "deg" : "mm") : ""));
}

Key servo_spring() {
  return {"kp",
          {Form::joint_numbers(Quantity::rotational_stiffness, Bound::not_negative),
           Form::joint_numbers(Quantity::stiffness, Bound::not_negative)},
          Default::required(),
          "spring"};
}

Key servo_damper() {
  return {"kd",
          {Form::joint_numbers(Quantity::rotational_damping, Bound::not_negative),
           Form::joint_numbers(Quantity::damping, Bound::not_negative)},
          Default::value("0"),
          "damper"};
}

std::vector<double> read_gains(const Model& model, const Described& settings, std::string_view key,
                               std::optional<Quantity> sliding) {
  const std::vector<double> gains = read_joint_values_or(model, settings, key, sliding);
  for (int k = 0; k < model.na(); ++k) {
    if (gains[k] >= 0) continue;
    const Settings typed = joint_entry(model, settings.at(key), k);
    typed.fail(
        fmt::format("{}: a gain is negative, of joint {}; it must be >= 0, or the joint is pushed away from "
                    "its target",
                    typed.text(), model.bodies[model.actuated[k]].joint));
  }
  return gains;
}

void doubt_unnamed(const Model& model, const Settings& kp, const std::string& what) {
  if (!kp.is_map()) return;
  const std::vector<std::pair<std::string, Settings>> patterns = kp.entries();
  std::string list;
  int limp = 0;
  for (const std::string& joint : actuated_names(model)) {
    const auto names = [&](const auto& entry) { return matches(entry.first, joint); };
    if (std::any_of(patterns.begin(), patterns.end(), names)) continue;
    constexpr int kShown = 6;
    if (++limp <= kShown) list += (limp > 1 ? ", " : "") + joint;
    if (limp == kShown + 1) list += ", …";
  }
  if (limp == 0) return;
  warn(kp, fmt::format("names {} of {} joints; the others have kp 0 and {}: {} (if that is meant: \"*\": 0 in front)",
                       model.na() - limp, model.na(), what, list));
}

}  // namespace graze
