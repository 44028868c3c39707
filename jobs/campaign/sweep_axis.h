#pragma once
// `--over PATH=VALUES` of `graze sweep`.

#include <string>

#include "analysis/sweep.h"

namespace graze {

/// The most values along one axis.
inline constexpr std::size_t kMostSweepValues = 1000;

/// Reads "contact.friction=0.2:1:0.1" (first:last:step; the last value counts if a step hits it) or
/// "contact.friction=0.2,0.5,1" (values as scenarios write them; commas within brackets, braces and quotes divide
/// nothing). In first:last:step a unit behind the last number alone is that of all three. Throws InputError with the
/// text, the rule and the nearest right answer.
SweepAxis parse_sweep_axis(const std::string& text);

}  // namespace graze
