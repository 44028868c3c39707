#pragma once
// Every section of the scenario format with its description: what readers allow and take by default, and what help,
// schema and docs tell. Policies, trackers, witnesses, distributions and shapes describe themselves in their own files.

#include <map>
#include <string>
#include <vector>

#include "engine/settings/description.h"

namespace graze {

/// s: by default a short contact phase carries at least what the robot's weight makes in this time. Our choice, from
/// the shipped quadrupeds, of whose phases one in a hundred carries less.
inline constexpr double kPhaseWeightTime = 1e-4;

/// By section name ("scenario", "robot", "time", …).
const std::map<std::string, Description>& scenario_sections();
const Description& section_of(const std::string& name);
/// Of a section: what its reader allows.
std::vector<std::string> keys_of(const std::string& section);

/// The one-key maps of the format: shapes of objects and distributions, in the order in which they are offered.
std::vector<std::string> shape_names();
std::vector<std::string> distribution_names();

}  // namespace graze
