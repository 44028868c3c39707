#pragma once
// Every key of the scenario format, section by section. The readers allow these and no others, and a test holds the
// JSON Schema (data/scenario.schema.json, one definition per section) to the same lists.

#include <map>
#include <string>
#include <vector>

namespace graze {

/// Keys by section name ("scenario", "robot", "normal", "tilt", …).
const std::map<std::string, std::vector<std::string>>& scenario_keys();
const std::vector<std::string>& keys_of(const std::string& section);

/// The one-key maps of the format: shapes of objects and distributions, in the order in which they are offered.
const std::vector<std::string>& shape_names();
const std::vector<std::string>& distribution_names();

}  // namespace graze
