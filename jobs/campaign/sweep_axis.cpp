#include "jobs/campaign/sweep_axis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "engine/settings/units.h"

namespace graze {
namespace {

constexpr double kHit = 1e-9;  // of a step: the last value counts

[[noreturn]] void refuse(const std::string& text, const std::string& rule, const std::string& right = "") {
  throw InputError(fmt::format("--over {}: {}{}{}", clipped(text, 120), rule,
                               right.empty() ? "" : "; nearest right answer: --over ", right));
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// The parts between separators that stand outside of brackets, braces and quotes.
std::vector<std::string> parts(const std::string& text, char separator) {
  std::vector<std::string> out(1);
  int depth = 0;
  char quote = 0;
  for (const char c : text) {
    if (quote != 0) {
      quote = c == quote ? 0 : quote;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == separator && depth == 0) {
      out.emplace_back();
      continue;
    }
    out.back() += c;
  }
  for (std::string& part : out) part = trimmed(part);
  return out;
}

/// What all units measure, the first such quantity; a number without a unit may be of any.
std::optional<Quantity> common_quantity(const std::vector<WrittenNumber>& numbers) {
  for (std::size_t q = 0; q < quantity_names().size(); ++q) {
    const auto quantity = static_cast<Quantity>(q);
    if (std::all_of(numbers.begin(), numbers.end(),
                    [&](const WrittenNumber& one) { return to_si(quantity, one.value, one.unit).has_value(); })) {
      return quantity;
    }
  }
  return std::nullopt;
}

std::string number_with_unit(double value, const std::string& unit) {
  // Twelve digits: 0.1 + 2 * 0.1 is written as 0.3.
  return fmt::format("{:.12g}{}{}", value, unit.empty() ? "" : " ", unit);
}

struct Range {
  std::array<double, 3> numbers;  // first, last, step, in `unit`
  std::string unit;
};

/// The three numbers in one unit: that which all are written in, else the SI unit.
Range read_range(const std::string& text, const std::string& path, std::vector<std::string> words) {
  std::vector<WrittenNumber> numbers;
  for (const std::string& word : words) {
    const auto number = split_number(word);
    if (!number || !std::isfinite(number->value) || (!number->unit.empty() && !is_unit(number->unit))) {
      refuse(text, fmt::format("'{}' is no number with or without a unit; a range is FIRST:LAST:STEP", word));
    }
    numbers.push_back(*number);
  }
  if (numbers[0].unit.empty() && numbers[1].unit.empty()) numbers[0].unit = numbers[1].unit = numbers[2].unit;
  if (numbers[0].unit == numbers[1].unit && numbers[0].unit == numbers[2].unit) {
    return {{numbers[0].value, numbers[1].value, numbers[2].value}, std::string(numbers[0].unit)};
  }
  const auto quantity = common_quantity(numbers);
  if (!quantity) {
    refuse(text, "the units of a range measure one quantity",
           fmt::format("{}={}:{}:{}", path, words[0], number_with_unit(numbers[1].value, std::string(numbers[0].unit)),
                       number_with_unit(numbers[2].value, std::string(numbers[0].unit))));
  }
  Range out{{}, *quantity == Quantity::dimensionless ? "" : std::string(unit_of(*quantity))};
  for (std::size_t i = 0; i < 3; ++i) out.numbers[i] = *to_si(*quantity, numbers[i].value, numbers[i].unit);
  return out;
}

SweepAxis range_axis(const std::string& text, const std::string& path, const std::vector<std::string>& words) {
  const Range range = read_range(text, path, words);
  const double first = range.numbers[0], last = range.numbers[1], step = range.numbers[2];
  const auto right = [&](double to, double by) {
    return fmt::format("{}={}:{}:{}", path, number_with_unit(first, range.unit), number_with_unit(to, range.unit),
                       number_with_unit(by, range.unit));
  };
  if (first == last) {
    refuse(text, "is one value; a sweep has two or more",
           right(first + (step != 0 ? std::abs(step) : 1), std::abs(step != 0 ? step : 1)));
  }
  if (step == 0) refuse(text, "a step of 0 never comes to the last value", right(last, (last - first) / 10));
  if ((step > 0) != (last > first)) {
    refuse(text, fmt::format("a step of {} leads away from the last value", number_with_unit(step, range.unit)),
           right(last, -step));
  }
  const double count = std::floor((last - first) / step + kHit) + 1;
  if (!std::isfinite(count)) refuse(text, "the range is wider than a number holds");
  if (count > static_cast<double>(kMostSweepValues)) {
    refuse(text, fmt::format("{:.4g} values; at most {}", count, kMostSweepValues),
           right(last, (last - first) / (static_cast<double>(kMostSweepValues) / 10)));
  }
  if (count < 2) refuse(text, "is one value; a sweep has two or more", right(last, last - first));
  SweepAxis out;
  out.path = path;
  out.unit = range.unit;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    const double value = first + i * step;  // near 0 of a range across it, what rounding left
    out.texts.push_back(number_with_unit(i > 0 && std::abs(value) < kHit * std::abs(step) ? 0.0 : value, out.unit));
    out.values.push_back(split_number(out.texts.back())->value);  // what is simulated
    if (i > 0 && out.texts[static_cast<std::size_t>(i)] == out.texts[static_cast<std::size_t>(i) - 1]) {
      refuse(text, "a step that twelve digits do not tell from none", right(last, (last - first) / 10));
    }
  }
  return out;
}

/// Numbers of one quantity are numbers in the unit of the first; all else is told apart by its place.
void add_numbers(SweepAxis& axis) {
  std::vector<WrittenNumber> numbers;
  for (const std::string& word : axis.texts) {
    const auto number = split_number(word);
    if (number && std::isfinite(number->value) && (number->unit.empty() || is_unit(number->unit))) {
      numbers.push_back(*number);
    }
  }
  const auto quantity = numbers.size() == axis.texts.size() ? common_quantity(numbers) : std::nullopt;
  axis.numeric = quantity.has_value();
  if (!quantity) {
    for (std::size_t i = 0; i < axis.texts.size(); ++i) axis.values.push_back(static_cast<double>(i));
    return;
  }
  const bool one_unit = std::all_of(numbers.begin(), numbers.end(),
                                    [&](const WrittenNumber& one) { return one.unit == numbers[0].unit; });
  axis.unit = one_unit ? std::string(numbers[0].unit) : std::string(unit_of(*quantity));
  for (const WrittenNumber& one : numbers) {
    axis.values.push_back(one_unit ? one.value : *to_si(*quantity, one.value, one.unit));
  }
}

SweepAxis list_axis(const std::string& text, const std::string& path, const std::vector<std::string>& words) {
  SweepAxis out;
  out.path = path;
  out.texts = words;
  for (const std::string& word : words) {
    if (word.empty()) refuse(text, "an empty value; values are V1,V2,… or FIRST:LAST:STEP");
  }
  if (words.size() < 2) refuse(text, "is one value; a sweep has two or more");
  if (words.size() > kMostSweepValues) {
    refuse(text, fmt::format("{} values; at most {}", words.size(), kMostSweepValues));
  }
  const std::set<std::string> different(words.begin(), words.end());
  if (different.size() < words.size()) {
    refuse(text, "the same value twice",
           different.size() > 1 ? fmt::format("{}={}", path, fmt::join(different, ",")) : "");
  }
  add_numbers(out);
  const std::set<double> numbers(out.values.begin(), out.values.end());
  if (out.numeric && numbers.size() < out.values.size()) refuse(text, "the same value twice, in other words");
  return out;
}

}  // namespace

SweepAxis parse_sweep_axis(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string path = trimmed(text.substr(0, equals == std::string::npos ? 0 : equals));
  if (path.empty())
    refuse(text, "not of the form PATH=FIRST:LAST:STEP or PATH=V1,V2,…, e.g. uncertain.contact.friction=0.2:1:0.1");
  if (path == "sampling" || path.starts_with("sampling.")) {
    refuse(text,
           "says which particles are drawn, and a sweep compares the same ones; run the scenario with each, and 'graze "
           "compare' the campaigns");
  }
  const std::string values = trimmed(text.substr(equals + 1));
  if (values.empty()) refuse(text, "has no values", path + "=0:1:0.1");
  const std::vector<std::string> range = parts(values, ':');
  if (range.size() == 1) return list_axis(text, path, parts(values, ','));
  if (range.size() != 3) {
    refuse(text, fmt::format("{} numbers; a range is FIRST:LAST:STEP", range.size()),
           fmt::format("{}={}:{}:{}", path, range[0], range[1], "STEP"));
  }
  return range_axis(text, path, range);
}

}  // namespace graze
