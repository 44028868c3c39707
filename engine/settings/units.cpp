#include "engine/settings/units.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <regex>
#include <vector>

namespace graze {
namespace {

struct Unit {
  std::string_view name;
  double factor;  // SI value of one is factor / divisor
  double divisor = 1;
};

constexpr double kDegree = std::numbers::pi / 180;

struct Measured {
  const char* name;         // as Quantity has it
  std::vector<Unit> units;  // the SI unit stands first
};

/// In the order of Quantity.
const std::vector<Measured>& quantities() {
  static const std::vector<Measured> table = {
      {"dimensionless", {{"1", 1}, {"%", 1, 100}}},
      {"length", {{"m", 1}, {"cm", 1, 100}, {"mm", 1, 1000}, {"in", 0.0254}}},
      {"angle", {{"rad", 1}, {"deg", kDegree}}},
      {"time", {{"s", 1}, {"ms", 1, 1e3}, {"us", 1, 1e6}}},
      {"mass", {{"kg", 1}, {"g", 1, 1e3}}},
      {"density", {{"kg/m^3", 1}, {"g/cm^3", 1000}}},
      {"velocity", {{"m/s", 1}, {"cm/s", 1, 100}, {"mm/s", 1, 1000}}},
      {"angular_velocity", {{"rad/s", 1}, {"deg/s", kDegree}, {"rpm", 2 * std::numbers::pi / 60}}},
      {"acceleration", {{"m/s^2", 1}}},
      {"angular_acceleration", {{"rad/s^2", 1}, {"deg/s^2", kDegree}}},
      {"force", {{"N", 1}}},
      {"impulse", {{"N s", 1}, {"Ns", 1}, {"mN s", 1, 1000}, {"mNs", 1, 1000}}},
      {"torque", {{"N m", 1}, {"Nm", 1}}},
      {"stiffness", {{"N/m", 1}}},
      {"rotational_stiffness", {{"N m/rad", 1}, {"Nm/rad", 1}}},
      {"damping", {{"N s/m", 1}, {"Ns/m", 1}}},
      {"rotational_damping", {{"N m s/rad", 1}, {"Nms/rad", 1}}},
      {"inertia",
       {{"kg m^2", 1}, {"kgm^2", 1}, {"kg cm^2", 1, 1e4}, {"kgcm^2", 1, 1e4}, {"g cm^2", 1, 1e7}, {"gcm^2", 1, 1e7}}},
  };
  return table;
}

const std::vector<Unit>& units(Quantity quantity) { return quantities()[static_cast<std::size_t>(quantity)].units; }

constexpr int kQuantities = static_cast<int>(Quantity::inertia) + 1;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

}  // namespace

std::string_view unit_of(Quantity quantity) { return units(quantity).front().name; }

std::optional<double> to_si(Quantity quantity, double value, std::string_view unit) {
  if (unit.empty()) return value;
  for (const Unit& candidate : units(quantity)) {
    if (candidate.name == unit && unit != "1") return value * candidate.factor / candidate.divisor;
  }
  return std::nullopt;
}

bool is_unit(std::string_view word) {
  for (int i = 0; i < kQuantities; ++i) {
    if (!word.empty() && to_si(static_cast<Quantity>(i), 1, word)) return true;
  }
  return false;
}

const std::vector<std::string>& quantity_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const Measured& one : quantities()) out.emplace_back(one.name);
    return out;
  }();
  return names;
}

std::vector<std::string> unit_names(Quantity quantity) {
  std::vector<std::string> out;
  for (const Unit& unit : units(quantity)) {
    if (unit.name != "1") out.emplace_back(unit.name);
  }
  return out;
}

std::string units_of(Quantity quantity) { return fmt::format("{}", fmt::join(unit_names(quantity), ", ")); }

