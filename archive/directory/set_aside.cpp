#include "archive/directory/set_aside.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/manifest.h"
#include "archive/directory/unfinished.h"
#include "archive/files/seal.h"
#include "archive/files/shell_word.h"

namespace graze {
namespace {

/// Whether remove_begun() would remove what has this name, if there is no shard.
bool goes_as_begun(const Directory& directory, const std::string& name) {
  const bool is_folder = S_ISDIR(directory.status(name).st_mode);
  if (name == kDescriptionFile || name == kDescriptionCopy || name == kUnfinishedFile) return !is_folder;
  if (!is_folder || (name != kShardFolder && name != kManifestFolder)) return false;
  const Directory folder = *directory.find(name);
  const std::vector<std::string> names = folder.names();
  return std::all_of(names.begin(), names.end(),
                     [&](const std::string& one) { return final_name(one) && !S_ISDIR(folder.status(one).st_mode); });
}

/// What of a folder would take the place of something if it was moved back, in a message; empty: nothing.
std::string conflict_text(const Directory& directory, const Directory& folder, bool begun_goes) {
  for (const std::string& name : folder.names()) {
    // A lock came with a copy of a campaign that was killed; it locks nobody out and is not moved.
    if (name == kLockFile || !directory.has(name) || (begun_goes && goes_as_begun(directory, name))) continue;
    return fmt::format("{}: is there, and in {}/, too; move one of them out of the campaign's directory",
                       (directory / name).string(), folder.path().filename().string());
  }
  return "";
}

/// Moves all that can be moved, then throws what stood in the way of the first that could not. Throws InputError before
/// anything is moved if it would take the place of something.
void move_back(const Directory& directory) {
  const auto folder = directory.find(kReplacingFolder);
  if (!folder) return;
  if (const std::string text = conflict_text(directory, *folder, false); !text.empty()) throw InputError(text);
  folder->remove(kLockFile);
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
      // The next writer tries again.
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

bool recover_set_aside(const Directory& directory) {
  const ReplacingState state = interrupted_replacing(directory);
  switch (state.what) {
    case Replacing::none:
      return false;
    case Replacing::comes_back:
      return put_back(directory);
    case Replacing::goes:
      drop_set_aside(directory);
      directory.remove_empty(kReplacingFolder);
      return false;
    case Replacing::stuck:
      break;
  }
  throw InputError(state.why);
}

namespace {

/// Whether a file is there, and as it was sealed. Throws UnreadableFile.
bool is_sealed(const Directory& folder, const std::string& name) {
  try {
    const auto file = folder.find_file(name);
    if (file) check_seal(file->number(), folder / name);
    return file.has_value();
  } catch (const UnreadableFile&) {
    throw;  // nothing is known
  } catch (const InputError&) {
    return false;
  }
}

/// Whether the campaign that replaces another has had a shard. What only has the name of one is none: for its sake no
/// campaign goes.
bool had_shard(const Directory& directory) {
  if (!read_manifest(directory).empty()) return true;  // names a shard that was lost since, too
  const std::vector<std::string> names = shard_names(directory);
  const auto folder = directory.find(kShardFolder);
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return is_sealed(*folder, name); });
}

ReplacingState state_of_replaced(const Directory& directory, const Directory& folder) {
  if (!had_shard(directory)) {
    std::string why = conflict_text(directory, folder, shard_names(directory).empty());
    return {why.empty() ? Replacing::comes_back : Replacing::stuck, std::move(why)};
  }
  if (is_sealed(directory, kDescriptionFile) || is_sealed(directory, kDescriptionCopy)) return {Replacing::goes};
  return {
      Replacing::stuck,
      fmt::format("{}: what this campaign has replaced would be removed, but this campaign has no whole description; "
                  "move {}/ out of the campaign's directory",
                  folder.path().string(), kReplacedFolder)};
}

}  // namespace

ReplacingState interrupted_replacing(const Directory& directory) {
  const auto replaced = directory.find(kReplacedFolder), replacing = directory.find(kReplacingFolder);
  if (!replaced && !replacing) return {};
  // Nothing is promised of a campaign that is refused afterwards: these throw what it would be refused for.
  shard_names(directory);
  read_manifest(directory);
  if (replaced && replacing && !replacing->names().empty()) {
    return {Replacing::stuck,
            fmt::format("{}: has both {}/ and {}/, which no --force leaves; move one of them out of the campaign's "
                        "directory",
                        directory.path().string(), kReplacedFolder, kReplacingFolder)};
  }
  const Directory& folder = replaced ? *replaced : *replacing;
  if (const auto foreign = foreign_entry(folder)) {
    return {Replacing::stuck,
            fmt::format("{}: is not part of a campaign that --force set aside; move it out of the campaign's directory",
                        (folder / *foreign).string())};
  }
  if (replaced) return state_of_replaced(directory, folder);
  std::string why = conflict_text(directory, folder, false);
  return {why.empty() ? Replacing::comes_back : Replacing::stuck, std::move(why)};
}

std::string replacing_text(const Directory& directory) {
  const ReplacingState state = interrupted_replacing(directory);
  const std::string path = directory.path().string(), resume = "'graze resume " + shell_path(path) + "'";
  switch (state.what) {
    case Replacing::none:
      return "";
    case Replacing::comes_back:
      return fmt::format(
          "{}: a 'graze run --force' here ended before its campaign had a shard; {} brings back what it was to replace",
          path, resume);
    case Replacing::goes:
      return fmt::format("{}: what this campaign has replaced is in {}/ still; {} removes that", path, kReplacedFolder,
                         resume);
    case Replacing::stuck:
      return fmt::format("{}; {} refuses until then", state.why, resume);
  }
  return "";
}

}  // namespace graze
