#pragma once
// Numbers that every folder has names for.

#include <limits>

namespace graze {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace graze
