#pragma once
// What --set says and hardly means.

#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// Warns of overrides that change nothing, as a nominal value of what every particle draws for itself, or that may
/// change nothing, as a setting of a controller from outside beside those that stand in the file.
void doubt_overrides(const std::vector<Override>& overrides, const Scenario& scenario);

/// Warns of paths into the settings of a controller from outside that name none of those that stand in the file.
/// `option`: that gave them, "--over".
void doubt_settings(const std::string& option, const std::vector<std::string>& paths, const Scenario& scenario);

}  // namespace graze
