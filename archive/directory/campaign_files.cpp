#include "archive/directory/campaign_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/damaged.h"
#include "archive/directory/manifest.h"
#include "archive/directory/set_aside.h"
#include "archive/directory/unfinished.h"
#include "archive/files/seal.h"
#include "archive/files/shell_word.h"
#include "archive/hdf5/file_driver.h"
#include "archive/hdf5/reading_child.h"
#include "archive/schema/trace_scan.h"
#include "engine/settings/paths.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// Runs `act` on an open file; says which file it was if HDF5 complains. Its seal must have been checked.
template <class Act>
auto with_sealed(const fs::path& path, const Descriptor& file, const Act& act) {
  const hdf5::Lock lock;
  const ReadingNote note(path);
  try {
    const hdf5::Handle opened = hdf5::open_for_reading(file.number());
    return act(opened);
  } catch (const hdf5::Error& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

/// The same with the seal checked; says what to do if the file is damaged.
template <class Act>
auto with_file(const fs::path& path, const Descriptor& file, const std::string& advice, const Act& act) {
  try {
    check_seal(file.number(), path);
  } catch (const DamagedFile& error) {
    throw InputError(fmt::format("{}; {}", error.what(), advice));
  }
  return with_sealed(path, file, act);
}

/// Which campaign the shards of a directory without a description are of; empty: there are none, or not one is whole.
std::string told_by_shards(const Directory& directory) {
  const auto folder = directory.find(kShardFolder);
  for (const std::string& name : shard_names(directory)) {
    try {
      const auto told = [](const hdf5::Handle& file) {
        return fmt::format("seed {}, SHA-256 of the scenario {}", hdf5::read_count(file.id(), "seed"),
                           hdf5::read_text(file.id(), "scenario_sha256"));
      };
      return with_file(*folder / name, folder->open(name), "", told);
    } catch (const InputError&) {
      continue;
    }
  }
  return "";
}

/// Neither the description nor its copy is of use: what there is to do, with the shards in mind.
[[noreturn]] void fail_undescribed(const Directory& directory, const std::string& why) {
  const std::string path = directory.path().string(), shards = told_by_shards(directory);
  if (shards.empty()) throw InputError(fmt::format("{}; run the campaign again", why));
  const std::size_t count = shard_names(directory).size();
  throw InputError(
      fmt::format("{}; its {} shard{} can be kept ({}): run the same scenario with the same options and -n 1 into "
                  "another directory, "
                  "copy {} from there to {}, then 'graze resume {} -n PARTICLES'",
                  why, count, count == 1 ? "" : "s", shards, kDescriptionFile, path, shell_path(path)));
}

struct Description {
  StoredInfo stored;
  std::string warning = {};  // it was read from the copy: why
};

/// The description of that name; nothing, and why, if it is not there or not whole.
std::optional<StoredInfo> read_one(const Directory& directory, const char* name, std::string& why) {
  const auto file = directory.find_file(name);
  if (!file) {
    why = fmt::format("{}: is not there", (directory / name).string());
    return std::nullopt;
  }
  try {
    check_seal(file->number(), directory / name);
  } catch (const InputError& error) {
    why = error.what();
    return std::nullopt;
  }
  StoredInfo stored =
      with_sealed(directory / name, *file, [](const hdf5::Handle& opened) { return read_info(opened); });
  if (stored.layout == Layout::directory) return stored;
  throw InputError(fmt::format("{}: is a packed campaign where the description of a directory is expected",
                               (directory / name).string()));
}

Description describe_directory(const Directory& directory) {
  const std::string path = directory.path().string();
  const std::vector<std::string> shards = shard_names(directory);
  if (!directory.has(kDescriptionFile) && !directory.has(kDescriptionCopy) && shards.empty()) {
    throw InputError(no_campaign_text(directory));
  }
  std::string why, second;
  if (auto stored = read_one(directory, kDescriptionFile, why)) return {std::move(*stored)};
  if (auto stored = read_one(directory, kDescriptionCopy, second)) {
    return {std::move(*stored), fmt::format("{}; its copy {} is read instead, and 'graze resume {}' mends that", why,
                                            kDescriptionCopy, shell_path(path))};
  }
  fail_undescribed(directory, fmt::format("{}; nor is its copy of use: {}", why, second));
}

/// Throws InputError if shards have been lost; returns what there is to tell of those that only have other names.
std::vector<std::string> check_shards_are_there(const Directory& directory) {
  constexpr std::size_t kTold = 3;
  const std::string path = directory.path().string();
  std::vector<std::string> told;
  std::string text;
  std::size_t gone = 0;
  std::vector<ManifestFault> faults;
  const Manifest manifest = read_manifest(directory, &faults);
  for (const ManifestFault& fault : faults) {
    told.push_back(fmt::format(
        "{}/{}: {}, and 'graze resume {}' {}", path, fault_place(fault), fault_text(fault), shell_path(path),
        fault.no_file() ? fmt::format("puts it into {}/", kDamagedFolder) : "writes the manifest anew"));
  }
  for (const MissingShard& missing : missing_shards(directory, manifest)) {
    if (!missing.now.empty()) {
      told.push_back(fmt::format("{}: {}, and 'graze resume {}' has the manifest say so", path, missing_text(missing),
                                 shell_path(path)));
    } else if (++gone <= kTold) {
      text += missing_text(missing) + "; ";
    }
  }
  if (gone == 0) return told;
  if (gone > kTold) text += fmt::format("{} more are gone; ", gone - kTold);
  throw InputError(fmt::format("{}: {}'graze resume {}' simulates that again", path, text, shell_path(path)));
}

/// What a repair finds fault with though no reader needs it.
std::vector<std::string> doubtful_places(const Directory& directory) {
  std::vector<std::string> out;
  if (const std::string why = why_no_list(directory); !why.empty()) {
    out.push_back(fmt::format("{}: {}; 'graze resume {}' puts it into {}/", (directory / kUnfinishedFile).string(), why,
                              shell_path(directory.path().string()), kDamagedFolder));
  }
  if (std::string text = lock_fault(directory); !text.empty()) out.push_back(std::move(text));
  return out;
}

}  // namespace

std::string no_campaign_text(const Directory& directory) {
  const std::string path = directory.path().string();
  const std::string out = fmt::format("{}: is no campaign directory: it has no {}", path, kDescriptionFile);
  for (const std::string& name : directory.names()) {
    std::error_code error;
    if (!name.ends_with(".graze") || !fs::is_regular_file(directory / name / kDescriptionFile, error)) continue;
    return fmt::format("{}; did you mean '{}'?", out, (directory / name).string());
  }
  return out;
}

namespace {

CampaignFiles open_file(const fs::path& path) {
  const Descriptor file = open_archive_file(path);
  StoredInfo stored = with_file(path, file, "take it from a copy, or run the campaign again",
                                [](const hdf5::Handle& opened) { return read_info(opened); });
  if (stored.layout != Layout::packed) {
    throw InputError(fmt::format("{}: only describes a campaign; give the directory that it lies in", path.string()));
  }
  const ParticleRange ids = counting(stored.info);
  return {std::move(stored), Parts({path}, ids, 0), {}};
}

/// A directory whose old campaign is half set aside, or half back, is nothing to be read.
void check_not_replacing(const Directory& directory) {
  const bool half = directory.find(kReplacingFolder).has_value();
  const bool fresh = directory.find(kReplacedFolder) && !directory.has(kDescriptionFile);
  if (!half && !fresh) return;
  const std::string path = directory.path().string();
  const auto writer = writer_of(directory);
  throw InputError(writer ? fmt::format("{}: is just being replaced: {} is writing here", path, *writer)
                          : replacing_text(directory));
}

CampaignFiles open_directory(const Directory& directory, Seals seals) {
  check_not_replacing(directory);
  Description description = describe_directory(directory);
  StoredInfo& stored = description.stored;
  std::vector<std::string> warnings;
  if (!description.warning.empty()) warnings.push_back(description.warning);
  if (!writer_of(directory)) {
    std::string text = replacing_text(directory);
    if (!text.empty()) warnings.push_back(std::move(text));
  }
  for (std::vector<std::string>& texts : std::array{check_shards_are_there(directory), doubtful_places(directory)}) {
    warnings.insert(warnings.end(), texts.begin(), texts.end());
  }
  std::vector<fs::path> shards;
  const auto folder = directory.find(kShardFolder);
  for (const std::string& name : shard_names(directory)) {
    shards.push_back(*folder / name);
    if (seals == Seals::trusted) continue;
    const std::string advice = fmt::format("'graze resume {}' puts it aside and simulates again what it held",
                                           shell_path(directory.path().string()));
    with_file(shards.back(), folder->open(name), advice,
              [&](const hdf5::Handle& file) { check_shard_identity(file, stored.info); });
  }
  const ParticleRange ids = counting(stored.info);
  return {std::move(stored), Parts(std::move(shards), ids, kInShards), std::move(warnings)};
}

}  // namespace

CampaignFiles open_campaign(const fs::path& path, Seals seals) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw InputError(
        fmt::format("{}: is not there{}", path.string(), path_suggestion(path.string(), {".graze", ".h5"})));
  }
  return fs::is_directory(status) ? open_directory(path, seals) : open_file(path);
}

