#pragma once
// Globs against lists of names, with an error that names the nearest when nothing matches.

#include <string>
#include <vector>

#include "engine/model/model.h"
#include "engine/settings/settings.h"

namespace graze {

/// Indices of the `names` that the glob matches, ascending. None: fails at `where` with the nearest name; `what` is
/// what they name ("link", "joint").
std::vector<int> match_names(const Settings& where, const std::string& pattern, const std::vector<std::string>& names,
                             const std::string& what);

std::vector<std::string> frame_names(const Model& model);   // links, and movable objects
std::vector<std::string> driven_names(const Model& model);  // joints, in the order of Model::actuated
std::vector<std::string> part_names(const Model& model);    // colliders and their links, each once

}  // namespace graze
