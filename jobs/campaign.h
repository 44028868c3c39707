#pragma once
// A campaign: all particles x all policies of a scenario, in blocks over the threads of this machine.

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "archive/archive.h"
#include "scenarios/scenario.h"

namespace graze {

struct CampaignOptions {
  std::uint64_t particles = 0;
  std::uint64_t seed = 1;
  int threads = 0;                          // 0: as many as the machine has
  const std::atomic<bool>* stop = nullptr;  // set from outside: finish the blocks under way, start no more
  std::uint64_t finished = 0;               // traces that are there already
  std::function<bool(const std::string& policy, std::uint64_t particle)> is_finished;  // which; none: null
};

/// How far a campaign is. Counters only grow; read from any thread.
struct CampaignProgress {
  std::atomic<std::uint64_t> traces{0}, success{0}, known{0}, unknown{0}, invalid{0}, steps{0};
};

/// Where finished traces go: policy index, records, and the particles' values [trace][parameter]. Called from any
/// thread, one block at a time per thread.
using TraceSink = std::function<void(int policy, std::vector<TraceRecord> traces, std::vector<double> values)>;

/// Runs everything. Returns true if all was done, false if it was stopped. The first exception of a sink or a block
/// ends the campaign and is rethrown here; a particle that cannot be fabricated becomes an `invalid` trace.
bool run_campaign(const Scenario& scenario, const CampaignOptions& options, CampaignProgress& progress,
                  const TraceSink& sink);

}  // namespace graze
