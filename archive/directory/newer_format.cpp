#include "archive/directory/newer_format.h"

#include <fmt/format.h>

#include <iterator>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/set_aside.h"
#include "archive/files/seal.h"
#include "archive/hdf5/file_driver.h"
#include "archive/hdf5/reading_child.h"
#include "archive/schema/info.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFound = "newer format: ";  // before what a child has found, and no other message of one

/// The files of one campaign.
void list_files(const Directory& directory, std::vector<fs::path>& out) {
  for (const char* name : {kDescriptionFile, kDescriptionCopy}) {
    if (directory.has_file(name)) out.push_back(directory / name);
  }
  const auto shards = directory.find(kShardFolder);
  if (!shards) return;
  for (const std::string& name : shard_names(directory)) {
    if (shards->has_file(name)) out.push_back(*shards / name);
  }
}

Descriptor open_within(const fs::path& path, const Directory& directory) {
  const fs::path name = path.lexically_relative(directory.path());
  return open_archive_file(path, static_cast<int>(std::distance(name.begin(), name.end())));
}

bool is_sealed(const fs::path& path, const Directory& directory) {
  try {
    check_seal(open_within(path, directory).number(), path);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

/// A small file whose seal does not fit is damaged, whatever it seems to tell, and HDF5 may be busy with it for long.
bool is_worth_a_look(const fs::path& path, const Directory& directory) {
  constexpr std::uintmax_t kSmall = 1 << 20;  // bytes: descriptions
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error || size > kSmall || is_sealed(path, directory);
}

/// Throws kFound and what the file tells, if it is newer. What else may be wrong with it, whoever reads it tells.
void look_at(const fs::path& path, const Directory& directory) {
  std::string why;
  if (!is_worth_a_look(path, directory)) return;
  try {
    const Descriptor file = open_within(path, directory);
    const hdf5::Lock lock;
    why = newer_format(hdf5::open_for_reading(file.number()));
  } catch (const hdf5::Error&) {
    return;
  } catch (const InputError&) {
    return;
  }
  if (!why.empty()) throw InputError(kFound + why);
}

}  // namespace

std::vector<NewerFile> newer_files(const Directory& directory) {
  std::vector<fs::path> files;
  list_files(directory, files);
  if (interrupted_replacing(directory).what == Replacing::comes_back) {
    for (const char* name : {kReplacedFolder, kReplacingFolder}) {
      if (const auto folder = directory.find(name)) list_files(*folder, files);
    }
  }
  std::vector<NewerFile> out;
  for (const Unreadable& one : unreadable(files, [&](const fs::path& path) { look_at(path, directory); })) {
    const fs::path& path = files[one.file];
    if (!one.why.starts_with(kFound) || !is_sealed(path, directory)) continue;
    out.push_back(
        {path.lexically_relative(directory.path()).string(), one.why.substr(std::char_traits<char>::length(kFound))});
  }
  return out;
}

void refuse_newer_files(const Directory& directory) {
  const std::vector<NewerFile> found = newer_files(directory);
  if (found.empty()) return;
  const std::string more = found.size() == 1 ? "" : fmt::format(", as have {} more files here", found.size() - 1);
  throw InputError(
      fmt::format("{}: {}{}; nothing was changed", (directory / found[0].name).string(), found[0].why, more));
}

}  // namespace graze
