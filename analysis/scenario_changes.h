#pragma once
// What two campaigns were asked: their scenarios side by side.

#include <string>
#include <vector>

namespace graze {

/// One value that stands otherwise in b than in a, or in one of them only.
struct ScenarioChange {
  std::string path;        // "task.requirements.upright.tilt.below"
  std::string in_a, in_b;  // as written; empty: it is not there
};

/// Of the texts of two scenarios as archives keep them (CampaignInfo::scenario_text), in the order of a, then what only
/// b has. Name and description do not count, nor does how many particles were drawn and by which seed. Throws
/// InputError if one is no YAML.
std::vector<ScenarioChange> scenario_changes(const std::string& a, const std::string& b);

}  // namespace graze
