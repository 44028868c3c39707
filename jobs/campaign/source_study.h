#pragma once
// Simulates a scenario with each of its sources of uncertainty alone, with none and with all of them.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/sources.h"
#include "scenarios/scenario.h"

namespace graze {

struct SourceQuestion {
  std::uint64_t particles = 0, seed = 1;
  int threads = 0;      // 0: all of this machine's
  double watchdog = 0;  // s, as CampaignOptions
  /// Told before a source is simulated: the how many-th it is, from 1, and of how many.
  std::function<void(const std::string& source, std::size_t number, std::size_t all)> begins = {};
};

/// Rows by source (none, those that the scenario has, all), then by policy. Particle i of a source has the values that
/// it has with all of them, as far as the design and correlations let it. With no source at all there is one particle.
/// Nothing is written. The same for any number of threads. Throws MachineError if particles were left unfinished.
std::vector<SourceSpread> study_sources(const Scenario& scenario, const SourceQuestion& question);

}  // namespace graze
