#include "scenarios/spread.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "engine/settings/merged.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "scenarios/distributions.h"
#include "scenarios/keys.h"

namespace graze {
namespace {

/// `{density: 2e-3 rad/s^2/sqrt(Hz)}`: the density of white noise.
double read_noise(const Settings& value, const Parameter& parameter) {
  constexpr std::string_view kRoot = "/sqrt(Hz)";
  if (parameter.quantity == Quantity::dimensionless || parameter.quantity == Quantity::time) {
    value.fail_key(
        fmt::format("{} is no signal in time, which alone has a noise density; noise is for sensor.… and "
                    "actuator.… channels",
                    parameter.path));
  }
  const Settings density = Described(value, noise_description()).at("density");
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

Spread read_kind(const DistributionKind& kind, const Settings& value, const DrawnFor& drawn) {
  const Described own(value, kind.text);
  try {
    return kind.read(own, drawn);
  } catch (const std::invalid_argument& e) {
    value.fail(e.what());
  }
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
  const DistributionKind& kind = *kind_of(distribution_kinds(), chosen->first);
  if (!parameter.choices.empty() && !kind.of_words) {
    chosen->second.fail_key(fmt::format("{} takes named values, so 'choice' is its only distribution", parameter.path));
  }
  return read_kind(kind, chosen->second, {parameter, parameter.nominal, parameter.nominal, standing});
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

/// Warns of distributions that hardly spread, or over more than anything does.
void doubt_shape(const Settings& value, const Distribution& distribution) {
  using Kind = Distribution::Kind;
  constexpr double kRare = 1e-6, kManyFold = 1e12;  // our choices: five standard deviations; mm beside a light hour
  const Distribution::Numbers of = distribution.numbers();
  const auto tell = [&](const std::string& what) {
    warn(value, fmt::format("{} {}", rounded_numbers(distribution.describe()), what));
  };
  if (distribution.kind() == Kind::truncated_normal && (of.far || of.span < kRare)) {
    return tell(
        "leaves nearly nothing of the normal between its bounds; is the unit of mean, std, min or max another?");
  }
  const double low = distribution.lowest(), high = distribution.highest();
  const bool listed = distribution.kind() == Kind::choice || distribution.kind() == Kind::empirical;
  if (distribution.kind() != Kind::constant && !listed && low == high) {
    return tell(fmt::format("is always {:g}: a distribution without width", low));
  }
  if (distribution.kind() == Kind::log_uniform && high > kManyFold * low) {
    tell(fmt::format("goes from {:.3g} to {:.3g}; is that meant?", low, high));
  }
}

/// Refuses `[900, 1000]`, with the distribution that is meant by it.
[[noreturn]] void refuse_list(const Settings& value) {
  std::string list;
  for (const Settings& one : value.items()) {
    list += (list.empty() ? "" : ", ") + (one.is_scalar() ? one.text() : std::string("…"));
  }
  list = clipped(list, 80);
  const char* const kind = value.items().size() == 2 ? "uniform" : "choice";
  value.fail(fmt::format("[{0}]: must be a number or a distribution; did you mean {{{1}: [{0}]}}?", list, kind));
}

/// Refuses keys that stand one level too high, `{mean: 5 ms, std: 1 ms}` and `{noise: …}`, with where they belong.
void refuse_misplaced_spread(const Settings& value) {
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
  const double std = Described(value, cone_description()).number("std");
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
  if (value.is_list()) refuse_list(value);
  if (!value.is_map()) {
    const Spread out = fixed(value, parameter);
    check_bounds(value, parameter, out.persistent);
    doubt(value, parameter, out.persistent);
    return out;
  }
  refuse_misplaced_spread(value);
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
  doubt_shape(value, out.persistent);
  if (jitter) {
    std::vector<std::string> names;
    for (const DistributionKind& kind : distribution_kinds()) {
      if (!kind.of_words) names.push_back(kind.name);
    }
    names.push_back("noise");
    const auto [name, settings] = jitter->single(names);
    if (name == "noise") {
      out.noise_density = read_noise(settings, parameter);
    } else {
      const double whole = standing == Standing::as_nominal ? out.persistent.mean() : parameter.nominal;
      const DrawnFor drawn{parameter, 0.0, whole, Standing::beside_nominal};
      out.jitter = read_kind(*kind_of(distribution_kinds(), name), settings, drawn).persistent;
    }
  }
  return out;
}

}  // namespace graze
