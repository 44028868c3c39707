#pragma once
// Gait timing as it is read: normalised, and its flights found.

#include <span>

#include "engine/control/gait_parameters.h"

namespace graze {

/// `touchdown` in [0, 1) up to whole cycles, `duty` in (0, 1], one per foot, at most kMaxFeet; `period` in s, > 0.
GaitTiming make_timing(std::span<const double> touchdown, std::span<const double> duty, double period);

}  // namespace graze
