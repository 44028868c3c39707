#pragma once
// What a campaign directory holds already, and its repair: shards that are damaged are put aside, so that what they
// held is simulated again.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "archive/directory/manifest.h"
#include "archive/files/directory.h"
#include "archive/files/seal.h"
#include "archive/schema/campaign_info.h"

namespace graze {

/// Which traces are there.
struct FinishedTraces {
  std::map<std::string, std::vector<bool>> done;  // by policy, then particle id; ids beyond the end are not done
  std::uint64_t count = 0;
  std::vector<std::string> notes;  // what was repaired, a sentence each

  bool has(const std::string& policy, std::uint64_t particle) const;
};

/// Traces of all policies in all shards. Throws InputError.
std::uint64_t traces_kept(const Directory& directory, const CampaignInfo& info);

/// What a shard with this seal holds, as the manifest has to say it. Throws InputError.
ShardEntry shard_entry(const Directory& shards, const std::string& name, const Seal& seal, const CampaignInfo& info);

/// Throws InputError unless a shard, whose seal must fit, is of the campaign and its outcomes can be read: what `graze
/// resume` asks of it before it counts on it.
void check_as_resume(const std::filesystem::path& shard, const CampaignInfo& info);

/// Reads all shards, a child process first, and writes the manifest anew. A shard that the manifest names and that is
/// gone is noted. A shard whose seal, structure or campaign does not fit, or that is no file (a link, a pipe), is moved
/// to `damaged/`; leftovers (*.tmp) are removed. The caller holds the directory's lock. Throws InputError
/// if the description cannot be read, MachineError if a damaged shard cannot be moved.
FinishedTraces repair_and_list(const Directory& directory, const CampaignInfo& info);

}  // namespace graze
