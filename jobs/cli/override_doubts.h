#pragma once
// What --set says and hardly means.

#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// Warns of overrides that change nothing, as a nominal value of what every particle draws for itself, or that may
/// change nothing, as a setting of a controller from outside beside those that stand in the file.
void doubt_overrides(const std::vector<Override>& overrides, const Scenario& scenario);

}  // namespace graze
