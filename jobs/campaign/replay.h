#pragma once
// One trace of an archive once more: simulated alone from what the archive kept, and compared with it.

#include <optional>
#include <string>
#include <vector>

#include "archive/replay_file.h"
#include "jobs/campaign/archived_scenario.h"

namespace graze {

/// Bytes of the frames and contacts that a replay keeps: they are held in memory until they are written. Half a million
/// frames of a quadruped.
inline constexpr double kMaxReplayBytes = 2e9;

struct ReplayRequest {
  std::string archive;  // campaign directory or packed file
  std::uint32_t particle = 0;
  std::string policy;        // name, or a glob that one policy has; empty: the only one
  bool any_version = false;  // also if this program's traces may have other bits
  bool unverified = false;   // also a trace that the archive does not hold
  bool record = false;       // keep the telemetry
  std::uint32_t every = 1;   // one frame for so many physics steps
  double most_bytes = kMaxReplayBytes;
};

struct Replay {
  CampaignInfo archived_info;
  std::vector<std::string> warnings;     // of the archive
  std::optional<TraceRecord> archived;   // none: the archive does not hold the trace
  std::vector<std::string> differences;  // between archived and replayed, a line each; empty: the same bits
  ReplayFile file;                       // what came out; its log is empty unless it was asked for
  bool verified() const { return archived && differences.empty(); }
};

/// Throws InputError: the archive does not hold the trace, kept no files, or was made by another results version.
Replay replay(const ReplayRequest& request);

/// What differs between a trace as archived and as it came out now, bit by bit, a line each. Without telemetry and
/// contact sequence, which follow from the rest. `kept`: what the archive has.
std::vector<std::string> trace_differences(const TraceRecord& archived, const TraceRecord& replayed,
                                           const CampaignInfo& info, const Recording& kept);

/// For people; `all`: every parameter and event instead of the most telling ones.
std::string format_replay(const Replay& replay, bool all);
std::string replay_json(const Replay& replay, const std::vector<std::string>& exported);

}  // namespace graze
