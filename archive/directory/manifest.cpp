#include "archive/directory/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/damaged.h"
#include "archive/files/files.h"
#include "archive/files/seal.h"
#include "archive/files/text_lines.h"
#include "archive/files/utf8.h"

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

constexpr std::size_t kShown = 40;  // characters of a value in a message

/// A member of an object; throws InputError("NAME: is not there").
const Json& member(const Json& object, const char* name) {
  if (!object.is_object() || !object.contains(name)) throw InputError(fmt::format("{}: is not there", name));
  return object.at(name);
}

/// The library would make another number of one that does not fit.
std::uint64_t whole_number(const Json& object, const char* name, std::uint64_t least, std::uint64_t most) {
  const Json& value = member(object, name);
  if (value.is_number_unsigned()) {
    const auto number = value.get<std::uint64_t>();
    if (number >= least && number <= most) return number;
  }
  throw InputError(fmt::format("{}: {}: must be a whole number from {} to {}", name,
                               clipped(value.dump(-1, ' ', false, Json::error_handler_t::replace), kShown), least,
                               most));
}

/// A text that can be the name of something in an archive. It reaches terminals.
std::string shown_name(const std::string& what, const std::string& name) {
  if (name.empty() || printable(name) != name) {
    throw InputError(
        fmt::format("{}: '{}': must be a name without control characters", what, clipped(printable(name), kShown)));
  }
  return name;
}

std::string text_member(const Json& object, const char* name) {
  const Json& value = member(object, name);
  if (!value.is_string()) throw InputError(fmt::format("{}: must be a text", name));
  return value.get<std::string>();
}

std::uint64_t checksum(const std::string& text) {
  constexpr std::size_t kDigits = 16;
  if (text.size() != kDigits || text.find_first_not_of("0123456789abcdef") != std::string::npos) {
    throw InputError(
        fmt::format("xxh64: '{}': must be {} hexadecimal digits", clipped(printable(text), kShown), kDigits));
  }
  return std::stoull(text, nullptr, 16);
}

/// A shard has each particle once.
ShardEntry::Traces traces_of(const std::string& policy, const Json& traces) {
  constexpr std::uint64_t kMostIds = std::numeric_limits<std::uint32_t>::max();
  const std::string name = shown_name("traces", policy);
  const std::uint64_t lowest = whole_number(traces, "lowest", 0, kMostIds);
  const std::uint64_t highest = whole_number(traces, "highest", lowest, kMostIds);
  const std::uint64_t count = whole_number(traces, "count", 1, highest - lowest + 1);
  return {name, count, static_cast<std::uint32_t>(lowest), static_cast<std::uint32_t>(highest)};
}

ShardEntry entry_of(const Json& line) {
  ShardEntry entry;
  entry.shard = shown_name("shard", text_member(line, "shard"));
  // A name, not a path: what a manifest names lies in the campaign's own folder.
  if (entry.shard.find('/') != std::string::npos || !entry.shard.ends_with(".h5")) {
    throw InputError(
        fmt::format("shard: '{}': must be the name of a shard, as 000001.h5", clipped(entry.shard, kShown)));
  }
  entry.bytes = whole_number(line, "bytes", 0, std::numeric_limits<std::int64_t>::max());
  entry.digest = checksum(text_member(line, "xxh64"));
  for (const auto& [policy, traces] : member(line, "traces").items()) entry.traces.push_back(traces_of(policy, traces));
  return entry;
}

}  // namespace

std::string held_text(const ShardEntry& entry) {
  std::vector<std::string> held;
  for (const ShardEntry::Traces& traces : entry.traces) {
    held.push_back(fmt::format("{} traces of '{}' (particles {} to {})", traces.count, traces.policy, traces.lowest,
                               traces.highest));
  }
  return held.empty() ? "no traces" : fmt::to_string(fmt::join(held, ", "));
}

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

std::optional<ShardEntry> parse_manifest_line(const std::string& text, std::string* why) {
  const Json line = Json::parse(text, nullptr, false);
  if (line.is_discarded()) return std::nullopt;
  try {
    return entry_of(line);
  } catch (const InputError& error) {
    if (why != nullptr) *why = error.what();
    return std::nullopt;
  }
}

namespace {

/// Adds what a file holds; returns what of it is impossible.
ManifestFault read_entries(const Descriptor& file, const std::string& name, Manifest& manifest) {
  ManifestFault fault{name, 0, 0, ""};
  std::size_t number = 0;
  for_each_line(file.number(), kMostManifestBytes, [&](const std::string& line) {
    ++number;
    std::string why;
    if (auto entry = parse_manifest_line(line, &why)) {
      manifest[entry->shard] = std::move(*entry);
    } else if (!why.empty() && ++fault.lines == 1) {
      fault.line = number;
      fault.why = std::move(why);
    }
  });
  return fault;
}

}  // namespace

std::string fault_place(const ManifestFault& fault) {
  const std::string file = fmt::format("{}/{}", kManifestFolder, fault.file);
  return fault.no_file() ? file : fmt::format("{}:{}", file, fault.line);
}

std::string fault_text(const ManifestFault& fault) {
  if (fault.no_file()) return fault.why + "; it counts as missing";
  return fault.lines == 1 ? fault.why + "; the line counts as lost"
                          : fmt::format("{}; {} such lines count as lost", fault.why, fault.lines);
}

Manifest read_manifest(const Directory& directory, std::vector<ManifestFault>* faults) {
  Manifest manifest;
  const auto folder = directory.find(kManifestFolder);
  if (!folder) return manifest;
  const auto note = [&](ManifestFault fault) {
    if (faults != nullptr && !fault.why.empty()) faults->push_back(std::move(fault));
  };
  for (const std::string& name : manifest_files(*folder)) {
    if (const mode_t mode = folder->status(name).st_mode; mode != 0 && !S_ISREG(mode)) {
      note({name, 0, 0, "is " + kind_of(mode)});
      continue;
    }
    const auto file = folder->find_file(name);
    if (!file) continue;  // the writer has just made one file of all
    note(read_entries(*file, name, manifest));
  }
  return manifest;
}

void replace_manifest(const Directory& directory, const Manifest& manifest) {
  std::string text;
  for (const auto& [shard, entry] : manifest) text += manifest_line(entry) + "\n";
  const Directory folder = directory.make(kManifestFolder);
  std::vector<std::string> old = manifest_files(folder);
  std::erase_if(old, [&](const std::string& name) {
    const bool no_file = folder.has(name) && !folder.has_file(name);
    if (no_file) put_aside(directory, folder, name);
    return no_file;
  });
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
  return fmt::format("{}/{} is gone; it held {}", kShardFolder, shard.entry.shard, held_text(shard.entry));
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
