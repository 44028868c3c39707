#include "engine/control/joint_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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
    if (matched) continue;
    const std::string near = nearest(pattern, names);
    value.fail_key("'" + pattern + "' matches no actuated joint" +
                   (near.empty() ? "" : "; did you mean " + near + "?"));
  }
}

}  // namespace

std::vector<double> read_joint_values(const Model& model, const Settings& settings, Quantity quantity,
                                      double fallback) {
  std::vector<double> values(model.na(), fallback);
  if (!settings.is_map()) {
    values.assign(values.size(), settings.number(quantity));
    return values;
  }
  for_each_match(model, settings, [&](std::size_t k, const Settings& value) { values[k] = value.number(quantity); });
  return values;
}

std::vector<double> read_joint_values_or(const Model& model, const Settings& settings, std::string_view key,
                                         Quantity quantity, double fallback) {
  const std::optional<Settings> found = settings.find(key);
  return found ? read_joint_values(model, *found, quantity, fallback) : std::vector<double>(model.na(), fallback);
}

void doubt_targets(const Model& model, int k, double low, double high, const Settings& settings) {
  const Body& body = model.bodies[model.actuated[k]];
  const double range = body.upper - body.lower, slack = 1e-3 + (std::isfinite(range) ? 0.1 * range : 0.0);
  if (low >= body.lower - slack && high <= body.upper + slack) return;
  const bool turns = body.type == JointType::revolute;
  const double far = std::max(high - body.upper, body.lower - low);
  warn(settings, fmt::format("targets of joint {} reach from {:g} to {:g}, and its limits are {:g} and {:g}{}",
                             body.joint, low, high, body.lower, body.upper,
                             far > (turns ? 2 * std::numbers::pi : 1.0)
                                 ? fmt::format("; are they meant in {}?", turns ? "deg" : "mm")
                                 : ""));
}

std::vector<double> read_gains(const Model& model, const Settings& settings, std::string_view key, Quantity quantity) {
  const std::vector<double> gains = read_joint_values_or(model, settings, key, quantity, 0.0);
  for (const double gain : gains) {
    if (gain < 0)
      settings.at(key).fail("a gain is negative; it must be >= 0, or the servo pushes away from its target");
  }
  return gains;
}

}  // namespace graze
