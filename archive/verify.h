#pragma once
// Is an archive whole? Every seal, every dataset, every count, and what `graze resume` would mend. Changes nothing.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace graze {

struct VerifiedFile {
  enum class State { whole, damaged, missing, leftover, set_aside, newer };
  std::string name;  // below the directory; of a packed file its path
  State state = State::whole;
  std::uint64_t traces = 0;  // that it holds, or held according to the manifest
  std::string what = {};     // is wrong with it, and what becomes of it
};
const char* state_name(VerifiedFile::State state);

enum class Soundness {
  whole,
  incomplete,  // `graze resume` does the rest; of a packed file: it was packed before the campaign was complete
  damaged,     // in a way that `graze resume` cannot mend
};
const char* soundness_name(Soundness soundness);

struct Verification {
  Soundness soundness = Soundness::whole;
  bool packed = false;                // one file
  std::optional<std::string> writer;  // that works there now
  std::vector<VerifiedFile> files;
  std::uint64_t shards = 0;              // whole ones
  std::uint64_t traces = 0, total = 0;   // that are there, each once; of the campaign, or of its part
  std::uint64_t lost = 0;                // traces that shards held which are damaged or gone, as far as is known
  std::uint64_t unfinished = 0;          // particles that the machine failed
  std::vector<std::string> faults = {};  // of the whole, beside those of files
  /// That `graze resume` would simulate.
  std::uint64_t left() const { return total - std::min(total, traces); }
};

/// Looks at a campaign directory or a packed file. Files are read by children first (reading_child.h). Throws
/// InputError if there is no archive, or what is there is not to be read at all.
Verification verify(const std::filesystem::path& path);

}  // namespace graze
