#pragma once
// The directory that a campaign is written into: campaign.h5 and shards/NNNNNN.h5, each appearing by rename, and the
// manifest of the shards. With `force` an old campaign in its place is set aside and comes back if the new one never
// gets a shard.

#include <filesystem>
#include <optional>
#include <vector>

#include "archive/directory/manifest.h"
#include "archive/directory/roles.h"
#include "archive/directory/shard.h"
#include "archive/directory/unfinished.h"
#include "archive/files/layout.h"
#include "archive/files/lock.h"
#include "archive/schema/campaign_info.h"

namespace graze {

/// The shards of a campaign directory, sorted by name; unfinished ones (*.tmp) are not among them. Throws InputError.
std::vector<std::string> shard_names(const Directory& directory);
std::vector<std::filesystem::path> shard_files(const Directory& directory);

/// The first entry that no campaign has: nobody's other files are ever removed or moved. Throws InputError.
std::optional<std::string> foreign_entry(const Directory& directory);

/// Whether there is no more than what a campaign leaves that is killed before it is described.
bool only_begun(const Directory& directory);

class CampaignDirectory {
 public:
  /// As CampaignWriter's constructor.
  CampaignDirectory(const std::filesystem::path& path, const CampaignInfo& info, bool force);
  /// Takes up an existing campaign, which `info` describes from now on; shards are added to those that are there.
  CampaignDirectory(const std::filesystem::path& path, const CampaignInfo& info, ExistingCampaign existing);
  /// Adds shards to a campaign that another process holds.
  CampaignDirectory(const std::filesystem::path& path, const CampaignInfo& info, CampaignMember member);
  /// Leaves things as they were before if no shard was added and the campaign was not completed.
  ~CampaignDirectory();

  const std::filesystem::path& path() const { return directory_.path(); }
  const Directory& directory() const { return directory_; }
  const CampaignInfo& info() const { return info_; }
  /// Highest number of a shard so far.
  int shards() const { return shards_; }
  /// Throws MachineError if the path leads elsewhere by now: somebody has moved, removed or replaced the directory, or
  /// the lock in it. All that follows does so, too, and never writes into another's directory.
  void check_in_place() const;
  /// Writes campaign.h5 and its copy anew if somebody has removed one of them: without, shards are of no use. Nothing
  /// for a member. Throws MachineError.
  void keep_described();
  /// Writes it under its name, then tells the manifest. Before that as keep_described().
  void add_shard(ShardBuffer shard);
  void add_unfinished(const UnfinishedTrace& trace);
  /// As CampaignWriter::keep().
  void keep_begun();
  /// Makes one file of the manifest and writes campaign.h5 anew, marked complete; `answered_at` as
  /// CampaignWriter::finish.
  void complete(std::uint64_t answered_at = 0);

 private:
  void keep();              // from now on the new campaign counts: the old one is removed
  void restore() noexcept;  // the new campaign never was
  void leave() noexcept;    // releases the lock, and removes the directory if it was made here and is empty

  CampaignInfo info_;
  bool made_ = false;      // the directory
  bool replaces_ = false;  // an old campaign is set aside
  bool kept_ = false;
  std::string prefix_;  // of the names of shards
  int shards_ = 0;      // highest number of a shard
  std::optional<ManifestWriter> manifest_;
  std::shared_ptr<const DirectoryLock> lock_;
  Directory directory_;
  std::optional<Directory> shard_folder_;
  std::optional<MemberLock> member_;
};

}  // namespace graze
