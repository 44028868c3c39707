#pragma once
// Whole rows of lanes for policies and trackers: the active lanes are written, the others keep what they have.

#include <algorithm>
#include <cstring>

#include "engine/lanes/block.h"

namespace graze {

/// `to` and `from`: rows of kLanes.
inline void copy_lanes(double* to, const double* from, LaneMask active) {
  if (active.bits() == LaneMask::all().bits()) {
    std::memcpy(to, from, kLanes * sizeof(double));
    return;
  }
  for (int lane = 0; lane < kLanes; ++lane) to[lane] = active[lane] ? from[lane] : to[lane];
}

inline void fill_lanes(double* to, double value, LaneMask active) {
  if (active.bits() == LaneMask::all().bits()) {
    std::fill_n(to, kLanes, value);
    return;
  }
  for (int lane = 0; lane < kLanes; ++lane) to[lane] = active[lane] ? value : to[lane];
}

}  // namespace graze
