#pragma once
// Files of a campaign directory that a newer program has written. They are whole, though this program cannot read them:
// no repair may take them for damaged.

#include <string>
#include <vector>

#include "archive/files/directory.h"

namespace graze {

struct NewerFile {
  std::string name;  // below the directory: "shards/000001.h5"
  std::string why;   // both versions, and what to do
};

/// Descriptions and shards whose seal fits and whose format version is newer than this program's, also those of a
/// campaign that a repair would bring back first (set_aside.h). A child looks at each. Throws InputError.
std::vector<NewerFile> newer_files(const Directory& directory);

/// Throws InputError, which names the first of them, if there are any: before a repair changes anything.
void refuse_newer_files(const Directory& directory);

}  // namespace graze
