#include "archive/directory/campaign_directory.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "archive/directory/campaign_files.h"
#include "archive/directory/set_aside.h"
#include "archive/directory/unfinished.h"
#include "archive/files/files.h"
#include "archive/files/shell_word.h"
#include "archive/hdf5/file_driver.h"
#include "archive/schema/info.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifestName = "shards";

/// Whether a campaign has a file of this name, or did while that was written, in the folder `within` ("": its own).
bool is_campaign_file(const std::string& within, const std::string& name) {
  const std::string end = final_name(name).value_or(name);
  if (within == kManifestFolder) return end.ends_with(".jsonl");
  if (within == kDamagedFolder && end.ends_with(".jsonl")) return true;
  if (!within.empty()) return end.ends_with(".h5");
  return end == kDescriptionFile || end == kDescriptionCopy || end == kLockFile || end == kUnfinishedFile;
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

/// What a part of a campaign finds in its place if that is a part of the same campaign, which nobody means to lose;
/// empty: it is something else.
std::string part_text(const Directory& directory, const CampaignInfo& info) {
  const std::string path = directory.path().string();
  if (info.part.end == 0) return "";
  for (const DescriptionFile& file : description_files(directory)) {
    if (!file.stored) continue;
    const CampaignInfo& there = file.stored->info;
    if (there.part.end == 0 || !campaign_difference(there, info).empty()) return "";
    const bool same = there.part.begin == info.part.begin && there.part.end == info.part.end;
    return same ? fmt::format(
                      "{}: holds this part already; 'graze resume {}' goes on with it; to begin it anew choose "
                      "another --output or give --force",
                      path, shell_path(path))
                : fmt::format(
                      "{}: holds another part of the same campaign, particles {} to {}; choose another "
                      "--output for particles {} to {}",
                      path, there.part.begin, there.part.end - 1, info.part.begin, info.part.end - 1);
  }
  return "";
}

/// Whether a campaign may be made in a directory that is locked; true if something there has to be set aside first.
bool must_replace(const Directory& directory, const CampaignInfo& info, bool force) {
  if (only_begun(directory)) return false;
  const std::string path = directory.path().string();
  if (!force) {
    if (const std::string text = part_text(directory, info); !text.empty()) throw InputError(text);
    throw InputError(fmt::format("{}: exists and is not empty; choose another --output or give --force", path));
  }
  if (directory.has(kReplacedFolder)) {
    throw MachineError(fmt::format("{}: is left over and cannot be removed", (directory / kReplacedFolder).string()));
  }
  if (const auto foreign = foreign_entry(directory)) {
    throw InputError(fmt::format("{}: is not replaced, even by --force: {} is not part of a campaign", path,
                                 (directory / *foreign).string()));
  }
  return true;
}

/// The number in a shard's name: 17 of 000017.h5 and of r00003-000017.h5.
int shard_number(const std::string& shard) {
  constexpr long kMost = 999'999'999;  // a greater one is not ours, and leaves room to count on
  const std::string name = fs::path(shard).stem().string();
  const long number = std::strtol(name.c_str() + (name.rfind('-') + 1), nullptr, 10);  // npos + 1 is 0
  return number > 0 && number <= kMost ? static_cast<int>(number) : 0;
}

/// The description, then its copy: a kill in between leaves the copy as it was before, and readers ask the first.
void describe(const Directory& directory, const CampaignInfo& info, bool complete) {
  publish_hdf5_twice(directory, kDescriptionFile, kDescriptionCopy,
                     [&](const hdf5::Handle& file) { write_info(file, info, Layout::directory, complete); });
}

}  // namespace

std::vector<std::string> shard_names(const Directory& directory) {
  const auto folder = directory.find(kShardFolder);
  if (!folder) return {};
  std::vector<std::string> names = folder->names();
  std::erase_if(names, [](const std::string& name) { return !name.ends_with(".h5"); });
  return names;
}

std::vector<fs::path> shard_files(const Directory& directory) {
  std::vector<fs::path> files;
  for (const std::string& name : shard_names(directory)) files.push_back(directory / kShardFolder / name);
  return files;
}

std::optional<std::string> foreign_entry(const Directory& directory) {
  for (const std::string& name : directory.names()) {
    if (name != kShardFolder && name != kDamagedFolder && name != kManifestFolder) {
      if (!is_campaign_file("", name) || !directory.has_file(name)) return name;
      continue;
    }
    if (!S_ISDIR(directory.status(name).st_mode)) return name;
    const Directory folder = *directory.find(name);
    for (const std::string& one : folder.names()) {
      // What was put aside as damaged may be anything.
      if (!is_campaign_file(name, one) || (name != kDamagedFolder && !folder.has_file(one))) return name + "/" + one;
    }
  }
  return std::nullopt;
}

bool only_begun(const Directory& directory) {
  const std::vector<std::string> names = directory.names();
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    if (name == kLockFile) return true;
    if (name == kShardFolder) return directory.find(name)->names().empty();
    const auto end = final_name(name);
    return end && (*end == kDescriptionFile || *end == kDescriptionCopy);
  });
}

