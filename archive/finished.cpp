#include "archive/finished.h"

#include <fmt/format.h>

#include "archive/campaign_directory.h"
#include "archive/info.h"
#include "archive/part.h"
#include "archive/seal.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

using ByPolicy = std::map<std::string, std::vector<std::uint32_t>>;

/// The traces of one shard. Throws InputError.
ByPolicy traces_of(const fs::path& shard, const CampaignInfo& info) {
  check_seal(shard);
  const hdf5::Lock lock;
  ByPolicy out;
  const OpenPart part(shard);
  try {
    check_shard_identity(part.file(), info);
  } catch (const hdf5::Error& error) {
    part.fail(error.what());
  }
  for (const std::string& policy : info.policies) {
    const std::uint64_t count = part.traces(policy);
    if (count == 0) continue;
    out[policy] = part.read<std::uint32_t>(schema::traces_group(policy), schema::particle(), count);
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
  for (const fs::path& folder : {directory, directory / kShardFolder}) {
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
  for (const auto& [policy, particles] : traces_of(shard, info)) count += particles.size();
  return count;
}

FinishedTraces repair_and_list(const fs::path& directory, const CampaignInfo& info) {
  FinishedTraces out;
  remove_leftovers(directory);
  for (const fs::path& shard : shard_files(directory)) {
    ByPolicy traces;
    try {
      traces = traces_of(shard, info);
    } catch (const InputError& error) {
      put_aside(directory, shard);
      out.notes.push_back(
          fmt::format("{}; it lies in {}/ now, and what it held is simulated again", error.what(), kDamagedFolder));
      continue;
    }
    for (const auto& [policy, particles] : traces) {
      std::vector<bool>& done = out.done[policy];
      for (const std::uint32_t particle : particles) {
        if (particle >= done.size()) done.resize(std::size_t{particle} + 1);
        if (!done[particle]) ++out.count;
        done[particle] = true;
      }
    }
  }
  return out;
}

}  // namespace graze
