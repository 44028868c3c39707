#pragma once
// Values as JSON.

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "analysis/score.h"

namespace graze {

/// JSON has no NaN and no infinity: null.
inline nlohmann::ordered_json json_of(double x) { return std::isfinite(x) ? nlohmann::ordered_json(x) : nullptr; }

inline nlohmann::ordered_json json_of(const Interval& interval) {
  return nlohmann::ordered_json::array({json_of(interval.low), json_of(interval.high)});
}

/// An array of function(value) for each.
template <class T, class Function>
nlohmann::ordered_json json_list(const std::vector<T>& values, const Function& function) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const T& value : values) out.push_back(function(value));
  return out;
}

}  // namespace graze
