#include "archive/campaign_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "archive/campaign_directory.h"
#include "archive/manifest.h"
#include "archive/outcome_scan.h"
#include "archive/reading_child.h"
#include "archive/seal.h"
#include "archive/shell_word.h"
#include "engine/settings/paths.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFromACopy = "take it from a copy, or run the campaign again";

/// Runs `act` on an open file; says which file it was if HDF5 complains, and what to do if the file is no good.
template <class Act>
auto with_file(const fs::path& path, const std::string& advice, const Act& act) {
  try {
    check_seal(path);
  } catch (const DamagedFile& error) {
    throw InputError(fmt::format("{}; {}", error.what(), advice));
  }
  const hdf5::Lock lock;
  const ReadingNote note(path);
  try {
    const hdf5::Handle file = hdf5::open_for_reading(path);
    return act(file);
  } catch (const hdf5::Error& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

fs::path description_of(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw InputError(fmt::format("{}: is not there{}", path.string(), path_suggestion(path.string())));
  }
  if (!fs::is_directory(status)) return path;
  if (!fs::exists(path / kDescriptionFile, error)) {
    throw InputError(fmt::format("{}: is no campaign directory: it has no {}", path.string(), kDescriptionFile));
  }
  return path / kDescriptionFile;
}

void check_shards_are_there(const fs::path& directory) {
  constexpr std::size_t kTold = 3;
  const std::vector<ShardEntry> missing = missing_shards(directory, read_manifest(directory));
  if (missing.empty()) return;
  std::string text;
  for (std::size_t i = 0; i < std::min(kTold, missing.size()); ++i) text += missing_text(missing[i]) + "; ";
  if (missing.size() > kTold) text += fmt::format("{} more are gone; ", missing.size() - kTold);
  throw InputError(fmt::format("{}: {}'graze resume {}' simulates that again", directory.string(), text,
                               shell_word(directory.string())));
}

}  // namespace

CampaignFiles open_campaign(const fs::path& path, Seals seals) {
  const fs::path description = description_of(path);
  StoredInfo stored = with_file(description, kFromACopy, [](const hdf5::Handle& file) { return read_info(file); });
  const std::uint64_t particles = stored.info.particles;
  if (stored.layout == Layout::packed) return {std::move(stored), Parts({description}, particles)};
  if (description == path) {
    throw InputError(fmt::format("{}: only describes a campaign; give the directory that it lies in", path.string()));
  }
  check_shards_are_there(path);
  std::vector<fs::path> shards = shard_files(path);
  if (seals == Seals::trusted) return {std::move(stored), Parts(std::move(shards), particles)};
  for (const fs::path& shard : shards) {
    const std::string advice =
        fmt::format("'graze resume {}' puts it aside and simulates again what it held", shell_word(path.string()));
    with_file(shard, advice, [&](const hdf5::Handle& file) { check_shard_identity(file, stored.info); });
  }
  return {std::move(stored), Parts(std::move(shards), particles)};
}

namespace {

/// What makes two directories parts of different campaigns; empty: nothing.
std::string difference(const CampaignInfo& a, const CampaignInfo& b) {
  if (a.scenario_sha256 != b.scenario_sha256) return "scenarios";
  if (a.seed != b.seed) return fmt::format("seeds ({} and {})", a.seed, b.seed);
  if (a.particles != b.particles) return fmt::format("numbers of particles ({} and {})", a.particles, b.particles);
  if (a.policies != b.policies) return "policies";
  if (a.results_version != b.results_version) {
    return fmt::format("results versions ({} and {})", a.results_version, b.results_version);
  }
  return "";
}

}  // namespace

CampaignFiles open_parts(const std::vector<fs::path>& directories) {
  CampaignFiles all = open_campaign(directories.front());
  std::vector<fs::path> shards;
  for (const fs::path& directory : directories) {
    const CampaignFiles one = open_campaign(directory);
    if (one.stored.layout == Layout::packed) {
      throw InputError(fmt::format("{}: is one file already; give campaign directories", directory.string()));
    }
    const std::string differ = difference(all.stored.info, one.stored.info);
    if (!differ.empty()) {
      throw InputError(fmt::format("{} and {}: are not parts of one campaign: their {} differ",
                                   directories.front().string(), directory.string(), differ));
    }
    for (const fs::path& shard : shard_files(directory)) shards.push_back(shard);
  }
  CampaignInfo& info = all.stored.info;
  info.part = {};
  const hdf5::Lock lock;
  all.parts = Parts(std::move(shards), info.particles);
  all.stored.complete = std::all_of(info.policies.begin(), info.policies.end(), [&](const std::string& policy) {
    std::uint64_t traces = 0;
    scan_outcomes(all.parts, policy, info, [&](std::span<const TraceOutcome> some) { traces += some.size(); });
    return traces == info.particles;
  });
  return all;
}

CampaignInfo read_description(const fs::path& directory) {
  return with_file(description_of(directory), kFromACopy,
                   [](const hdf5::Handle& file) { return read_info(file).info; });
}

}  // namespace graze
