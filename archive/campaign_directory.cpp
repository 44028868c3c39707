#include "archive/campaign_directory.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/file_driver.h"
#include "archive/files.h"
#include "archive/info.h"
#include "archive/set_aside.h"
#include "archive/unfinished.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifestName = "shards";

bool is_archive_file(const fs::path& path) {
  return path.extension() == ".h5" || (path.extension() == ".tmp" && path.stem().extension() == ".h5");
}

bool is_manifest_file(const fs::path& path) {
  return path.extension() == ".jsonl" || (path.extension() == ".tmp" && path.stem().extension() == ".jsonl");
}

/// The first entry that no campaign has: --force must never remove somebody's other files.
std::optional<fs::path> foreign_entry(const fs::path& directory) {
  for (const fs::path& entry : entries_of(directory)) {
    const fs::path name = entry.filename();
    if (name == kLockFile || name == kUnfinishedFile) continue;
    if (name != kShardFolder && name != kDamagedFolder && name != kManifestFolder) {
      if (entry.stem().stem() != fs::path(kDescriptionFile).stem() || !is_archive_file(entry)) return entry;
      continue;
    }
    for (const fs::path& one : entries_of(entry)) {
      const bool ours = name == kManifestFolder ? is_manifest_file(one) : is_archive_file(one);
      if (!ours || !fs::is_regular_file(one)) return one;
    }
  }
  return std::nullopt;
}

/// Refuses at once what is somebody else's.
void check_place(const fs::path& path) {
  if (!fs::exists(fs::symlink_status(path))) return;
  if (!fs::is_directory(path)) {
    throw InputError(fmt::format("{}: is a file; a campaign needs a directory of its own", path.string()));
  }
  if (const auto writer = writer_of(path)) {
    throw MachineError(fmt::format("{}: {} is writing here", path.string(), *writer));
  }
}

/// What there may be of a campaign that was killed before it was described.
bool begun_only(const fs::path& entry) {
  const fs::path name = entry.filename();
  if (name == kLockFile || name == std::string(kDescriptionFile) + ".tmp") return true;
  return name == kShardFolder && entries_of(entry).empty();
}

/// Whether a campaign may be made in a directory that is locked; true if something there has to be set aside first.
bool must_replace(const fs::path& path, bool force) {
  const std::vector<fs::path> entries = entries_of(path);
  if (std::all_of(entries.begin(), entries.end(), begun_only)) return false;
  if (!force) {
    throw InputError(
        fmt::format("{}: exists and is not empty; choose another --output or give --force", path.string()));
  }
  if (const auto foreign = foreign_entry(path)) {
    throw InputError(fmt::format("{}: is not replaced, even by --force: {} is not part of a campaign", path.string(),
                                 foreign->string()));
  }
  return true;
}

/// The number in a shard's name: 17 of 000017.h5 and of r00003-000017.h5.
int shard_number(const fs::path& shard) {
  const std::string name = shard.stem().string();
  return std::atoi(name.c_str() + (name.rfind('-') + 1));  // npos + 1 is 0
}

void describe(const fs::path& directory, const CampaignInfo& info, bool complete) {
  publish_hdf5(directory / kDescriptionFile,
               [&](const hdf5::Handle& file) { write_info(file, info, Layout::directory, complete); });
}

}  // namespace

std::vector<fs::path> entries_of(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  if (error) throw InputError(fmt::format("{}: cannot be listed: {}", directory.string(), error.message()));
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::vector<fs::path> shard_files(const fs::path& directory) {
  std::vector<fs::path> files;
  const fs::path folder = directory / kShardFolder;
  if (!fs::exists(folder)) return files;
  for (const fs::path& entry : entries_of(folder)) {
    if (entry.extension() == ".h5") files.push_back(entry);
  }
  return files;
}

CampaignDirectory::CampaignDirectory(fs::path directory, const CampaignInfo& info, bool force)
    : path_(std::move(directory)), info_(info) {
  if (!path_.has_filename()) path_ = path_.parent_path();  // "curb.graze/"
  check_policy_names(info.policies);
  check_place(path_);
  made_ = make_directory(path_);
  try {
    lock_ = std::make_shared<const DirectoryLock>(path_);
  } catch (...) {
    std::error_code error;
    if (made_) fs::remove(path_, error);  // unless another holds it by now
    throw;
  }
  recover_set_aside(path_);
  const bool replaces = must_replace(path_, force);
  try {
    if (replaces) set_aside(path_);
    replaces_ = replaces;
    make_directory(path_ / kShardFolder);
    describe(path_, info, false);
  } catch (...) {
    restore();
    throw;
  }
}

CampaignDirectory::CampaignDirectory(fs::path directory, const CampaignInfo& info, CampaignWriter::Existing existing)
    : path_(std::move(directory)), info_(info), kept_(true), lock_(std::move(existing.lock)) {
  if (!path_.has_filename()) path_ = path_.parent_path();
  check_policy_names(info.policies);
  if (!lock_) lock_ = std::make_shared<const DirectoryLock>(path_);
  recover_set_aside(path_);
  forget_unfinished(path_);
  // Names are not used again, not even those of shards that are gone.
  const auto taken = [&](const fs::path& shard) { shards_ = std::max(shards_, shard_number(shard)); };
  for (const fs::path& shard : shard_files(path_)) taken(shard);
  for (const auto& [shard, entry] : read_manifest(path_)) taken(shard);
  describe(path_, info_, false);
}

CampaignDirectory::CampaignDirectory(fs::path directory, const CampaignInfo& info, CampaignWriter::Member member)
    : path_(std::move(directory)),
      info_(info),
      kept_(true),
      prefix_(fmt::format("r{:05}-", member.rank)),
      shards_(member.shards) {
  member_.emplace(path_);
}

CampaignDirectory::~CampaignDirectory() {
  if (kept_) return;
  try {
    // There is something to resume.
    if (!shard_files(path_).empty() || (!replaces_ && !read_unfinished(path_).empty())) return;
  } catch (const InputError&) {
    return;
  }
  restore();
}

void CampaignDirectory::restore() noexcept {
  try {
    remove_empty(path_);
    if (replaces_) put_back(path_);
  } catch (const std::exception&) {
    // What is left over is put back by whoever writes here next.
  }
  lock_.reset();
  std::error_code error;
  if (made_) fs::remove(path_, error);
}

void CampaignDirectory::keep() {
  kept_ = true;
  if (replaces_) drop_set_aside(path_);
  replaces_ = false;
}

void CampaignDirectory::add_shard(ShardBuffer shard) {
  const ShardEntry entry = shard.publish(path_ / kShardFolder / fmt::format("{}{:06}.h5", prefix_, ++shards_), info_);
  keep();
  if (!manifest_) manifest_.emplace(path_, prefix_ + kManifestName);
  manifest_->append(entry);
}

void CampaignDirectory::complete(std::uint64_t answered_at) {
  manifest_.reset();
  replace_manifest(path_, read_manifest(path_));
  info_.until.answered_at = answered_at;
  if (answered_at > 0) info_.particles = answered_at;
  describe(path_, info_, true);
  keep();
}

}  // namespace graze
