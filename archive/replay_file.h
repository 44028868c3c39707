#pragma once
// What a replay exports: one trace with everything that was known at each of its physics steps, as HDF5 or as CSV.
// Format: docs/replay.md.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "archive/archive.h"
#include "simulation/step_log.h"

namespace graze {

struct ReplayedParameter {
  std::string name, unit, distribution;
  double nominal = 0, value = 0;
  double deviations = 0;                   // (value - mean) / std of the distribution; NaN: it has none
  std::string nominal_label, value_label;  // of choices
};

/// What fabrication made of the particle: a name and unit of derived_numbers().
struct ReplayedNumber {
  std::string name, unit;
  double nominal = 0, value = 0;
};

struct ReplayedRequirement {
  std::string name, description, unit;
  double from = 0, to = 0;  // s: when it counts
  bool measure = false;     // decides nothing
};

struct ReplayFile {
  std::string archive, policy;
  CampaignInfo info;  // of the scenario that was replayed
  TraceRecord trace;
  std::string verification;                      // "identical", "different", "unverified"
  std::optional<std::uint64_t> archived_digest;  // none: unverified
  std::vector<ReplayedRequirement> requirements;
  std::vector<ReplayedParameter> parameters;
  std::vector<ReplayedNumber> derived;  // empty: the particle could not be fabricated
  StepLog log;

  /// Of a measure, the i-th of `requirements`: "yes", "no", "undecided" (kept_by); empty: a requirement, or the trace
  /// is invalid.
  std::string kept(std::size_t i) const;
};

/// The files that write_replay() makes for `output`: one ending in .h5, or, for one ending in .csv, NAME.csv (frames),
/// NAME.contacts.csv, NAME.events.csv, NAME.phases.csv, NAME.parameters.csv, NAME.derived.csv and NAME.trace.csv.
/// Throws InputError for other endings.
std::vector<std::filesystem::path> replay_files(const std::filesystem::path& output);

/// Throws InputError unless a replay of `archive` may be written: a known ending, none of the files exists (unless
/// `force`), or is or lies within the archive or one of the `inputs` of its campaign.
void check_replay_output(const std::filesystem::path& output, bool force, const std::filesystem::path& archive,
                         const std::vector<std::filesystem::path>& inputs = {});
/// Each file appears whole or not at all, and takes another's place with `force` only. Throws MachineError, InputError.
void write_replay(const ReplayFile& replay, const std::filesystem::path& output, bool force);

/// The parts of write_replay().
void write_replay_hdf5(const ReplayFile& replay, const std::filesystem::path& file, bool force);
void write_replay_csv(const ReplayFile& replay, const std::vector<std::filesystem::path>& files, bool force);

}  // namespace graze