std::string campaign_difference(const CampaignInfo& a, const CampaignInfo& b) {
  if (a.scenario_sha256 != b.scenario_sha256) return "scenarios";
  if (a.seed != b.seed) return fmt::format("seeds ({} and {})", a.seed, b.seed);
  if (a.particles != b.particles) return fmt::format("numbers of particles ({} and {})", a.particles, b.particles);
  if (a.policies != b.policies) return "policies";
  if (a.results_version != b.results_version) {
    return fmt::format("results versions ({} and {})", a.results_version, b.results_version);
  }
  return "";
}

bool holds_all(Parts& parts, const CampaignInfo& info) {
  return std::all_of(info.policies.begin(), info.policies.end(), [&](const std::string& policy) {
    return count_traces(parts, policy, info) == info.part.count(info.particles);
  });
}

CampaignFiles open_parts(const std::vector<fs::path>& directories) {
  CampaignFiles all = open_campaign(directories.front());
  all.warnings.clear();  // they come once more
  std::vector<fs::path> shards;
  for (const fs::path& directory : directories) {
    const CampaignFiles one = open_campaign(directory);
    if (one.stored.layout == Layout::packed) {
      throw InputError(fmt::format("{}: is one file already; give campaign directories", directory.string()));
    }
    const std::string differ = campaign_difference(all.stored.info, one.stored.info);
    if (!differ.empty()) {
      throw InputError(fmt::format("{} and {}: are not parts of one campaign: their {} differ",
                                   directories.front().string(), directory.string(), differ));
    }
    for (const fs::path& shard : shard_files(directory)) shards.push_back(shard);
    all.warnings.insert(all.warnings.end(), one.warnings.begin(), one.warnings.end());
  }
  CampaignInfo& info = all.stored.info;
  info.part = {};
  const hdf5::Lock lock;
  all.parts = Parts(std::move(shards), counting(info), kInShards);
  all.stored.complete = holds_all(all.parts, info);
  return all;
}

