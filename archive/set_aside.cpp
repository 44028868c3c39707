#include "archive/set_aside.h"

#include <fmt/format.h>

#include <vector>

#include "archive/campaign_directory.h"
#include "archive/files.h"
#include "archive/unfinished.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

void move(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) throw MachineError(fmt::format("{}: cannot be moved: {}", from.string(), error.message()));
}

void move_back(const fs::path& directory) {
  const fs::path folder = directory / kReplacingFolder;
  for (const fs::path& entry : entries_of(folder)) move(entry, directory / entry.filename());
  std::error_code error;
  fs::remove(folder, error);
}

}  // namespace

void set_aside(const fs::path& directory) {
  const fs::path folder = directory / kReplacingFolder;
  const std::vector<fs::path> entries = entries_of(directory);
  make_directory(folder);
  try {
    for (const fs::path& entry : entries) {
      if (entry.filename() != kLockFile) move(entry, folder / entry.filename());
    }
    move(folder, directory / kReplacedFolder);
  } catch (const MachineError&) {
    move_back(directory);
    throw;
  }
}

void remove_empty(const fs::path& directory) {
  std::error_code error;
  for (const char* file : {kDescriptionFile, kUnfinishedFile}) fs::remove(directory / file, error);
  for (const char* folder : {kShardFolder, kManifestFolder}) {
    if (!fs::exists(directory / folder)) continue;
    for (const fs::path& entry : entries_of(directory / folder)) {
      if (entry.extension() == ".tmp") fs::remove(entry, error);
    }
    fs::remove(directory / folder, error);  // unless there is something in it
  }
}

bool put_back(const fs::path& directory) {
  if (fs::exists(directory / kReplacedFolder)) {
    remove_empty(directory);
    move(directory / kReplacedFolder, directory / kReplacingFolder);
  }
  if (!fs::exists(directory / kReplacingFolder)) return false;
  move_back(directory);
  return true;
}

void drop_set_aside(const fs::path& directory) {
  std::error_code error;
  fs::remove_all(directory / kReplacedFolder, error);
}

bool recover_set_aside(const fs::path& directory) {
  if (fs::exists(directory / kReplacedFolder) && !shard_files(directory).empty()) {
    drop_set_aside(directory);
    return false;
  }
  return put_back(directory);
}

}  // namespace graze
