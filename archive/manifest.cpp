#include "archive/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "archive/campaign_directory.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kMerged = "all.jsonl";

/// Files of the manifest, sorted, so that it reads the same each time.
std::vector<fs::path> manifest_files(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(directory / kManifestFolder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() == ".jsonl") files.push_back(at->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

void write_text(int descriptor, const fs::path& path, const std::string& text) {
  if (const int error = write_all(descriptor, std::as_bytes(std::span(text)))) fail_writing(path, error);
}

void need_folder(const fs::path& folder) {
  if (!fs::exists(folder)) make_directory(folder);
}

/// True if the last line of a file was torn: what is appended must begin a line of its own.
bool torn(int descriptor) {
  const off_t size = lseek(descriptor, 0, SEEK_END);
  char last = '\n';
  return size > 0 && pread(descriptor, &last, 1, size - 1) == 1 && last != '\n';
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

Manifest read_manifest(const fs::path& directory) {
  Manifest manifest;
  for (const fs::path& file : manifest_files(directory)) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      if (auto entry = parse_manifest_line(line)) manifest[entry->shard] = std::move(*entry);
    }
  }
  return manifest;
}

void replace_manifest(const fs::path& directory, const Manifest& manifest) {
  std::string text;
  for (const auto& [shard, entry] : manifest) text += manifest_line(entry) + "\n";
  need_folder(directory / kManifestFolder);
  const std::vector<fs::path> old = manifest_files(directory);
  const fs::path merged = directory / kManifestFolder / kMerged;
  NewFile file(merged);
  write_text(file.descriptor(), merged, text);
  file.publish();
  std::error_code ignored;  // what stays says the same once more
  for (const fs::path& one : old) {
    if (one != merged) fs::remove(one, ignored);
  }
}

std::vector<ShardEntry> missing_shards(const fs::path& directory, const Manifest& manifest) {
  std::vector<ShardEntry> missing;
  const std::vector<fs::path> files = shard_files(directory);  // sorted
  for (const auto& [shard, entry] : manifest) {
    if (!std::binary_search(files.begin(), files.end(), directory / kShardFolder / shard)) missing.push_back(entry);
  }
  return missing;
}

std::string missing_text(const ShardEntry& entry) {
  std::vector<std::string> held;
  for (const ShardEntry::Traces& traces : entry.traces) {
    held.push_back(fmt::format("{} traces of '{}' (particles {} to {})", traces.count, traces.policy, traces.lowest,
                               traces.highest));
  }
  return fmt::format("{}/{} is gone; it held {}", kShardFolder, entry.shard, fmt::join(held, ", "));
}

ManifestWriter::ManifestWriter(fs::path directory, std::string name)
    : path_(std::move(directory) / kManifestFolder / (std::move(name) + ".jsonl")) {}

void ManifestWriter::append(const ShardEntry& entry) {
  std::string line = manifest_line(entry) + "\n";
  if (!file_) {
    need_folder(path_.parent_path());
    file_.emplace(open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    if (file_->number() < 0) {
      const int error = errno;
      file_.reset();
      fail_writing(path_, error);
    }
    if (torn(file_->number())) line.insert(line.begin(), '\n');
  }
  write_text(file_->number(), path_, line);
  if (fsync(file_->number()) != 0) fail_writing(path_, errno);
}

}  // namespace graze
