#pragma once
// Whether campaigns can be kept in a folder: what they need of its file system is tried there, in a folder of its own
// that is removed again.

#include <filesystem>
#include <string>
#include <vector>

#include "jobs/machine/finding.h"

namespace graze {

/// The file system that a path lies on, by a table as /proc/self/mountinfo has it.
struct Mount {
  std::string type;     // "ext4", "nfs4"; empty: not known
  std::string options;  // of the file system and of the mount, with commas
  std::string point;    // where it is mounted
};
Mount mount_of(const std::filesystem::path& path, const std::string& table);

/// File system, free space, and whether writing, locks and renames work there. Throws InputError if it is no folder.
std::vector<Finding> folder_findings(const std::filesystem::path& folder);

}  // namespace graze
