#include "scenarios/spread.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "engine/settings/merged.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "sampling/elementary.h"
#include "scenarios/csv.h"
#include "scenarios/keys.h"

namespace graze {
namespace {

/// Reads the parts of one distribution of one parameter.
class SpreadReader {
 public:
  /// `center`: default mean: the nominal value, or 0 for jitter. `whole`: what "5 %" is of.
  SpreadReader(const Parameter& parameter, double center, double whole, Standing standing)
      : parameter_(parameter), center_(center), whole_(whole), standing_(standing) {}

  Distribution read(const std::string& name, const Settings& value) const {
    try {
      if (name == "normal") return normal(value);
      if (name == "uniform") return uniform(value);
      if (name == "log_normal") return log_normal(value);
      if (name == "log_uniform") return log_uniform(value);
      if (name == "triangular") return triangular(value);
      return empirical(value);
    } catch (const std::invalid_argument& e) {
      value.fail(e.what());
    }
  }

 private:
  double number(const Settings& value) const { return value.number(parameter_.quantity); }

  double number_or(const Settings& map, const char* key, double fallback) const {
    const auto value = map.find(key);
    return value ? number(*value) : fallback;
  }

  /// The number of `key`, or the center, which a limit that the URDF does not give has not.
  double number_or_center(const Settings& map, const char* key) const {
    const auto value = map.find(key);
    if (value) return number(*value);
    if (!std::isfinite(center_)) map.fail(fmt::format("{}; write '{}'", unlimited(), key));
    return center_;
  }

  std::string unlimited() const {
    return fmt::format("the nominal value of {} is unlimited: the URDF gives no limit", parameter_.path);
  }

  /// A spread: absolute, or "5 %" of `whole`. `own`: what gives a distribution that stands as_nominal a whole.
  double width(const Settings& value, double whole, const char* own) const {
    const std::string text = value.text();
    if (text.find('%') == std::string::npos) return number(value);
    const std::string_view unit = unit_of(parameter_.quantity);
    const std::string absolute = unit == "1" ? "without %" : fmt::format("with a unit ({})", unit);
    if (!std::isfinite(whole)) value.fail(fmt::format("{}: {}; write it {}", text, unlimited(), absolute));
    if (whole == 0) {
      if (standing_ == Standing::as_nominal) {
        value.fail(fmt::format("{}: of nothing: {} has no value yet; {}", text, parameter_.path, own));
      }
      value.fail(fmt::format("{}: the nominal value of {} is 0, so a spread relative to it is nothing; write it {}",
                             text, parameter_.path, absolute));
    }
    return value.number() * std::abs(whole);
  }

  Distribution normal(const Settings& value) const {
    value.allow(keys_of("normal"));
    const double mean = number_or_center(value, "mean");
    const bool own = standing_ == Standing::as_nominal && value.has("mean");
    const double std = width(value.at("std"), own ? mean : whole_, "give it a 'mean'");
    if (std < 0) value.at("std").fail(fmt::format("{}: a standard deviation must be >= 0", value.at("std").text()));
    if (!value.has("min") && !value.has("max")) return Distribution::normal(mean, std);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return Distribution::truncated_normal(mean, std, number_or(value, "min", -kInfinity),
                                          number_or(value, "max", kInfinity));
  }

  /// `[min, max]` or `{min: …, max: …}`.
  std::pair<double, double> range(const Settings& value) const {
    if (!value.is_map()) {
      const std::vector<double> ends = value.numbers(2, parameter_.quantity);
      return {ends[0], ends[1]};
    }
    return {number(value.at("min")), number(value.at("max"))};
  }

  Distribution uniform(const Settings& value) const {
    if (value.is_map()) value.allow(keys_of("uniform"));
    if (value.is_map() && value.has("spread")) {
      if (value.has("min") || value.has("max")) value.fail("either spread, or min and max");
      if (!std::isfinite(center_)) value.at("spread").fail_key(fmt::format("{}; write [min, max]", unlimited()));
      const double spread = width(value.at("spread"), whole_, "write [min, max]");
      if (spread < 0) value.at("spread").fail(fmt::format("{}: must be >= 0", value.at("spread").text()));
      return Distribution::uniform(center_ - spread, center_ + spread);
    }
    const auto [min, max] = range(value);
    return Distribution::uniform(min, max);
  }

  Distribution log_normal(const Settings& value) const {
    value.allow(keys_of("log_normal"));
    const double median = number_or_center(value, "median");
    if (!(median > 0))
      value.fail(fmt::format("the median {:g}{} is not positive; a log-normal value is always > 0{}", median,
                             value.has("median") ? "" : " (the nominal value)",
                             value.has("median") ? "" : ": give it with median: …"));
    return Distribution::log_normal(pinned::log(median), value.at("log_std").non_negative());
  }

