#include "archive/finished.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/campaign_directory.h"
#include "archive/campaign_files.h"
#include "archive/info.h"
#include "archive/manifest.h"
#include "archive/part_check.h"
#include "archive/reading_child.h"
#include "archive/seal.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct ShardContent {
  ShardEntry entry;
  std::map<std::string, std::vector<std::uint32_t>> particles;  // by policy
};

void check_identity(const OpenPart& part, const CampaignInfo& info) {
  try {
    check_shard_identity(part.file(), info);
  } catch (const hdf5::Error& error) {
    part.fail(error.what());
  }
}

Seal seal_of(const Directory& shards, const std::string& name) {
  return check_seal(shards.open(name).number(), shards / name);
}

/// The traces of one shard, whose seal fits. Throws InputError.
ShardContent content_of(const Directory& shards, const std::string& name, const Seal& seal, const CampaignInfo& info) {
  const Descriptor file = shards.open(name);
  const hdf5::Lock lock;
  ShardContent out{{name, seal.bytes, seal.digest, {}}, {}};
  const OpenPart part(shards / name, file);
  check_identity(part, info);
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

/// Which shards this process may read: their seals fit, and a child has read them.
struct Readable {
  std::map<std::string, Seal> seals;            // of those that it may
  std::map<std::string, std::string> messages;  // about the others
};

Readable readable_shards(const Directory& directory, const CampaignInfo& info) {
  Readable out;
  const auto shards = directory.find(kShardFolder);
  std::vector<fs::path> sealed;
  for (const std::string& name : shard_names(directory)) {
    try {
      out.seals[name] = seal_of(*shards, name);
      sealed.push_back(*shards / name);
    } catch (const InputError& error) {
      out.messages[name] = error.what();
    }
  }
  for (const Unreadable& bad : unreadable(sealed, [&](const fs::path& path) { check_as_resume(path, info); })) {
    const std::string name = sealed[bad.file].filename().string();
    out.seals.erase(name);
    out.messages[name] = bad.why;
  }
  return out;
}

void put_aside(const Directory& directory, const Directory& shards, const std::string& name) {
  const Directory folder = directory.make(kDamagedFolder);
  std::string place = name;
  for (int number = 1; folder.has(place); ++number) {
    place = fmt::format("{}.{}.h5", fs::path(name).stem().string(), number);
  }
  shards.move(name, folder, place);
  folder.sync();
  shards.sync();
}

}  // namespace

bool FinishedTraces::has(const std::string& policy, std::uint64_t particle) const {
  const auto found = done.find(policy);
  return found != done.end() && particle < found->second.size() && found->second[particle];
}

std::uint64_t traces_kept(const Directory& directory, const CampaignInfo& info) {
  std::uint64_t count = 0;
  const auto shards = directory.find(kShardFolder);
  for (const std::string& name : shard_names(directory)) {
    const ShardContent content = content_of(*shards, name, seal_of(*shards, name), info);
    for (const ShardEntry::Traces& traces : content.entry.traces) count += traces.count;
  }
  return count;
}

void check_as_resume(const fs::path& shard, const CampaignInfo& info) {
  const hdf5::Lock lock;
  Parts part({shard}, info.particles, kInShards);
  check_identity(part.open(0), info);
  check_outcomes(part, info);
}

FinishedTraces repair_and_list(const Directory& directory, const CampaignInfo& info) {
  FinishedTraces out;
  directory.remove_temporary();
  for (const char* name : {kShardFolder, kManifestFolder}) {
    if (const auto folder = directory.find(name)) folder->remove_temporary();
  }
  for (const ShardEntry& missing : missing_shards(directory, read_manifest(directory))) {
    out.notes.push_back(
        fmt::format("{}: {}; that is simulated again", directory.path().string(), missing_text(missing)));
  }
  Manifest manifest;
  const auto shards = directory.find(kShardFolder);
  Readable readable = readable_shards(directory, info);
  for (const std::string& shard : shard_names(directory)) {
    ShardContent content;
    try {
      if (const auto bad = readable.messages.find(shard); bad != readable.messages.end()) throw InputError(bad->second);
      content = content_of(*shards, shard, readable.seals[shard], info);
    } catch (const InputError& error) {
      put_aside(directory, *shards, shard);
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
