#include "archive/finished.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/campaign_directory.h"
#include "archive/info.h"
#include "archive/manifest.h"
#include "archive/part.h"
#include "archive/seal.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct ShardContent {
  ShardEntry entry;
  std::map<std::string, std::vector<std::uint32_t>> particles;  // by policy
};

/// The traces of one shard. Throws InputError.
ShardContent content_of(const fs::path& shard, const CampaignInfo& info) {
  const Seal seal = check_seal(shard);
  const hdf5::Lock lock;
  ShardContent out{{shard.filename().string(), seal.bytes, seal.digest, {}}, {}};
  const OpenPart part(shard);
  try {
    check_shard_identity(part.file(), info);
  } catch (const hdf5::Error& error) {
    part.fail(error.what());
  }
  for (const std::string& policy : info.policies) {
    const std::uint64_t count = part.traces(policy);
    if (count == 0) continue;
    auto& ids = out.particles[policy];
    ids = part.read<std::uint32_t>(schema::traces_group(policy), schema::particle(), count);
    const auto [lowest, highest] = std::minmax_element(ids.begin(), ids.end());
    out.entry.traces.push_back({policy, count, *lowest, *highest});
  }
  return out;
}

void put_aside(const fs::path& directory, const fs::path& shard) {
  const fs::path folder = directory / kDamagedFolder;
  if (!fs::exists(folder)) make_directory(folder);
  fs::path place = folder / shard.filename();
  for (int number = 1; fs::exists(place); ++number) {
    place = folder / fmt::format("{}.{}.h5", shard.stem().string(), number);
  }
  std::error_code error;
  fs::rename(shard, place, error);
  if (error) throw MachineError(fmt::format("{}: cannot be moved: {}", shard.string(), error.message()));
}

void remove_leftovers(const fs::path& directory) {
  std::error_code error;
  for (const fs::path& folder : {directory, directory / kShardFolder, directory / kManifestFolder}) {
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
      std::error_code ignored;
      if (at->path().extension() == ".tmp") fs::remove(at->path(), ignored);
    }
  }
}

}  // namespace

bool FinishedTraces::has(const std::string& policy, std::uint64_t particle) const {
  const auto found = done.find(policy);
  return found != done.end() && particle < found->second.size() && found->second[particle];
}

std::uint64_t traces_in_shard(const fs::path& shard, const CampaignInfo& info) {
  std::uint64_t count = 0;
  for (const ShardEntry::Traces& traces : content_of(shard, info).entry.traces) count += traces.count;
  return count;
}

FinishedTraces repair_and_list(const fs::path& directory, const CampaignInfo& info) {
  FinishedTraces out;
  remove_leftovers(directory);
  for (const ShardEntry& missing : missing_shards(directory, read_manifest(directory))) {
    out.notes.push_back(fmt::format("{}: {}; that is simulated again", directory.string(), missing_text(missing)));
  }
  Manifest manifest;
  for (const fs::path& shard : shard_files(directory)) {
    ShardContent content;
    try {
      content = content_of(shard, info);
    } catch (const InputError& error) {
      put_aside(directory, shard);
      out.notes.push_back(
          fmt::format("{}; it lies in {}/ now, and what it held is simulated again", error.what(), kDamagedFolder));
      continue;
    }
    for (const auto& [policy, particles] : content.particles) {
      std::vector<bool>& done = out.done[policy];
      for (const std::uint32_t particle : particles) {
        if (particle >= info.particles) continue;  // ran ahead of --until, and does not count
        if (particle >= done.size()) done.resize(std::size_t{particle} + 1);
        if (!done[particle]) ++out.count;
        done[particle] = true;
      }
    }
    manifest[content.entry.shard] = std::move(content.entry);
  }
  replace_manifest(directory, manifest);
  return out;
}

}  // namespace graze