  Distribution log_uniform(const Settings& value) const {
    if (value.is_map()) value.allow(keys_of("log_uniform"));
    const auto [min, max] = range(value);
    return Distribution::log_uniform(min, max);
  }

  Distribution triangular(const Settings& value) const {
    if (!value.is_map()) {
      const std::vector<double> at = value.numbers(3, parameter_.quantity);
      return Distribution::triangular(at[0], at[1], at[2]);
    }
    value.allow(keys_of("triangular"));
    return Distribution::triangular(number(value.at("min")), number_or_center(value, "mode"), number(value.at("max")));
  }

  Distribution empirical(const Settings& value) const {
    if (!value.is_map()) return Distribution::empirical(value.numbers(-1, parameter_.quantity));
    value.allow(keys_of("empirical"));
    if (value.has("values") == value.has("file")) value.fail("needs either 'values' or 'file' with 'column'");
    if (const auto values = value.find("values")) {
      return Distribution::empirical(values->numbers(-1, parameter_.quantity));
    }
    return Distribution::empirical(read_column(value, parameter_.quantity));
  }

  const Parameter& parameter_;
  double center_, whole_;
  Standing standing_;
};

/// Index of a named value of a parameter like contact.model.
int label_index(const Settings& value, const Parameter& parameter) {
  const std::string label = value.choice(parameter.choices);
  const auto at = std::find(parameter.choices.begin(), parameter.choices.end(), label);
  return static_cast<int>(at - parameter.choices.begin());
}

Spread read_choice(const Settings& value, const Parameter& parameter) {
  if (value.is_map()) value.allow(keys_of("choice"));
  const std::vector<Settings> values = (value.is_map() ? value.at("values") : value).items();
  std::vector<double> weights;
  if (value.is_map() && value.has("weights")) {
    weights = value.at("weights").numbers(static_cast<int>(values.size()));
  } else {
    weights.assign(values.size(), 1.0);
  }
  try {
    Spread out;
    if (parameter.choices.empty()) {
      std::vector<double> numbers;
      for (const Settings& one : values) numbers.push_back(one.number(parameter.quantity));
      out.persistent = Distribution::discrete(numbers, weights);
      return out;
    }
    // The value is an index into all labels; those that are not listed have no weight.
    std::vector<double> by_label(parameter.choices.size(), 0.0);
    for (std::size_t i = 0; i < values.size(); ++i) by_label[label_index(values[i], parameter)] += weights[i];
    out.persistent = Distribution::choice(static_cast<int>(by_label.size()), by_label);
    out.labels = parameter.choices;
    return out;
  } catch (const std::invalid_argument& e) {
    value.fail(e.what());
  }
}

/// `{density: 2e-3 rad/s^2/sqrt(Hz)}`: the density of white noise.
double read_noise(const Settings& value, const Parameter& parameter) {
  constexpr std::string_view kRoot = "/sqrt(Hz)";
  if (parameter.quantity == Quantity::dimensionless || parameter.quantity == Quantity::time) {
    value.fail_key(
        fmt::format("{} is no signal in time, which alone has a noise density; noise is for sensor.… and "
                    "actuator.… channels",
                    parameter.path));
  }
  value.allow(keys_of("noise"));
  const Settings density = value.at("density");
  const std::string text = density.text();
  const std::string unit = fmt::format("{}{}", unit_of(parameter.quantity), kRoot);
  const auto written = split_number(text);
  std::optional<double> number;
  if (written && written->unit.empty()) number = written->value;
  if (written && written->unit.ends_with(kRoot)) {
    number = to_si(parameter.quantity, written->value, written->unit.substr(0, written->unit.size() - kRoot.size()));
  }
  if (!number) density.fail(fmt::format("{}: must be a number in {}", text, unit));
  if (!(*number >= 0) || !std::isfinite(*number)) density.fail(fmt::format("{}: a noise density must be >= 0", text));
  constexpr double kMost = 1e100;  // whose draws are finite at any control step
  if (*number > kMost) density.fail(fmt::format("{}: a noise density must be at most {:g} {}", text, kMost, unit));
  return *number;
}

Spread fixed(const Settings& value, const Parameter& parameter) {
  Spread out;
  out.labels = parameter.choices;
  out.persistent = Distribution::constant(parameter.choices.empty() ? value.number(parameter.quantity)
                                                                    : label_index(value, parameter));
  return out;
}

Spread persistent_part(const Settings& map, const Parameter& parameter, Standing standing) {
  std::optional<SettingsEntry> chosen;
  for (const SettingsEntry& entry : map.entries()) {
    if (entry.first == "jitter") continue;
    if (chosen) {
      entry.second.fail_key(fmt::format("a second distribution beside '{}'; a parameter has one{}", chosen->first,
                                        replace_hint(*chosen, entry)));
    }
    chosen.emplace(entry);
  }
  Spread out;
  out.labels = parameter.choices;
  if (!chosen) {
    out.persistent = Distribution::constant(parameter.nominal);
    return out;
  }
  if (chosen->first == "choice") return read_choice(chosen->second, parameter);
  if (!parameter.choices.empty()) {
    chosen->second.fail_key(fmt::format("{} takes named values, so 'choice' is its only distribution", parameter.path));
  }
  out.persistent =
      SpreadReader(parameter, parameter.nominal, parameter.nominal, standing).read(chosen->first, chosen->second);
  return out;
}

}  // namespace

namespace {

/// Warns of values that a forgotten unit makes: a friction of 80, a mass that is a thousand times the nominal one.
void doubt(const Settings& value, const Parameter& parameter, const Distribution& distribution) {
  const double middle = distribution.median(), nominal = parameter.nominal;
  const std::string& path = parameter.path;
  if (parameter.quantity == Quantity::dimensionless && path.ends_with(".friction") && !(middle <= kMostFriction)) {
    warn(value, friction_doubt(middle));
  }
  constexpr double kFar = 100;
  if (!parameter.strict || !(nominal > 0) || !std::isfinite(nominal) ||
      (middle <= kFar * nominal && kFar * middle >= nominal))
    return;
  const std::string_view unit = unit_of(parameter.quantity);
  warn(value, fmt::format("{:g} {} is {:.3g} times the nominal {:g} {} of {}; is the unit right?", middle, unit,
                          middle / nominal, nominal, unit, path));
}

/// Refuses keys that stand one level too high, `{mean: 5 ms, std: 1 ms}` and `{noise: …}`, with where they belong.
void refuse_misplaced(const Settings& value) {
  constexpr const char *kNormal = "{normal: {mean: …, std: …}}", *kUniform = "{uniform: {min: …, max: …}}";
  constexpr std::pair<const char*, const char*> kRight[] = {
      {"mean", kNormal},
      {"std", kNormal},
      {"min", kUniform},
      {"max", kUniform},
      {"spread", "{uniform: {spread: …}}"},
      {"noise", "{jitter: {noise: …}}, drawn afresh at every control step"}};
  for (const auto& [key, right] : kRight) {
    if (value.has(key)) value.at(key).fail_key(fmt::format("is written {}", right));
  }
}

/// "; did you mean 5 %?" for a bare width of a distribution about a value that 5 % of would leave within the bounds.
std::string share_meant(const Settings& value, const Parameter& parameter, const Distribution& distribution) {
  std::optional<Settings> width;
  for (const auto& [name, key] : {std::pair{"normal", "std"}, std::pair{"uniform", "spread"}}) {
    const auto found = value.is_map() ? value.find(name) : std::nullopt;
    if (found && found->is_map() && found->has(key)) width = found->at(key);
  }
  const std::string meant = width ? percent_meant(width->text()) : "";
  if (meant.empty()) return "";
  const Distribution::Numbers at = distribution.numbers();
  const bool uniform = distribution.kind() == Distribution::Kind::uniform;
  const double middle = uniform ? (at.a + at.b) / 2 : at.a, share = std::abs(middle) * width->number() / 100;
  const Distribution right =
      uniform ? Distribution::uniform(middle - share, middle + share) : Distribution::normal(middle, share);
  return share > 0 && right.lowest() > parameter.lower && right.highest() < parameter.upper ? meant : "";
}

/// What a distribution of this kind needs to stay within a bound, "cut it with min: …". `low`: it is the lower bound.
std::string within_bound(const Settings& value, const Parameter& parameter, const Distribution& distribution,
                         bool low) {
  using Kind = Distribution::Kind;
  const double bound = low ? parameter.lower : parameter.upper;
  const std::string_view unit = unit_of(parameter.quantity);
  const std::string shown = fmt::format("{:g}{}{}", bound, unit == "1" ? "" : " ", unit == "1" ? "" : unit);
  // About a nominal value on the bound itself, half of a distribution is impossible: its middle was forgotten.
  const bool centred = parameter.nominal == bound && distribution.median() == bound;
  const std::string middle = fmt::format(": its middle is the nominal value {:g}; ", parameter.nominal);
  switch (distribution.kind()) {
    case Kind::normal:
    case Kind::truncated_normal:
      return fmt::format("{}cut it with {}: …{}", centred ? middle + "give it a 'mean', or " : ": ",
                         low ? "min" : "max", share_meant(value, parameter, distribution));
    case Kind::log_normal:
      return ": give it a smaller median or log_std";
    case Kind::choice:
    case Kind::empirical:
      return fmt::format(": take out what is {} {}",
                         parameter.strict ? "not"
                         : low            ? "below"
                                          : "above",
                         parameter.strict ? fmt::format("{} {}", low ? "above" : "below", shown) : shown);
    default:
      break;
  }
  const auto uniform = value.is_map() ? value.find("uniform") : std::nullopt;
  if (uniform && uniform->is_map() && uniform->has("spread")) {
    if (centred) return middle + "write [min, max]";
    const std::string share = share_meant(value, parameter, distribution);
    return share.empty() ? ": give it a smaller spread" : share;
  }
  return fmt::format(": {} it at {} or {}", low ? "begin" : "end", shown, low ? "above" : "below");
}

}  // namespace

std::string friction_doubt(double friction) {
  return fmt::format("a coefficient of friction of {:g}; rubber on asphalt has about 1{}", friction,
                     friction <= 200 ? fmt::format("; did you mean {:g} %?", friction) : "");
}

bool is_spread(const Settings& value) { return value.is_map(); }

double read_cone(const Settings& value) {
  value.allow(keys_of("cone"));
  const double std = value.at("std").non_negative(Quantity::angle);
  if (std > std::numbers::pi) {
    value.at("std").fail(
        fmt::format("{:g} rad: an axis is tilted by half a turn at most, {:.5g} rad", std, std::numbers::pi));
  }
  return std;
}

void check_bounds(const Settings& value, const Parameter& parameter, const Distribution& distribution) {
  const double low = distribution.lowest(), high = distribution.highest();
  const std::string_view unit = unit_of(parameter.quantity), shown = unit == "1" ? "" : unit;
  const auto refuse = [&](const char* word, double extreme, const char* rule, double bound) {
    const bool spread = !distribution.is_constant();
    const std::string right = spread ? within_bound(value, parameter, distribution, bound == parameter.lower)
                              : value.is_scalar() && bound == 1 ? percent_meant(value.text())
                                                                : "";
    value.fail(fmt::format("{} {} {:g}{}{}; {} must be {} {:g}{}", rounded_numbers(distribution.describe()),
                           spread ? fmt::format("can be as {} as", word) : "is", extreme, shown.empty() ? "" : " ",
                           shown, parameter.path, rule, bound, right));
  };
  if (parameter.strict ? low <= parameter.lower : low < parameter.lower) {
    refuse("low", low, parameter.strict ? ">" : ">=", parameter.lower);
  }
  if (parameter.strict ? high >= parameter.upper : high > parameter.upper) {
    refuse("high", high, parameter.strict ? "<" : "<=", parameter.upper);
  }
}

Spread read_spread(const Settings& value, const Parameter& parameter, Standing standing) {
  if (value.is_null()) value.fail("nothing: must be a number or a distribution");
  if (!value.is_map()) {
    const Spread out = fixed(value, parameter);
    check_bounds(value, parameter, out.persistent);
    doubt(value, parameter, out.persistent);
    return out;
  }
  refuse_misplaced(value);
  value.allow(keys_of("spread"));
  if (value.entries().empty()) value.fail("{}: must be a number or a distribution");
  const auto jitter = value.find("jitter");
  if (jitter && !parameter.transient) {
    jitter->fail_key(
        fmt::format("{} is drawn once per particle and cannot change while it runs; jitter is for "
                    "control.lag, actuator.… and sensor.…, but for sensor.contact.…",
                    parameter.path));
  }
  Spread out = persistent_part(value, parameter, standing);
  check_bounds(value, parameter, out.persistent);
  doubt(value, parameter, out.persistent);
  if (jitter) {
    std::vector<std::string> names = distribution_names();
    std::erase(names, "choice");
    names.push_back("noise");
    const auto [name, settings] = jitter->single(names);
    if (name == "noise") {
      out.noise_density = read_noise(settings, parameter);
    } else {
      const double whole = standing == Standing::as_nominal ? out.persistent.mean() : parameter.nominal;
      out.jitter = SpreadReader(parameter, 0.0, whole, Standing::beside_nominal).read(name, settings);
    }
  }
  return out;
}

}  // namespace graze
