#include "jobs/cli/option_values.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "engine/settings/settings.h"
#include "engine/settings/units.h"

namespace graze {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& rule,
                         const std::string& nearest_right) {
  throw InputError(fmt::format("{} {}: {}{}{}", option, text, rule,
                               nearest_right.empty() ? "" : "; nearest right answer: ", nearest_right));
}

/// What a number that is written in another way may mean: 1e6, 1_000, 1,000, 5s, -1, 2.5. Nothing if it does
/// not begin with a number.
std::optional<double> number_meant(std::string text) {
  std::erase_if(text, [](char c) { return c == '_' || c == ',' || c == '\'' || c == ' ' || c == '+' || c == '='; });
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end == text.data() || !std::isfinite(value)) return std::nullopt;
  return error == std::errc::result_out_of_range ? HUGE_VAL : value;
}

/// A unit of time that scenarios do not have, in seconds.
double longer_unit(std::string_view unit) {
  if (unit.starts_with("m")) return 60;  // "min"; "ms" is known
  if (unit.starts_with("h")) return 3600;
  if (unit.starts_with("n")) return 1e-9;
  return unit.starts_with("d") ? 86400 : 1;
}

}  // namespace

std::uint64_t parse_whole(const std::string& text, const std::string& option, std::uint64_t least, std::uint64_t most) {
  std::uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc{} && after == end && value >= least && value <= most) return value;
  std::string right;
  if (after == end && error == std::errc{}) {
    right = std::to_string(std::clamp(value, least, most));
  } else if (const std::optional<double> meant = number_meant(text)) {
    const double rounded = std::round(*meant);
    right = std::to_string(rounded >= static_cast<double>(most)    ? most
                           : rounded <= static_cast<double>(least) ? least
                                                                   : static_cast<std::uint64_t>(rounded));
  }
  refuse(option, text, fmt::format("is not a whole number from {} to {}, in digits", least, most), right);
}

double parse_seconds(const std::string& text, const std::string& option, double least, double most) {
  const auto written = split_number(text);
  const auto value = written ? to_si(Quantity::time, written->value, written->unit) : std::nullopt;
  if (value && (*value == 0 || (*value >= least && *value <= most))) return *value;
  const double meant = value ? *value : written ? written->value * longer_unit(written->unit) : NAN;
  refuse(option, text,
         fmt::format("is neither 0 nor a number of seconds from {:g} to {:g}, or a time with a unit ({})", least, most,
                     units_of(Quantity::time)),
         std::isfinite(meant) ? fmt::format("{:g}", meant < 0 ? 0 : std::clamp(meant, least, most)) : "");
}

CLI::Option* add_read_option(CLI::App& verb, const std::string& names, const std::string& description,
                             std::function<void(const std::string& text, const std::string& option)> read) {
  std::string name = names.substr(names.rfind(',') + 1);  // "-n,--particles"
  const auto callback = [read = std::move(read), name](const CLI::results_t& words) {
    read(words.at(0), name);
    return true;
  };
  return verb.add_option(names, callback, description);
}

CLI::Option* add_choice(CLI::App& verb, const std::string& names, std::string& value,
                        const std::vector<std::string>& choices, const std::string& description) {
  return add_read_option(verb, names, description,
                         [&value, choices](const std::string& text, const std::string& option) {
                           if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
                             refuse(option, text, fmt::format("is none of {}", fmt::join(choices, ", ")),
                                    nearest(text, choices));
                           }
                           value = text;
                         })
      ->type_name(fmt::format("{}", fmt::join(choices, "|")));
}

}  // namespace graze
