#pragma once
// What two campaigns were asked: their scenarios side by side.

#include <map>
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

/// Of the files that two scenarios were read from (ScenarioSource::inputs, contents by path) beside YAML: robots,
/// meshes, tables, controllers. "file gripper.obj", with size and SHA-256. Files are the same if their paths are, or
/// else their names. None where an archive kept no files.
std::vector<ScenarioChange> file_changes(const std::map<std::string, std::string>& a,
                                         const std::map<std::string, std::string>& b);

}  // namespace graze
