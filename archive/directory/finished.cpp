#include "archive/directory/finished.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/damaged.h"
#include "archive/hdf5/reading_child.h"
#include "archive/schema/info.h"
#include "archive/schema/part_check.h"

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

/// What `read` returns of a shard, or why the shard is no good. What the system does not give, and what comes out well
/// when it is read once more, is not damaged. Throws MachineError.
template <class Read>
auto read_or_damage(const Read& read) -> std::variant<decltype(read()), std::string> {
  constexpr int kTries = 2;  // a library that found no memory, a disk that failed once
  for (int trial = 1;; ++trial) {
    try {
      return read();
    } catch (const UnreadableFile& error) {
      if (trial < kTries) continue;
      throw MachineError(
          fmt::format("{}; when it can be read 'graze resume' goes on, and if it is lost, remove it: what it held is "
                      "simulated again",
                      error.what()));
    } catch (const InputError& error) {
      if (trial == kTries) return error.what();
    }
  }
}

/// Which shards this process may read: their seals fit, and a child has read them.
struct Readable {
  std::map<std::string, Seal> seals;            // of those that it may
  std::map<std::string, std::string> messages;  // about the others
};

/// Those of `files` that no child can read, not even at a second attempt.
std::vector<Unreadable> unreadable_twice(const std::vector<fs::path>& files, const CampaignInfo& info) {
  const auto read = [&](const fs::path& path) { check_as_resume(path, info); };
  std::vector<Unreadable> out;
  for (const Unreadable& bad : unreadable(files, read)) {
    for (const Unreadable& again : unreadable({files[bad.file]}, read)) out.push_back({bad.file, again.why});
  }
  return out;
}

Readable readable_shards(const Directory& directory, const CampaignInfo& info) {
  Readable out;
  const auto shards = directory.find(kShardFolder);
  std::vector<fs::path> sealed;
  for (const std::string& name : shard_names(directory)) {
    const auto seal = read_or_damage([&] { return seal_of(*shards, name); });
    if (const auto* damage = std::get_if<std::string>(&seal)) {
      out.messages[name] = *damage;
    } else {
      out.seals[name] = std::get<Seal>(seal);
      sealed.push_back(*shards / name);
    }
  }
  for (const Unreadable& bad : unreadable_twice(sealed, info)) {
    const std::string name = sealed[bad.file].filename().string();
    out.seals.erase(name);
    out.messages[name] = bad.why;
  }
  return out;
}

}  // namespace

bool FinishedTraces::has(const std::string& policy, std::uint64_t particle) const {
  const auto found = done.find(policy);
  return found != done.end() && particle < found->second.size() && found->second[particle];
}

ShardEntry shard_entry(const Directory& shards, const std::string& name, const Seal& seal, const CampaignInfo& info) {
  return content_of(shards, name, seal, info).entry;
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
  Parts part({shard}, counting(info), kInShards);
  check_identity(part.open(0), info);
  check_outcomes(part, info);
}

FinishedTraces repair_and_list(const Directory& directory, const CampaignInfo& info) {
  FinishedTraces out;
  directory.remove_temporary();
  for (const char* name : {kShardFolder, kManifestFolder}) {
    if (const auto folder = directory.find(name)) folder->remove_temporary();
  }
  std::vector<ManifestFault> faults;
  const Manifest before = read_manifest(directory, &faults);
  for (const ManifestFault& fault : faults) {
    out.notes.push_back(fmt::format(
        "{}/{}: {}; {}", directory.path().string(), fault_place(fault), fault_text(fault),
        fault.no_file() ? fmt::format("it lies in {}/ now", kDamagedFolder) : "the manifest is written anew"));
  }
  for (const MissingShard& missing : missing_shards(directory, before)) {
    out.notes.push_back(fmt::format("{}: {}; {}", directory.path().string(), missing_text(missing),
                                    missing.now.empty() ? "that is simulated again" : "the manifest says so now"));
  }
  Manifest manifest;
  const ParticleRange ids = counting(info);
  const auto shards = directory.find(kShardFolder);
  Readable readable = readable_shards(directory, info);
  for (const std::string& shard : shard_names(directory)) {
    std::variant<ShardContent, std::string> read;
    if (const auto bad = readable.messages.find(shard); bad != readable.messages.end()) {
      read = bad->second;
    } else {
      read = read_or_damage([&] { return content_of(*shards, shard, readable.seals[shard], info); });
    }
    if (const auto* damage = std::get_if<std::string>(&read)) {
      put_aside(directory, *shards, shard);
      out.notes.push_back(
          fmt::format("{}; it lies in {}/ now, and what it held is simulated again", *damage, kDamagedFolder));
      continue;
    }
    auto& content = std::get<ShardContent>(read);
    for (const auto& [policy, particles] : content.particles) {
      std::vector<bool>& done = out.done[policy];
      for (const std::uint32_t particle : particles) {
        if (particle < ids.begin || particle >= ids.end) continue;  // ran ahead of --until, and does not count
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
