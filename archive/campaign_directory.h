#pragma once
// The directory that a campaign is written into: campaign.h5 and shards/NNNNNN.h5, each appearing by rename, and the
// manifest of the shards. With `force` an old campaign in its place is set aside and comes back if the new one never
// gets a shard.

#include <filesystem>
#include <optional>
#include <vector>

#include "archive/archive.h"
#include "archive/lock.h"
#include "archive/manifest.h"
#include "archive/shard.h"

namespace graze {

inline constexpr const char* kDescriptionFile = "campaign.h5";
inline constexpr const char* kShardFolder = "shards";
inline constexpr const char* kDamagedFolder = "damaged";  // shards that could not be read

/// What is in a directory, sorted by name. Throws InputError if it cannot be listed.
std::vector<std::filesystem::path> entries_of(const std::filesystem::path& directory);

/// The shards of a campaign directory, sorted by name; unfinished ones (*.tmp) are not among them.
std::vector<std::filesystem::path> shard_files(const std::filesystem::path& directory);

class CampaignDirectory {
 public:
  /// As CampaignWriter's constructor.
  CampaignDirectory(std::filesystem::path directory, const CampaignInfo& info, bool force);
  /// Takes up an existing campaign, which `info` describes from now on; shards are added to those that are there.
  CampaignDirectory(std::filesystem::path directory, const CampaignInfo& info, CampaignWriter::Existing existing);
  /// Adds shards to a campaign that another process holds.
  CampaignDirectory(std::filesystem::path directory, const CampaignInfo& info, CampaignWriter::Member member);
  /// Leaves things as they were before if no shard was added and the campaign was not completed.
  ~CampaignDirectory();

  const std::filesystem::path& path() const { return path_; }
  const CampaignInfo& info() const { return info_; }
  /// Highest number of a shard so far.
  int shards() const { return shards_; }
  /// Writes it under its name, then tells the manifest.
  void add_shard(ShardBuffer shard);
  /// Makes one file of the manifest and writes campaign.h5 anew, marked complete; `answered_at` as
  /// CampaignWriter::finish.
  void complete(std::uint64_t answered_at = 0);

 private:
  void keep();              // from now on the new campaign counts: the old one is removed
  void restore() noexcept;  // the new campaign never was

  std::filesystem::path path_;
  CampaignInfo info_;
  bool made_ = false;      // the directory
  bool replaces_ = false;  // an old campaign is set aside
  bool kept_ = false;
  std::string prefix_;  // of the names of shards
  int shards_ = 0;      // highest number of a shard
  std::optional<ManifestWriter> manifest_;
  std::shared_ptr<const DirectoryLock> lock_;
  std::optional<MemberLock> member_;
};

}  // namespace graze
