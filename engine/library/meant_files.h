#pragma once
// Which files of controllers a campaign in this process began with. Policies are made anew in its course, and what
// stands on the disk then is not what was meant only because it stands there.

#include <map>
#include <string>

namespace graze {

/// SHA-256 by absolute path. For the whole process, before its threads begin; a later call takes the place of an
/// earlier one. Of other files the hash holds that they had when the scenario was read.
void mean_library_files(std::map<std::string, std::string> sums);

}  // namespace graze
