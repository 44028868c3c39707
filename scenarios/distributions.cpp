#include "scenarios/distributions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sampling/constants.h"
#include "sampling/elementary.h"
#include "scenarios/csv.h"

namespace graze {
namespace {

/// Reads the parts of one distribution of one parameter.
class SpreadReader {
 public:
  explicit SpreadReader(const DrawnFor& drawn)
      : parameter_(drawn.parameter), center_(drawn.center), whole_(drawn.whole), standing_(drawn.standing) {}

  Distribution normal(const Settings& value) const {
    const double mean = number_or_center(value, "mean");
    const bool own = standing_ == Standing::as_nominal && value.has("mean");
    const double std = width(value.at("std"), own ? mean : whole_, "give it a 'mean'");
    if (std < 0) value.at("std").fail(fmt::format("{}: a standard deviation must be >= 0", value.at("std").text()));
    if (!value.has("min") && !value.has("max")) return Distribution::normal(mean, std);
    return Distribution::truncated_normal(mean, std, number_or(value, "min", -kInfinity),
                                          number_or(value, "max", kInfinity));
  }

  Distribution uniform(const Settings& value) const {
    if (value.is_map() && value.has("spread")) {
      if (value.has("min") || value.has("max")) value.fail("either spread, or min and max");
      if (!std::isfinite(center_)) value.at("spread").fail_key(fmt::format("{}; write [min, max]", unlimited()));
      const double spread = width(value.at("spread"), whole_, "write [min, max]");
      if (spread < 0) value.at("spread").fail(fmt::format("{}: must be >= 0", value.at("spread").text()));
      return Distribution::uniform(center_ - spread, center_ + spread);
    }
    if (value.is_scalar() && value.text().find('[') == std::string::npos) {
      value.fail(fmt::format("{0}: one number is no range; write [min, max], or {{spread: {0}}}", value.text()));
    }
    const auto [min, max] = range(value);
    return Distribution::uniform(min, max);
  }

  Distribution log_normal(const Settings& value) const {
    const double median = number_or_center(value, "median");
    if (!(median > 0))
      value.fail(fmt::format("the median {:g}{} is not positive; a log-normal value is always > 0{}", median,
                             value.has("median") ? "" : " (the nominal value)",
                             value.has("median") ? "" : ": give it with median: …"));
    return Distribution::log_normal(pinned::log(median), value.at("log_std").non_negative());
  }

  Distribution log_uniform(const Settings& value) const {
    const auto [min, max] = range(value);
    return Distribution::log_uniform(min, max);
  }

  Distribution triangular(const Settings& value) const {
    if (!value.is_map()) {
      const std::vector<double> at = value.numbers(3, parameter_.quantity);
      return Distribution::triangular(at[0], at[1], at[2]);
    }
    const double min = number(value.at("min")), max = number(value.at("max")), mode = number_or_center(value, "mode");
    if (!value.has("mode") && min <= max && !(min <= mode && mode <= max)) {
      value.fail(
          fmt::format("the nominal value {:g} of {}, which is the mode if none is given, is outside [{:g}, {:g}]; "
                      "give it a 'mode'",
                      mode, parameter_.path, min, max));
    }
    return Distribution::triangular(min, mode, max);
  }

