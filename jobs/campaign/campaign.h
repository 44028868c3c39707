#pragma once
// A campaign: all particles x all policies of a scenario, in blocks over the threads of this process and, if it is one
// of several ranks, together with the others.

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "archive/archive.h"
#include "jobs/campaign/communicator.h"
#include "jobs/campaign/stopping_rule.h"
#include "scenarios/scenario.h"

namespace graze {

struct UnfinishedParticle;  // jobs/contained.h

struct CampaignOptions {
  std::uint64_t particles = 0;
  ParticleRange part;  // to simulate of them
  std::uint64_t seed = 1;
  int threads = 0;                          // of this process; 0: as many as it may use
  std::uint64_t workers = 0;                // threads of all ranks, the same number at each; 0: threads
  const std::atomic<bool>* stop = nullptr;  // set from outside: finish the blocks under way, start no more
  std::uint64_t finished = 0;               // traces that are there already
  std::function<bool(const std::string& policy, std::uint64_t particle)> is_finished;  // which; none: null
  StoppingRule* stopping_rule = nullptr;  // ends the campaign when its questions are answered; none: null
  double watchdog = 0;                    // s, longest time for one trace on this machine; 0: any
  /// Called from any thread for a particle that is left without a trace by the fault of the machine; null: nobody asks.
  std::function<void(const std::string& policy, const UnfinishedParticle&)> unfinished;
};

/// How far the whole communicator is.
struct CampaignProgress {
  std::uint64_t traces = 0, success = 0, known = 0, unknown = 0, invalid = 0, steps = 0;
};
CampaignProgress progress_of(Communicator& comm);

/// No rank begins anything any more.
void stop_all(Communicator& comm);

/// Where finished traces go: policy index, records, and the particles' values [trace][parameter]. Called from any
/// thread, one block at a time per thread.
using TraceSink = std::function<void(int policy, std::vector<TraceRecord> traces, std::vector<double> values)>;

/// How this process's share of a campaign ended.
struct CampaignEnd {
  bool stopped = false;              // here or elsewhere: work was left undone
  std::uint64_t unfinished = 0;      // particles that were cut off
  std::exception_ptr error;          // the first of a sink, or of making a policy; it stopped all ranks
  std::vector<std::thread> hanging;  // cannot be joined; they use the scenario for as long as the process lives
  // What has simulated. With it go controllers in the program itself, whose destroy() may end the program: the traces
  // are to be safe before.
  std::vector<std::shared_ptr<const void>> runs;
  bool complete() const { return !stopped && unfinished == 0 && !error; }
};

/// Runs this process's share of everything; all ranks of the communicator call it. Faults of particles are contained
/// (jobs/contained.h).
CampaignEnd run_campaign(const Scenario& scenario, const CampaignOptions& options, Communicator& comm,
                         const TraceSink& sink);

}  // namespace graze
