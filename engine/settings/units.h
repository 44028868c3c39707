#pragma once
// Numbers as people write them: "2.5 mm", "75 %", "1e-3".

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

/// "2.5 mm" -> 2.5 and "mm". Nothing if the text does not begin with a number.
struct WrittenNumber {
  double value = 0;
  std::string_view unit;  // trimmed; may be empty
};
std::optional<WrittenNumber> split_number(std::string_view text);
std::optional<WrittenNumber> split_number(std::string&&) = delete;  // the unit is a view of it

/// `value` times `unit` in SI, nothing if the unit does not measure `quantity`. The empty unit is SI. Decimal prefixes
/// divide, so that "2.5 mm" is the double nearest to 0.0025.
std::optional<double> to_si(Quantity quantity, double value, std::string_view unit);
bool is_unit(std::string_view word);  // of any quantity

/// Why a number that was written with this unit is hardly what was meant, and what may have been: "is 14.3 turns; did
/// you mean -90 deg?". Empty: nothing strange about it. Only numbers without a unit or with the SI unit are doubted.
std::string unlikely(Quantity quantity, double value, std::string_view unit);

/// "; did you mean 55 %?" for the text "55", where a fraction was wanted. Empty: it has a unit, or is no percentage.
std::string percent_meant(std::string_view text);

/// True for a number that is written without a unit: only such are doubted by rules that a written unit should
/// overrule.
bool is_bare(const Settings& value);

/// "; did you mean 5 cm?": for a bare number, the first unit after the SI one in which it `fits`, which is asked with
/// the SI value. Empty: it is not bare, or fits in none.
std::string unit_meant(const Settings& value, Quantity quantity, const std::function<bool(double)>& fits);

/// What numbers measure, in the order of Quantity: "dimensionless", "length", ….
const std::vector<std::string>& quantity_names();

/// What may stand behind a number, the SI unit first: "m", "cm", "mm", "in"; behind a dimensionless one "%".
std::vector<std::string> unit_names(Quantity quantity);
/// The same as "m, cm, mm, in", for messages.
std::string units_of(Quantity quantity);

/// An SI value as it was typed elsewhere: -2.967 in the unit of the text "200 deg" is "-170 deg"; without a unit there,
/// or with one of another quantity, it is "-2.967 rad".
std::string in_unit_of(const Settings& typed, Quantity quantity, double value);

/// The text with its decimals rounded to six significant digits: "normal(mean=2700.0000036)" -> "normal(mean=2700)".
std::string rounded_numbers(const std::string& text);

}  // namespace graze