  Distribution empirical(const Settings& value) const {
    if (!value.is_map()) return Distribution::empirical(value.numbers(-1, parameter_.quantity));
    if (const auto values = value.find("values")) {
      return Distribution::empirical(values->numbers(-1, parameter_.quantity));
    }
    return Distribution::empirical(read_column(value, parameter_.quantity));
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

  /// `[min, max]` or `{min: …, max: …}`.
  std::pair<double, double> range(const Settings& value) const {
    if (!value.is_map()) {
      const std::vector<double> ends = value.numbers(2, parameter_.quantity);
      return {ends[0], ends[1]};
    }
    return {number(value.at("min")), number(value.at("max"))};
  }

  const Parameter& parameter_;
  double center_, whole_;
  Standing standing_;
};

using Read = Distribution (SpreadReader::*)(const Settings&) const;

DistributionReader by(Read read) {
  return [read](const Described& own, const DrawnFor& drawn) {
    Spread out;
    out.labels = drawn.parameter.choices;
    out.persistent = (SpreadReader(drawn).*read)(own.settings());
    return out;
  };
}

Spread choice(const Described& own, const DrawnFor& drawn) {
  const Settings& value = own.settings();
  const Parameter& parameter = drawn.parameter;
  const Settings list = value.is_map() ? value.at("values") : value;
  const bool named = !parameter.choices.empty();
  const std::vector<Settings> values = named ? list.items() : std::vector<Settings>{};
  // Numbers may share a unit, which is no value of its own.
  const std::vector<double> numbers = named ? std::vector<double>{} : list.numbers(-1, parameter.quantity);
  const std::size_t count = named ? values.size() : numbers.size();
  std::vector<double> weights(count, 1.0);
  if (value.is_map() && value.has("weights")) weights = value.at("weights").numbers(static_cast<int>(count));
  Spread out;
  if (!named) {
    out.persistent = Distribution::discrete(numbers, weights);
    return out;
  }
  // The value is an index into all labels; those that are not listed have no weight.
  std::vector<double> by_label(parameter.choices.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) by_label[label_index(values[i], parameter)] += weights[i];
  out.persistent = Distribution::choice(static_cast<int>(by_label.size()), by_label);
  out.labels = parameter.choices;
  return out;
}

DistributionKind choice_kind() {
  const Key values = {"values", {Form::labels()}, Default::required(), "numbers, or names of the parameter's values"};
  return {"choice",
          {"one of some values",
           {values,
            {"weights",
             {Form::numbers(-1, Quantity::dimensionless, Bound::not_negative)},
             Default::words("all alike"),
             "how likely each is, in proportion",
             "values"}},
           {},
           {Form::labels()},
           "A list alone stands for `{values: […]}`."},
          choice,
          true};
}

DistributionKind empirical_kind() {
  return {"empirical",
          {"as measured: interpolates between the sorted values",
           {{"values", {Form::drawn_list(-1)}, {}, "the measured values"},
            {"file", {Form::text("FILE")}, {}, "CSV with a header line that holds them"},
            {"column", {Form::text("NAME")}, {}, "of the file; required with it", "file"},
            {"unit", {Form::text("UNIT")}, Default::words("SI"), "of the column", "file"}},
           {{"values", "file"}},
           {Form::drawn_list(-1)},
           "A list alone stands for `{values: […]}`."},
          by(&SpreadReader::empirical)};
}

std::vector<DistributionKind> own_kinds() {
  const Default nominal = Default::words("the nominal value"), none = Default::words("none");
  const auto at = [](const char* name, const Default& otherwise, const char* help) {
    return Key(name, {Form::drawn()}, otherwise, help);
  };
  const Key min = at("min", Default::required(), "the least value"),
            max = at("max", Default::required(), "the greatest value");
  return {
      {"normal",
       {"normal about a mean, cut at bounds if they are given",
        {at("mean", nominal, "the middle"),
         {"std", {Form::width()}, Default::required(), "standard deviation; % of the nominal value"},
         at("min", none, "where it is cut below"),
         at("max", none, "where it is cut above")}},
       by(&SpreadReader::normal)},
      {"uniform",
       {"every value from one end to the other alike",
        {at("min", {}, "the least value"),
         at("max", {}, "the greatest value"),
         {"spread", {Form::width()}, {}, "instead of both: how far from the nominal value, either way; % of it"}},
        {},
        {Form::drawn_list(2)},
        "`[min, max]` is short for the map."},
       by(&SpreadReader::uniform)},
      {"log_normal",
       {"its logarithm is normal, so every value is positive",
        {at("median", nominal, "the middle"),
         {"log_std",
          {Form::number(Quantity::dimensionless, Bound::not_negative)},
          Default::required(),
          "standard deviation of ln x"}}},
       by(&SpreadReader::log_normal)},
      {"log_uniform",
       {"its logarithm is uniform", {min, max}, {}, {Form::drawn_list(2)}, "`[min, max]` is short for the map."},
       by(&SpreadReader::log_uniform)},
      {"triangular",
       {"rises from one end to the mode and falls to the other",
        {min, at("mode", nominal, "the most likely value"), max},
        {},
        {Form::drawn_list(3)},
        "`[min, mode, max]` is short for the map."},
       by(&SpreadReader::triangular)},
      choice_kind(),
      empirical_kind(),
  };
}

}  // namespace

/// Index of a named value of a parameter like contact.model.
int label_index(const Settings& value, const Parameter& parameter) {
  const std::string label = value.choice(parameter.choices);
  const auto at = std::find(parameter.choices.begin(), parameter.choices.end(), label);
  return static_cast<int>(at - parameter.choices.begin());
}

const std::vector<DistributionKind>& distribution_kinds() {
  static const std::vector<DistributionKind> kinds = with_registered(own_kinds());
  return kinds;
}

const Description& noise_description() {
  static const Description text = {
      "white noise of a sensor or actuator channel, the same whatever the control step",
      {{"density",
        {Form::number(Quantity::dimensionless, Bound::not_negative), Form::text("NUMBER UNIT/sqrt(Hz)")},
        Default::required(),
        "in the channel's unit per sqrt(Hz); the standard deviation of a draw is that over sqrt(control step)"}},
      {},
      {},
      "Only below `jitter`, of `sensor.…` and `actuator.…`."};
  return text;
}

const Description& cone_description() {
  static const Description text = {"conical error of a joint's axis: tilted by a normal angle in a uniform direction",
                                   {{"std",
                                     {Form::number(Quantity::angle, Bound::not_negative)},
                                     Default::required(),
                                     "standard deviation of the tilt"}},
                                   {},
                                   {},
                                   "Only of `robot.joint.JOINT.axis`."};
  return text;
}

}  // namespace graze