namespace {

/// Makes the directory of a new campaign, or finds it; `made` says which.
Directory make_place(const fs::path& path, const CampaignInfo& info, bool& made) {
  check_policy_names(info.policies);
  check_place(path);
  made = make_directory(path);
  try {
    return Directory(path);
  } catch (const InputError& error) {
    if (made) rmdir(path.c_str());
    throw MachineError(error.what());
  }
}

/// "curb.graze/" is "curb.graze".
fs::path without_slash(const fs::path& path) { return path.has_filename() ? path : path.parent_path(); }

std::shared_ptr<const DirectoryLock> lock_of(ExistingCampaign existing, const fs::path& path) {
  return existing.lock ? std::move(existing.lock) : std::make_shared<const DirectoryLock>(without_slash(path));
}

}  // namespace

CampaignDirectory::CampaignDirectory(const fs::path& path, const CampaignInfo& info, bool force)
    : info_(info), directory_(make_place(without_slash(path), info, made_)) {
  bool ours = false;  // all that is there; an old campaign lies aside
  try {
    lock_ = std::make_shared<const DirectoryLock>(directory_);
    if (!force) must_replace(directory_, info, force);  // a refused writer changes nothing
    recover_set_aside(directory_);
    const bool replaces = must_replace(directory_, info, force);
    replaces ? set_aside(directory_) : directory_.remove_temporary();
    replaces_ = replaces;
    ours = true;
    shard_folder_ = directory_.make(kShardFolder);
    describe(directory_, info, false);
  } catch (...) {
    ours ? restore() : leave();
    throw;
  }
}

CampaignDirectory::CampaignDirectory(const fs::path& path, const CampaignInfo& info, ExistingCampaign existing)
    : info_(info), kept_(true), lock_(lock_of(std::move(existing), path)), directory_(lock_->directory()) {
  check_policy_names(info.policies);
  recover_set_aside(directory_);
  forget_unfinished(directory_);
  // Names are not used again, not even those of shards that are gone.
  const auto taken = [&](const std::string& shard) { shards_ = std::max(shards_, shard_number(shard)); };
  for (const std::string& shard : shard_names(directory_)) taken(shard);
  for (const auto& [shard, entry] : read_manifest(directory_)) taken(shard);
  shard_folder_ = directory_.make(kShardFolder);
  describe(directory_, info_, false);
}

CampaignDirectory::CampaignDirectory(const fs::path& path, const CampaignInfo& info, CampaignMember member)
    : info_(info),
      kept_(true),
      prefix_(fmt::format("r{:05}-", member.rank)),
      shards_(member.shards),
      directory_(without_slash(path)),
      shard_folder_(directory_.make(kShardFolder)) {
  member_.emplace(directory_);
}

CampaignDirectory::~CampaignDirectory() {
  if (kept_) return;
  if (lock_ && !lock_->held()) return;  // what is there may be another writer's by now
  try {
    // There is something to resume.
    if (!shard_names(directory_).empty() || (!replaces_ && !read_unfinished(directory_).empty())) return;
  } catch (const InputError&) {
    return;
  }
  restore();
}

void CampaignDirectory::restore() noexcept {
  try {
    remove_begun(directory_);
    if (replaces_) put_back(directory_);
  } catch (const std::exception&) {
    // The next writer puts back what is left over.
  }
  leave();
}

void CampaignDirectory::leave() noexcept {
  lock_.reset();
  if (made_ && directory_.in_place()) rmdir(directory_.path().c_str());  // unless another holds it by now
}

void CampaignDirectory::keep() {
  kept_ = true;
  if (replaces_) drop_set_aside(directory_);
  replaces_ = false;
}

void CampaignDirectory::check_in_place() const {
  for (const Directory& held : {directory_, *shard_folder_}) {
    if (held.in_place()) continue;
    throw MachineError(
        fmt::format("{}: is no longer the directory that this program writes into: {}; nothing more is written",
                    held.path().string(), held.whereabouts()));
  }
  if (lock_) lock_->check_held();
  if (member_) member_->check_held();
}

void CampaignDirectory::keep_described() {
  if (!lock_) return;
  try {
    if (directory_.has_file(kDescriptionFile) && directory_.has_file(kDescriptionCopy)) return;
  } catch (const UnreadableFile&) {
    return;  // nothing is known
  }
  check_in_place();
  describe(directory_, info_, false);
}

void CampaignDirectory::add_shard(ShardBuffer shard) {
  check_in_place();
  keep_described();
  std::string name;
  do {
    name = fmt::format("{}{:06}.h5", prefix_, ++shards_);
  } while (shard_folder_->has(name));  // a second writer's, if somebody has removed the lock
  const ShardEntry entry = shard.publish(*shard_folder_, name, info_);
  keep();
  if (!manifest_) manifest_.emplace(directory_, prefix_ + kManifestName);
  manifest_->append(entry);
}

void CampaignDirectory::add_unfinished(const UnfinishedTrace& trace) {
  check_in_place();
  graze::add_unfinished(directory_, trace);
}

void CampaignDirectory::keep_begun() {
  check_in_place();
  keep();
}

void CampaignDirectory::complete(std::uint64_t answered_at) {
  check_in_place();
  manifest_.reset();
  replace_manifest(directory_, read_manifest(directory_));
  info_.until.answered_at = answered_at;
  if (answered_at > 0) info_.particles = answered_at;
  describe(directory_, info_, true);
  keep();
}

}  // namespace graze
