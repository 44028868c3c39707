#pragma once
// The manifest of a campaign directory: what each shard holds, one JSON line per shard, in manifest/NAME.jsonl. Each
// writing process has a file of its own, so that any number of them never wait for each other. A line is appended after
// its shard got its name: the manifest may lack a shard (its writer was killed in between), but it never names one that
// was not there. So a shard that it names and that is gone has been lost, and readers say which. It can always be
// rebuilt from the shards; `graze resume` does.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "archive/files/directory.h"

namespace graze {

inline constexpr const char* kManifestFolder = "manifest";

/// What a shard holds.
struct ShardEntry {
  std::string shard;                    // name below shards/: "000001.h5"
  std::uint64_t bytes = 0, digest = 0;  // of the shard's seal: bytes before it and their XXH64
  struct Traces {
    std::string policy;
    std::uint64_t count = 0;
    std::uint32_t lowest = 0, highest = 0;  // particle ids

    bool operator==(const Traces&) const = default;
  };
  std::vector<Traces> traces;  // policies that it has traces of
};
/// "8 traces of 'step/1cm' (particles 8 to 15), …"
std::string held_text(const ShardEntry& entry);

/// One line, without its end.
std::string manifest_line(const ShardEntry& entry);
/// Nothing if the line is torn or no entry. `why`: the value and the rule that it breaks, if it is whole and yet
/// nothing that a campaign writes; untouched if it is torn.
std::optional<ShardEntry> parse_manifest_line(const std::string& line, std::string* why = nullptr);

/// By name of the shard.
using Manifest = std::map<std::string, ShardEntry>;

/// What of a manifest counts as lost, beside torn lines, which a writer that is killed leaves.
struct ManifestFault {
  std::string file;       // name below manifest/
  std::size_t line = 0;   // the first that is impossible, from 1; 0: what has the name is no file
  std::size_t lines = 0;  // so many are
  std::string why;        // "is a named pipe", "count: 7: must be …"
  bool no_file() const { return line == 0; }
};
/// "manifest/all.jsonl:3"; a line beyond a mebibyte is not counted.
std::string fault_place(const ManifestFault& fault);
/// "count: 7: must be …; the line counts as lost"
std::string fault_text(const ManifestFault& fault);

/// All files of a directory's manifest. What is torn, impossible, or no file counts as lost; `faults`: the last two.
/// Throws InputError if the folder is none or a file may not be read.
Manifest read_manifest(const Directory& directory, std::vector<ManifestFault>* faults = nullptr);

/// One file with these entries in place of all that were there; what has the name of one and is none goes into damaged/
/// (put_aside()). Throws InputError, MachineError.
void replace_manifest(const Directory& directory, const Manifest& manifest);

/// A shard that the manifest names and that is not there under this name.
struct MissingShard {
  ShardEntry entry;
  std::string now;  // the name that somebody has given it, which the manifest does not know; empty: it is gone
};
/// Those of a manifest. Read it before listing shards: a campaign may be running. Throws InputError.
std::vector<MissingShard> missing_shards(const Directory& directory, const Manifest& manifest);
/// "shards/000002.h5 is gone; it held 8 traces of 'step/1cm' (particles 8 to 15)", or "shards/000002.h5 is
/// shards/000007.h5 now; nothing is lost"
std::string missing_text(const MissingShard& shard);

/// Appends lines to one file, manifest/NAME.jsonl; made when it is first needed.
class ManifestWriter {
 public:
  ManifestWriter(Directory directory, const std::string& name);
  /// One write at the end of the file, then synced. Throws MachineError.
  void append(const ShardEntry& entry);

 private:
  Directory directory_;
  std::string name_;
  Descriptor file_;
};

}  // namespace graze