std::string unlikely(Quantity quantity, double value, std::string_view unit) {
  if (!unit.empty() && unit != unit_of(quantity)) return "";
  const double size = std::abs(value);
  // Nothing if that were as strange.
  const auto meant = [&](const char* other) {
    const bool strange = !unlikely(quantity, *to_si(quantity, value, other), "").empty();
    return strange ? "" : fmt::format("; did you mean {:.15g} {}?", value, other);
  };
  constexpr double kTurn = 2 * std::numbers::pi;
  switch (quantity) {
    case Quantity::angle:
      if (size > kTurn * (1 + 1e-9)) return fmt::format("is {:.3g} turns{}", size / kTurn, meant("deg"));
      break;
    case Quantity::angular_velocity:  // beyond what legs and arms do by an order of magnitude
      if (size > 100) return fmt::format("is {:.3g} turns per second{}", size / kTurn, meant("deg/s"));
      break;
    case Quantity::length:
      if (size > 100) return fmt::format("is {:g} m{}", size, meant("mm"));
      break;
    case Quantity::time:
      if (size > 1000) return fmt::format("is {:.3g} minutes{}", size / 60, meant("ms"));
      break;
    case Quantity::mass:
      if (size > 1000) return fmt::format("is {:.3g} tonnes{}", size / 1000, meant("g"));
      break;
    case Quantity::density:
      if (size > 23000) return "is denser than any metal; kg/m^3 is meant";
      break;
    case Quantity::velocity:
      if (size > 50) return fmt::format("is {:.3g} km/h{}", 3.6 * size, meant("mm/s"));
      break;
    case Quantity::inertia:  // of rotors, the only ones that are written
      if (size > 0.1) return fmt::format("is a flywheel's{}", meant("g cm^2"));
      break;
    case Quantity::acceleration:
      if (size > 500) return fmt::format("is {:.3g} times the earth's gravity; m/s^2 is meant", size / 9.81);
      break;
    default:
      break;
  }
  return "";
}

std::string percent_meant(std::string_view text) {
  const auto written = split_number(text);
  if (!written || !written->unit.empty() || !(written->value >= 2 && written->value <= 100)) return "";
  return fmt::format("; did you mean {:.15g} %?", written->value);
}

bool is_bare(const Settings& value) {
  if (!value.is_scalar()) return false;
  const std::string text = value.text();
  const auto written = split_number(text);
  return written && written->unit.empty();
}

std::string unit_meant(const Settings& value, Quantity quantity, const std::function<bool(double)>& fits) {
  if (!is_bare(value)) return "";
  const std::string text = value.text();
  const double number = split_number(text)->value;
  for (const Unit& unit : units(quantity)) {
    if (unit.factor == 1 && unit.divisor == 1) continue;
    if (fits(number * unit.factor / unit.divisor)) return fmt::format("; did you mean {:.15g} {}?", number, unit.name);
  }
  return "";
}

std::string in_unit_of(const Settings& typed, Quantity quantity, double value) {
  const std::string text = typed.is_scalar() ? typed.text() : "";
  const auto written = split_number(text);  // looks into the text
  const auto one = written && !written->unit.empty() ? to_si(quantity, 1, written->unit) : std::nullopt;
  const std::string_view unit = one ? written->unit : unit_of(quantity);
  return fmt::format("{:g}{}{}", value / one.value_or(1), unit == "1" ? "" : " ", unit == "1" ? "" : unit);
}

std::string rounded_numbers(const std::string& text) {
  static const std::regex decimal("[0-9]+\\.[0-9]+(e[+-]?[0-9]+)?");
  std::string out;
  auto rest = text.begin();
  for (std::sregex_iterator match(text.begin(), text.end(), decimal), end; match != end; ++match) {
    out.append(rest, text.begin() + match->position());
    double value = 0;
    const char* const first = text.data() + match->position();
    std::from_chars(first, first + match->length(), value);
    out += fmt::format("{:.6g}", value);
    rest = text.begin() + match->position() + match->length();
  }
  return out.append(rest, text.end());
}

std::optional<WrittenNumber> split_number(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  // from_chars would take "inf" and "nan", which are words to a reader.
  const std::size_t first = !text.empty() && text[0] == '-' ? 1 : 0;
  if (first >= text.size() || (text[first] != '.' && (text[first] < '0' || text[first] > '9'))) return std::nullopt;
  WrittenNumber out;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out.value);
  if (error != std::errc()) return std::nullopt;
  out.unit = trimmed(text.substr(static_cast<std::size_t>(end - text.data())));
  return out;
}

}  // namespace graze
