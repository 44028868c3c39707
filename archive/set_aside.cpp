#include "archive/set_aside.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "archive/campaign_directory.h"
#include "archive/manifest.h"
#include "archive/shell_word.h"
#include "archive/unfinished.h"

namespace graze {
namespace {

/// Moves all that can be moved, then throws what stood in the way of the first that could not. Throws InputError before
/// anything is moved if it would take the place of something.
void move_back(const Directory& directory) {
  const auto folder = directory.find(kReplacingFolder);
  if (!folder) return;
  for (const std::string& name : folder->names()) {
    if (!directory.has(name)) continue;
    throw InputError(fmt::format("{}: is there, and in {}/, too; move one of them out of the campaign's directory",
                                 (directory / name).string(), kReplacingFolder));
  }
  std::exception_ptr failed;
  for (const std::string& name : folder->names()) {
    try {
      folder->move(name, directory, name);
    } catch (const MachineError&) {
      if (!failed) failed = std::current_exception();
    }
  }
  if (failed) std::rethrow_exception(failed);
  directory.sync();
  directory.remove_empty(kReplacingFolder);
}

}  // namespace

void set_aside(const Directory& directory) {
  const std::vector<std::string> names = directory.names();
  try {
    const Directory folder = directory.make(kReplacingFolder);
    for (const std::string& name : names) {
      if (name != kLockFile) directory.move(name, folder, name);
    }
    folder.sync();
    directory.sync();
    directory.move(kReplacingFolder, directory, kReplacedFolder);
    directory.sync();
  } catch (...) {
    try {
      put_back(directory);
    } catch (const std::exception&) {
      // Whoever writes here next tries again.
    }
    throw;
  }
}

void remove_begun(const Directory& directory) {
  if (!shard_names(directory).empty()) return;
  directory.remove_temporary();
  for (const char* file : {kDescriptionFile, kDescriptionCopy, kUnfinishedFile}) directory.remove(file);
  for (const char* name : {kShardFolder, kManifestFolder}) {
    const auto folder = directory.find(name);
    if (!folder) continue;
    folder->remove_temporary();
    directory.remove_empty(name);  // unless there is something in it
  }
}

bool put_back(const Directory& directory) {
  if (directory.find(kReplacedFolder)) {
    remove_begun(directory);
    directory.sync();
    directory.move(kReplacedFolder, directory, kReplacingFolder);
    directory.sync();
  }
  if (!directory.find(kReplacingFolder)) return false;
  move_back(directory);
  return true;
}

void drop_set_aside(const Directory& directory) { directory.remove_all(kReplacedFolder); }

namespace {

/// Whether there is nothing in a folder, or something that only a campaign leaves: also when its removal was cut short.
bool was_campaign(const Directory& folder) {
  const std::vector<std::string> names = folder.names();
  constexpr std::array kOwn = {kDescriptionFile, kDescriptionCopy, kUnfinishedFile, kShardFolder, kManifestFolder};
  return names.empty() || std::any_of(names.begin(), names.end(), [&](const std::string& name) {
           return std::find(kOwn.begin(), kOwn.end(), name) != kOwn.end();
         });
}

}  // namespace

bool recover_set_aside(const Directory& directory) {
  if (interrupted_replacing(directory) == Replacing::goes) {
    const auto folder = directory.find(kReplacedFolder);
    if (folder && !was_campaign(*folder)) {
      throw InputError(fmt::format(
          "{}: a campaign that was replaced would be removed from here, and this is none; move it out of the "
          "campaign's directory",
          (directory / kReplacedFolder).string()));
    }
    drop_set_aside(directory);
    return false;
  }
  return put_back(directory);
}

Replacing interrupted_replacing(const Directory& directory) {
  if (directory.find(kReplacedFolder)) {
    // A shard that was lost since is still in the manifest.
    const bool had_shard = !shard_names(directory).empty() || !read_manifest(directory).empty();
    return had_shard ? Replacing::goes : Replacing::comes_back;
  }
  return directory.find(kReplacingFolder) ? Replacing::comes_back : Replacing::none;
}

std::string replacing_text(const Directory& directory) {
  const std::string resume = "'graze resume " + shell_word(directory.path().string()) + "'";
  switch (interrupted_replacing(directory)) {
    case Replacing::none:
      return "";
    case Replacing::comes_back:
      return fmt::format(
          "a 'graze run --force' here ended before its campaign had a shard; {} brings back what it was to replace",
          resume);
    case Replacing::goes:
      return fmt::format("what this campaign has replaced is in {}/ still; {} removes that", kReplacedFolder, resume);
  }
  return "";
}

}  // namespace graze
