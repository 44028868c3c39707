#pragma once
// `uncertain` of a scenario -> ParameterSpace: which numbers of the world are drawn, and how.

#include <map>
#include <string>
#include <vector>

#include "engine/model/fabrication.h"
#include "engine/settings/settings.h"
#include "sampling/design.h"
#include "scenarios/world_reader.h"

namespace graze {

/// Reads every pattern of `uncertain`; for the same parameter a later entry replaces an earlier one whole, and all of
/// them the distributions that stand in the world itself. Parameters come out in the table's order. `control_step` (s):
/// how often jitter is drawn, which a noise density needs. `extent`: robot_extent(), to doubt widths by. `followed`:
/// joints with <mimic>, which lack some parameters, and what each follows. Throws InputError.
ParameterSpace read_uncertain(const Settings& scenario, const ParameterTable& table,
                              const std::vector<InlineSpread>& in_world, double control_step, const Vec3& extent,
                              const std::map<std::string, std::string>& followed = {});

}  // namespace graze
