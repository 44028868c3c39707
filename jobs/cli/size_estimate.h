#pragma once
// How large an archive will be, before anything is simulated, and whether it fits on the disk.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "archive/archive.h"
#include "scenarios/scenario.h"

namespace graze {

/// Bytes of a campaign, or of a part of one. Packed, events and telemetry take less.
struct SizeEstimate {
  std::uint64_t particles = 0, policies = 0;
  double values = 0, traces = 0, events = 0, telemetry = 0;  // B
  double inputs = 0;                                         // B, of the robot and all that was read, at most
  bool logs_events = false;                                  // beside contact phases
  std::uint64_t probed = 0;                                  // traces that were simulated to find out; 0: none
  double seconds = 0;                                        // of one processor, for the whole campaign; 0: not known
  double step_seconds = 0;                                   // likewise, for one step of one particle
  double total() const { return values + traces + events + telemetry + inputs; }
};

/// From the scenario alone: values and rows of traces exactly; events at 200 per simulated second where anything can
/// touch; traces as long as they may be, half of them failing. `part`: of the particles, if it is not about all.
SizeEstimate estimate_size(const Scenario& scenario, const ParticleRange& part = {});

/// Simulates one block under each policy and goes by what comes out. The same particles as a campaign's first ones.
SizeEstimate probe_size(const Scenario& scenario);

/// Bytes that are free where `archive` would be written; none if that cannot be told.
std::optional<double> free_bytes(const std::filesystem::path& archive);

/// "1.5 GB"
std::string bytes_text(double bytes);

/// One line: how much for what, and how much is free.
std::string size_text(const SizeEstimate& estimate, std::optional<double> free);

/// Before a campaign starts: throws MachineError if its archive cannot fit, warns if it may not. `packed`: it is packed
/// in the same place afterwards, which takes as much again.
void check_space(const SizeEstimate& estimate, const std::filesystem::path& archive, bool packed);

}  // namespace graze
