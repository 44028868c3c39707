// Typed values of a settings tree.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/settings/settings.h"
#include "engine/settings/tree.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"

namespace graze {
namespace {

std::string expected_number(Quantity quantity) {
  const std::string units = units_of(quantity);
  return units.empty() ? "must be a number" : fmt::format("must be a number, with or without a unit ({})", units);
}

/// "[25, 75, 0, 50] %" -> its items, each with the unit behind it. Nothing if the text has not that form.
std::optional<std::vector<std::string>> split_list(const std::string& text) {
  const std::size_t open = text.find_first_not_of(' ');
  const std::size_t close = text.rfind(']');
  if (open == std::string::npos || text[open] != '[' || close == std::string::npos) return std::nullopt;
  const std::string inside = text.substr(open + 1, close - open - 1), unit = text.substr(close + 1);
  std::vector<std::string> out;
  for (std::size_t from = 0; from <= inside.size();) {
    const std::size_t comma = std::min(inside.find(',', from), inside.size());
    out.push_back(inside.substr(from, comma - from) + " " + unit);
    from = comma + 1;
  }
  return out;
}

}  // namespace

const std::string& Settings::scalar(const char* expected) const {
  if (node_->kind == SettingsNode::Kind::map && !node_->map.empty()) {
    std::string glob;  // {LF,RF}, which YAML reads as a map of keys without values
    const auto bare = [](const auto& entry) { return entry.value->kind == SettingsNode::Kind::null; };
    for (const auto& entry : node_->map) glob += (glob.empty() ? "" : ",") + entry.key;
    if (std::all_of(node_->map.begin(), node_->map.end(), bare)) {
      fail(fmt::format("{}: {}; {{ begins a map in YAML; in quotes it is a glob: \"{{{}}}\"", shown(), expected, glob));
    }
  }
  if (node_->kind != SettingsNode::Kind::scalar) fail(fmt::format("{}: {}", shown(), expected));
  return node_->text;
}

double Settings::number_from(const std::string& text, Quantity quantity) const {
  const auto written = split_number(text);
  if (!written) fail(fmt::format("{}: {}", shown(), expected_number(quantity)));
  const auto value = to_si(quantity, written->value, written->unit);
  if (!value) {
    const std::string fitting = units_of(quantity);
    fail(fmt::format("{}: the unit '{}' does not fit; {}", shown(), written->unit,
                     fitting.empty()                       ? "a bare number is meant"
                     : quantity == Quantity::dimensionless ? "a bare number is meant, or " + fitting
                                                           : "one of: " + fitting));
  }
  if (!std::isfinite(*value)) fail(shown() + ": must be finite");
  const std::string doubt = unlikely(quantity, written->value, written->unit);
  if (!doubt.empty()) warn(*this, fmt::format("{}: {}", shown(), doubt));
  return *value;
}

double Settings::number(Quantity quantity) const {
  return number_from(scalar(expected_number(quantity).c_str()), quantity);
}

double Settings::positive(Quantity quantity) const {
  const double value = number(quantity);
  if (!(value > 0)) fail(shown() + ": must be > 0");
  return value;
}

double Settings::non_negative(Quantity quantity) const {
  const double value = number(quantity);
  if (!(value >= 0)) fail(shown() + ": must be >= 0");
  return value;
}

double Settings::within(double low, double high, Quantity quantity) const {
  const double value = number(quantity);
  if (!(value >= low && value <= high)) {
    const bool si = quantity != Quantity::dimensionless;
    fail(fmt::format("{}: must lie within [{:g}, {:g}]{}{}{}", shown(), low, high, si ? " " : "",
                     si ? unit_of(quantity) : "", !si && low == 0 && high == 1 ? percent_meant(node_->text) : ""));
  }
  return value;
}

long long Settings::integer() const {
  const std::string& text = scalar("must be a whole number");
  const bool digits =
      text.find_first_not_of("0123456789", text.starts_with('-') || text.starts_with('+')) == std::string::npos;
  const double value = number();
  constexpr double kExact = 9007199254740992.0;  // 2^53: beyond, doubles skip integers
  if (value != std::floor(value)) fail(shown() + ": must be a whole number");
  if (std::abs(value) > kExact) fail(fmt::format("{}: must be a whole number of at most {:.0f}", shown(), kExact));
  if (!digits) fail(fmt::format("{}: must be a whole number, in digits; nearest right answer: {:.0f}", shown(), value));
  return static_cast<long long>(value);
}

bool Settings::flag() const {
  const std::string& text = scalar("must be true or false");
  for (const char* word : {"true", "True", "yes", "on"}) {
    if (text == word) return true;
  }
  for (const char* word : {"false", "False", "no", "off"}) {
    if (text == word) return false;
  }
  fail(shown() + ": must be true or false");
}

std::string Settings::text() const { return scalar("must be a text"); }

std::string Settings::glob() const {
  const std::string& text = scalar("must be a name or a glob");
  if (const std::string problem = glob_problem(text); !problem.empty()) fail(problem);
  return text;
}

std::string Settings::choice(const std::vector<std::string>& choices) const {
  std::string list;
  for (const std::string& one : choices) list += (list.empty() ? "" : ", ") + one;
  const std::string word = scalar(("must be one of: " + list).c_str());
  if (std::find(choices.begin(), choices.end(), word) != choices.end()) return word;
  const std::string near = nearest(word, choices);
  fail(fmt::format("{}: must be one of: {}{}", shown(), list,
                   near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

std::vector<double> Settings::numbers(int n, Quantity quantity) const {
  std::vector<double> out;
  const auto written = is_scalar() ? split_list(node_->text) : std::nullopt;
  if (written) {
    for (const std::string& item : *written) out.push_back(number_from(item, quantity));
  } else {
    std::vector<Settings> values = items();
    std::string unit;
    if (!values.empty() && values.back().is_scalar() && is_unit(values.back().text())) {
      unit = values.back().text();
      values.pop_back();
    }
    for (const Settings& value : values) {
      out.push_back(value.number_from(value.scalar(expected_number(quantity).c_str()) + " " + unit, quantity));
    }
  }
  if (n >= 0 && out.size() != static_cast<std::size_t>(n)) {
    fail(fmt::format("{}: must be a list of {} numbers; this has {}", shown(), n, out.size()));
  }
  return out;
}

double Settings::number_or(std::string_view key, double fallback, Quantity quantity) const {
  const auto value = find(key);
  return value ? value->number(quantity) : fallback;
}

bool Settings::flag_or(std::string_view key, bool fallback) const {
  const auto value = find(key);
  return value ? value->flag() : fallback;
}

std::string Settings::text_or(std::string_view key, std::string fallback) const {
  const auto value = find(key);
  return value ? value->text() : fallback;
}

}  // namespace graze
