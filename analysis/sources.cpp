#include "analysis/sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "analysis/json_of.h"
#include "analysis/quantiles.h"
#include "analysis/text_table.h"

namespace graze {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

enum Source : std::size_t {
  kFabrication,
  kEnvironment,
  kContact,
  kInitialState,
  kActuation,
  kSensing,
  kStateEstimate,
  kLag,
  kDisturbances
};

/// Coefficients of contact, wherever they stand: on links, objects, or as defaults.
bool is_of_contact(const std::string& path) {
  const std::string last = path.substr(path.rfind('.') + 1);
  if (path.starts_with("contact.")) return true;
  if (path.starts_with("robot.link.")) return last == "friction" || last == "restitution";
  if (!path.starts_with("environment.")) return false;
  return last == "friction" || last == "restitution" || last == "stiffness" || last == "damping";
}

/// Root mean square of the numbers' distances from their mean; exactly 0 where all are the same.
double spread_of(const std::vector<double>& numbers) {
  if (numbers.size() < 2) return kUnknown;
  const auto n = static_cast<double>(numbers.size());
  double sum = 0, sum2 = 0;  // of what they are beyond the first
  for (const double x : numbers) sum += x - numbers.front();
  for (const double x : numbers) sum2 += std::pow(x - numbers.front() - sum / n, 2);
  return std::sqrt(sum2 / n);
}

/// The same of angles, about the direction of their mean.
double angle_spread(const std::vector<double>& angles) {
  if (angles.size() < 2) return kUnknown;
  double x = 0, y = 0;
  for (const double a : angles) x += std::cos(a - angles.front()), y += std::sin(a - angles.front());
  const double middle = angles.front() + std::atan2(y, x);
  double sum2 = 0;
  for (const double a : angles) sum2 += std::pow(std::remainder(a - middle, 2 * std::numbers::pi), 2);
  return std::sqrt(sum2 / static_cast<double>(angles.size()));
}

double yaw_of(const std::vector<double>& q, std::size_t base) {
  const double w = q[base], x = q[base + 1], y = q[base + 2], z = q[base + 3];
  return std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/// Of one number of q over the traces that lasted.
double spread_at(const std::vector<const SourceTrace*>& lasted, std::size_t i) {
  std::vector<double> numbers;
  for (const SourceTrace* one : lasted) numbers.push_back(one->q[i]);
  return spread_of(numbers);
}

void summarise_places(const std::vector<const SourceTrace*>& lasted, const SourceLayout& layout, SourceSpread& out) {
  out.place = out.heading = kUnknown;
  if (layout.base >= 0) {
    const auto base = static_cast<std::size_t>(layout.base);
    out.place = std::hypot(spread_at(lasted, base + 4), spread_at(lasted, base + 5), spread_at(lasted, base + 6));
    std::vector<double> yaws;
    for (const SourceTrace* one : lasted) yaws.push_back(yaw_of(one->q, base));
    out.heading = angle_spread(yaws);
  }
  double joints2 = 0;
  for (const int joint : layout.joints) joints2 += std::pow(spread_at(lasted, static_cast<std::size_t>(joint)), 2);
  out.joints = layout.joints.empty() ? kUnknown : std::sqrt(joints2 / static_cast<double>(layout.joints.size()));
}

std::string number(double x, double unit) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", x * unit); }

}  // namespace

const std::vector<std::string>& source_names() {
  static const std::vector<std::string> names = {"fabrication",    "environment", "contact",
                                                 "initial state",  "actuation",   "sensing",
                                                 "state estimate", "lag",         "disturbances"};
  return names;
}

const std::string& source_of(const std::string& path) {
  const auto is = [&](const char* start) { return path.starts_with(start); };
  const Source source = is_of_contact(path)      ? kContact
                        : is("robot.")           ? kFabrication
                        : is("initial.")         ? kInitialState
                        : is("actuator.")        ? kActuation
                        : is("sensor.estimate.") ? kStateEstimate
                        : is("sensor.")          ? kSensing
                        : is("control.lag")      ? kLag
                        : is("disturbances.")    ? kDisturbances
                                                 : kEnvironment;
  return source_names()[source];
}

bool is_uncertain(const UncertainParameter& parameter) {
  return (parameter.jitter && !parameter.jitter->is_constant()) || !parameter.persistent.is_constant();
}

ParameterSpace space_of_source(const ParameterSpace& all, const std::string& source) {
  if (source == "all") return all;
  ParameterSpace out;
  std::vector<int> place(all.parameters.size(), -1);  // of each parameter in `out`
  for (std::size_t i = 0; i < all.parameters.size(); ++i) {
    const UncertainParameter& one = all.parameters[i];
    if (is_uncertain(one) && source_of(one.name) != source) continue;
    place[i] = out.size();
    out.parameters.push_back(one);
  }
  for (const CorrelationGroup& group : all.groups) {
    std::vector<int> kept;  // rows of the matrix; a principal submatrix is a correlation matrix, too
    CorrelationGroup part;
    for (std::size_t row = 0; row < group.members.size(); ++row) {
      if (place[static_cast<std::size_t>(group.members[row])] < 0) continue;
      kept.push_back(static_cast<int>(row));
      part.members.push_back(place[static_cast<std::size_t>(group.members[row])]);
    }
    if (kept.size() < 2) continue;
    part.correlation = group.correlation(kept, kept);
    out.groups.push_back(std::move(part));
  }
  return out;
}

void summarise_source(const std::vector<SourceTrace>& traces, const SourceLayout& layout, SourceSpread& out) {
  std::vector<const SourceTrace*> lasted;
  std::vector<double> failures;
  out.outcomes = {};
  for (const SourceTrace& one : traces) {
    ++out.outcomes[static_cast<std::size_t>(one.outcome)];
    if (one.outcome == Outcome::invalid) continue;
    if (one.lasted) lasted.push_back(&one);
    if (!one.lasted) failures.push_back(one.end_time);
  }
  out.interval = clopper_pearson(out.outcomes[0], out.valid());
  out.lasted = lasted.size();
  out.failed = failures.size();
  summarise_places(lasted, layout, out);
  std::sort(failures.begin(), failures.end());
  constexpr std::array kQuartiles = {0.25, 0.5, 0.75};
  for (std::size_t i = 0; i < kQuartiles.size(); ++i) {
    out.failure_time[i] = failures.empty() ? kUnknown : quantile(failures, kQuartiles[i]);
  }
}

std::string format_sources(const std::string& scenario, std::uint64_t particles,
                           const std::vector<SourceSpread>& rows) {
  std::vector<std::vector<std::string>> table = {{"source", "policy", "scalars", "N", "S", "K", "U", "invalid", "rate",
                                                  "95 % interval", "lasted", "place mm", "heading deg", "joints mrad",
                                                  "ends early", "at s (quartiles)"}};
  const bool floating = std::any_of(rows.begin(), rows.end(), [](const auto& row) { return !std::isnan(row.place); });
  for (const SourceSpread& row : rows) {
    const double n = static_cast<double>(row.valid());
    const auto& [first, median, last] = row.failure_time;
    table.push_back(
        {row.source, row.policy, std::to_string(row.parameters), std::to_string(row.valid()),
         std::to_string(row.outcomes[0]), std::to_string(row.outcomes[1]), std::to_string(row.outcomes[2]),
         std::to_string(row.outcomes[3]), n > 0 ? fmt::format("{:.4f}", static_cast<double>(row.outcomes[0]) / n) : "-",
         fmt::format("{:.4f} .. {:.4f}", row.interval.low, row.interval.high), std::to_string(row.lasted),
         number(row.place, 1e3), number(row.heading, 180 / std::numbers::pi), number(row.joints, 1e3),
         std::to_string(row.failed), row.failed > 0 ? fmt::format("{:.3g} {:.3g} {:.3g}", first, median, last) : "-"});
  }
  if (!floating) {
    for (auto& row : table) row.erase(row.begin() + 11, row.begin() + 13);
  }
  return fmt::format(
      "{}: each source of uncertainty alone, {} particles\n\n{}\nThe others are at their nominal values. place, "
      "heading "
      "and joints: root mean square about the mean, of the\ntraces that lasted, at their end.\n",
      scenario, particles, text_table(table, 2));
}

std::string sources_json(const std::string& scenario, std::uint64_t particles, const std::vector<SourceSpread>& rows) {
  nlohmann::ordered_json out = {{"scenario", scenario}, {"particles", particles}};
  out["sources"] = json_list(rows, [](const SourceSpread& row) {
    return nlohmann::ordered_json{
        {"source", row.source},
        {"policy", row.policy},
        {"parameters", row.parameters},
        {"n", row.valid()},
        {"success", row.outcomes[0]},
        {"known_failure", row.outcomes[1]},
        {"unknown_failure", row.outcomes[2]},
        {"invalid", row.outcomes[3]},
        {"interval", json_of(row.interval)},
        {"lasted", row.lasted},
        {"place", json_of(row.place)},
        {"heading", json_of(row.heading)},
        {"joints", json_of(row.joints)},
        {"ends_early", row.failed},
        {"end_time_quartiles",
         nlohmann::ordered_json::array(
             {json_of(row.failure_time[0]), json_of(row.failure_time[1]), json_of(row.failure_time[2])})}};
  });
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace graze