CampaignInfo read_description(const Directory& directory) {
  return std::move(describe_directory(directory).stored.info);
}

namespace {

DescriptionFile look_at(const Directory& directory, const char* name) {
  const fs::path path = directory / name;
  DescriptionFile out{name};
  const auto fails = [&](const std::string& message) {
    const std::string begin = path.string() + ": ";
    out.why = message.starts_with(begin) ? message.substr(begin.size()) : message;
    return out;
  };
  try {
    const auto file = directory.find_file(name);
    out.there = file.has_value();
    if (!file) return fails("is not there");
    check_seal(file->number(), path);
    std::string why;
    const auto bad = unreadable(std::vector{path}, [&](const fs::path&) { read_one(directory, name, why); });
    if (!bad.empty()) return fails(bad[0].why);
    out.stored = read_one(directory, name, why);
    return out.stored ? out : fails(why);
  } catch (const UnreadableFile& error) {
    out.unreadable = true;
    return fails(error.what());
  } catch (const InputError& error) {
    return fails(error.what());
  }
}

}  // namespace

std::vector<DescriptionFile> description_files(const Directory& directory) {
  return {look_at(directory, kDescriptionFile), look_at(directory, kDescriptionCopy)};
}

CampaignInfo described_by(const Directory& directory, const std::vector<DescriptionFile>& files) {
  for (const DescriptionFile& file : files) {
    if (file.stored) return file.stored->info;
  }
  const std::string why = fmt::format("{}: {}; nor is its copy of use: {}", (directory / files[0].name).string(),
                                      files[0].why, files[1].why);
  // What the shards tell is in the message; the library may not survive what somebody else has written into them.
  const auto bad =
      unreadable(std::vector{directory.path()}, [&](const fs::path&) { fail_undescribed(directory, why); });
  throw InputError(bad.empty() ? why : bad[0].why);
}

std::string lock_fault(const Directory& directory) {
  if (directory.status(kLockFile).st_nlink <= 1 || writer_of(directory)) return "";
  return fmt::format("{}: has another name elsewhere (a hard link), and 'graze resume' would change that; remove it",
                     (directory / kLockFile).string());
}

std::string why_no_list(const Directory& directory) {
  const mode_t mode = directory.status(kUnfinishedFile).st_mode;
  return mode == 0 || S_ISREG(mode) ? "" : "is " + kind_of(mode);
}

std::vector<std::string> clear_places(const Directory& directory, const std::vector<DescriptionFile>& files) {
  std::vector<std::string> notes;
  for (const DescriptionFile& file : files) {
    if (file.stored || (!file.there && file.name == kDescriptionCopy)) continue;  // older archives have no copy
    if (file.in_the_way()) put_aside(directory, directory, file.name);
    notes.push_back(
        fmt::format("{}: {}; it is written anew{}", (directory / file.name).string(), file.why,
                    file.in_the_way() ? fmt::format(", and what was there lies in {}/", kDamagedFolder) : ""));
  }
  if (const std::string why = why_no_list(directory); !why.empty()) {
    put_aside(directory, directory, kUnfinishedFile);
    notes.push_back(
        fmt::format("{}: {}; it lies in {}/ now", (directory / kUnfinishedFile).string(), why, kDamagedFolder));
  }
  return notes;
}

}  // namespace graze
