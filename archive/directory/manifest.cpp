#include "archive/directory/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <span>

#include "archive/directory/campaign_directory.h"
#include "archive/files/files.h"
#include "archive/files/seal.h"
#include "archive/files/text_lines.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kMerged = "all.jsonl";

/// A line takes some 200 bytes; more than a million of them are no campaign's.
constexpr std::uint64_t kMostManifestBytes = std::uint64_t{256} << 20;

/// Files of the manifest, sorted, so that it reads the same each time.
std::vector<std::string> manifest_files(const Directory& folder) {
  std::vector<std::string> files = folder.names();
  std::erase_if(files, [](const std::string& name) { return !name.ends_with(".jsonl"); });
  return files;
}

void write_text(int descriptor, const fs::path& path, const std::string& text) {
  if (const int error = write_all(descriptor, std::as_bytes(std::span(text)))) fail_writing(path, error);
}

}  // namespace

std::string manifest_line(const ShardEntry& entry) {
  Json line = {{"shard", entry.shard},
               {"bytes", entry.bytes},
               {"xxh64", fmt::format("{:016x}", entry.digest)},
               {"traces", Json::object()}};
  for (const ShardEntry::Traces& traces : entry.traces) {
    line["traces"][traces.policy] = {{"count", traces.count}, {"lowest", traces.lowest}, {"highest", traces.highest}};
  }
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<ShardEntry> parse_manifest_line(const std::string& text) {
  try {
    const Json line = Json::parse(text);
    ShardEntry entry;
    entry.shard = line.at("shard").get<std::string>();
    entry.bytes = line.at("bytes").get<std::uint64_t>();
    entry.digest = std::stoull(line.at("xxh64").get<std::string>(), nullptr, 16);
    for (const auto& [policy, traces] : line.at("traces").items()) {
      entry.traces.push_back({policy, traces.at("count").get<std::uint64_t>(), traces.at("lowest").get<std::uint32_t>(),
                              traces.at("highest").get<std::uint32_t>()});
    }
    // A name, not a path: what a manifest names lies in the campaign's own folder.
    if (entry.shard.empty() || entry.shard.find('/') != std::string::npos) return std::nullopt;
    return entry;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

Manifest read_manifest(const Directory& directory) {
  Manifest manifest;
  const auto folder = directory.find(kManifestFolder);
  if (!folder) return manifest;
  for (const std::string& name : manifest_files(*folder)) {
    const auto file = folder->find_file(name);
    if (!file) continue;  // the writer has just made one file of all
    for_each_line(file->number(), kMostManifestBytes, [&](const std::string& line) {
      if (auto entry = parse_manifest_line(line)) manifest[entry->shard] = std::move(*entry);
    });
  }
  return manifest;
}

void replace_manifest(const Directory& directory, const Manifest& manifest) {
  std::string text;
  for (const auto& [shard, entry] : manifest) text += manifest_line(entry) + "\n";
  const Directory folder = directory.make(kManifestFolder);
  const std::vector<std::string> old = manifest_files(folder);
  NewFile file(folder, kMerged);
  write_text(file.descriptor(), folder / kMerged, text);
  file.publish();
  for (const std::string& one : old) {
    if (one != kMerged) folder.remove(one);  // what stays says the same once more
  }
}

namespace {

/// Whole shards that the manifest does not name, by their seals' digests.
std::map<std::uint64_t, std::string> unnamed_shards(const Directory& directory, const std::vector<std::string>& files,
                                                    const Manifest& manifest) {
  std::map<std::uint64_t, std::string> out;
  const auto folder = directory.find(kShardFolder);
  for (const std::string& name : files) {
    if (manifest.contains(name)) continue;
    try {
      out[check_seal(folder->open(name).number(), *folder / name).digest] = name;
    } catch (const InputError&) {
      continue;  // whoever reads it tells
    }
  }
  return out;
}

}  // namespace

std::vector<MissingShard> missing_shards(const Directory& directory, const Manifest& manifest) {
  std::vector<MissingShard> missing;
  const std::vector<std::string> files = shard_names(directory);  // sorted
  for (const auto& [shard, entry] : manifest) {
    if (!std::binary_search(files.begin(), files.end(), shard)) missing.push_back({entry, ""});
  }
  if (missing.empty()) return missing;
  const std::map<std::uint64_t, std::string> unnamed = unnamed_shards(directory, files, manifest);
  for (MissingShard& one : missing) {
    if (const auto found = unnamed.find(one.entry.digest); found != unnamed.end()) one.now = found->second;
  }
  return missing;
}

std::string missing_text(const MissingShard& shard) {
  if (!shard.now.empty()) {
    return fmt::format("{0}/{1} is {0}/{2} now; nothing is lost", kShardFolder, shard.entry.shard, shard.now);
  }
  std::vector<std::string> held;
  for (const ShardEntry::Traces& traces : shard.entry.traces) {
    held.push_back(fmt::format("{} traces of '{}' (particles {} to {})", traces.count, traces.policy, traces.lowest,
                               traces.highest));
  }
  return fmt::format("{}/{} is gone; it held {}", kShardFolder, shard.entry.shard, fmt::join(held, ", "));
}

ManifestWriter::ManifestWriter(Directory directory, const std::string& name)
    : directory_(std::move(directory)), name_(name + ".jsonl") {}

void ManifestWriter::append(const ShardEntry& entry) {
  std::string line = manifest_line(entry) + "\n";
  const fs::path path = directory_ / kManifestFolder / name_;
  if (!file_) {
    const Directory folder = directory_.make(kManifestFolder);
    Descriptor file = folder.open_to_change(name_, O_RDWR | O_APPEND);
    folder.sync();
    if (ends_torn(file.number())) line.insert(line.begin(), '\n');
    file_ = std::move(file);
  }
  write_text(file_.number(), path, line);
  if (fsync(file_.number()) != 0) fail_writing(path, errno);
}

}  // namespace graze
