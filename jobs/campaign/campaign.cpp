#include "jobs/campaign/campaign.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <utility>

#include "archive/files/utf8.h"
#include "jobs/campaign/hand_out.h"
#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/workers.h"
#include "jobs/workers/controllers.h"
#include "simulation/contained.h"
#include "simulation/particles.h"

namespace graze {
namespace {

/// Particles per unit of work: a block, not quite full where that lets all workers end together. Where lanes cost the
/// same whether they are busy or not and traces may end early, several blocks, so that lanes that have ended can be
/// refilled; but no less than 8 units for each worker.
std::uint64_t group_size(const Scenario& scenario, std::uint64_t particles, std::uint64_t workers) {
  constexpr std::uint64_t kMostBlocks = 8, kUnitsPerWorker = 8;
  const std::uint64_t policies = scenario.policies.size();
  const std::uint64_t blocks = particles * policies / (kLanes * kUnitsPerWorker * workers);
  const bool refills = scenario.physics == "lanes" && scenario.task.stop_at_violation;
  if (refills && blocks > 1) return kLanes * std::min(blocks, kMostBlocks);
  return even_unit(particles, policies, workers, kLanes);
}

Particle known_by(std::uint32_t id) {
  Particle out;
  out.id = id;
  return out;
}

std::vector<bool> which_elsewhere(const Scenario& scenario) {
  std::vector<bool> out;
  for (const PolicySpec& policy : scenario.policies) out.push_back(runs_elsewhere(policy));
  return out;
}

// Units per ticket at most: what a worker does between two reads of the shared counters, some tenths of a second.
constexpr std::uint64_t kMostUnits = 16;
// Added to the tickets, it ends the handing out everywhere.
constexpr std::uint64_t kNoMoreTickets = std::uint64_t{1} << 48;

/// What a worker has counted and not yet told the communicator.
class Tally {
 public:
  explicit Tally(Communicator& comm) : comm_(&comm) {}

  /// `told`: steps of which the communicator knows already.
  void count(const std::vector<TraceRecord>& records, const RunCost& cost, std::uint64_t told) {
    at(kTraces) += records.size();
    at(kSteps) += cost.steps - told;
    for (const TraceRecord& record : records) ++at(kSuccess + static_cast<std::size_t>(record.outcome));
    if (Clock::now() - told_ > std::chrono::seconds(1)) tell();
  }
  void tell() {
    comm_->add(kTraces, counts_);
    counts_ = {};
    told_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::uint64_t& at(std::size_t counter) { return counts_[counter - kTraces]; }
  Communicator* comm_;
  std::array<std::uint64_t, kSteps - kTraces + 1> counts_{};
  Clock::time_point told_ = Clock::now();
};

class Campaign {
 public:
  Campaign(const Scenario& scenario, const CampaignOptions& options, Communicator& comm, const TraceSink& sink)
      : scenario_(scenario),
        options_(options),
        comm_(comm),
        sink_(sink),
        threads_(options.threads > 0 ? options.threads : default_threads()),
        source_(scenario, options.seed, options.particles),
        run_elsewhere_(controllers_elsewhere(scenario, options.seed, options.particles, options.watchdog)),
        elsewhere_(which_elsewhere(scenario)),
        group_(group_size(scenario, options.part.count(options.particles), workers())),
        hand_out_((options.part.count(options.particles) + group_ - 1) / group_ * scenario.policies.size(), workers(),
                  options.stopping_rule ? 1 : kMostUnits) {}

  CampaignEnd run() {
    Workers workers(options_.watchdog);
    for (int i = 0; i < threads_; ++i) {
      try {
        start_worker(std::make_shared<WorkerState>(comm_), workers);
      } catch (const std::exception&) {  // no memory, or no more threads for this user
        if (i == 0) throw;
        break;  // those that there are do it, too
      }
    }
    CampaignEnd end;
    end.hanging = workers.wait();
    tell_mixed_up();
    end.stopped = stopped_ && !(options_.stopping_rule && options_.stopping_rule->answered_at() > 0);
    end.unfinished = unfinished_;
    end.error = error_;
    const std::lock_guard lock(runs_mutex_);
    end.runs = std::move(runs_);
    return end;
  }

 private:
  /// What one thread works on. Another goes on with it if the thread hangs.
  struct WorkerState {
    explicit WorkerState(Communicator& comm) : tally(comm) {
      watch.teller = [&comm](std::uint64_t steps) { comm.fetch_add(kSteps, steps); };
    }
    TraceWatch watch;
    HandOut::Range units{0, 0};      // of its ticket, not begun
    std::shared_ptr<WorkUnit> unit;  // under way
    Tally tally;
  };

  std::uint64_t workers() const { return options_.workers > 0 ? options_.workers : threads_; }

  /// Starts a thread that goes on from `state`.
  void start_worker(const std::shared_ptr<WorkerState>& state, Workers& workers) {
    const auto replace_worker = [this, state, &workers, taken = false]() mutable {
      const auto next = std::make_shared<WorkerState>(comm_);
      next->units = state->units;
      next->unit = state->unit;
      next->tally = state->tally;
      if (!taken) take_over(*next->unit);
      taken = true;  // if there is no thread now, the next check of the watchdog tries again
      start_worker(next, workers);
    };
    workers.start(
        {state, &state->watch}, [this, state] { work(state); }, replace_worker);
  }

  /// A thread's state and what simulates for it, which ends with the campaign's answer (CampaignEnd::runs).
  struct KeptRun {
    std::shared_ptr<WorkerState> state;
    ContainedRun run;
  };

  /// Not of a thread that hangs, which goes on using it.
  void keep_run(std::shared_ptr<KeptRun> done) {
    const std::lock_guard lock(runs_mutex_);
    runs_.push_back(std::move(done));
  }

  /// One thread's part: units of work until there are none left.
  void work(const std::shared_ptr<WorkerState>& shared) {
    WorkerState& state = *shared;
    std::shared_ptr<KeptRun> kept;
    try {
      kept = std::make_shared<KeptRun>(
          KeptRun{shared, ContainedRun(scenario_, options_.seed, state.watch, run_elsewhere_)});
      do {
        while (state.unit || (!state.units.empty() && !stop_asked())) {
          if (!state.unit) state.unit = make_unit(state.units.begin++);
          kept->run.run(*state.unit);
          finish(*std::exchange(state.unit, nullptr), state.tally, state.watch.take_told());
        }
        state.tally.tell();
      } while (take(state.units));
    } catch (const GivenUp&) {
      throw;
    } catch (...) {
      {
        const std::lock_guard lock(error_mutex_);
        if (!error_) error_ = std::current_exception();
        stop();
      }
      keep_finished(state);
    }
    if (!kept) return;
    kept->run.end_elsewhere();  // it may take a while, and here the threads do it beside each other
    keep_run(std::move(kept));
  }

  /// What a unit has finished before something ended the campaign in its middle.
  void keep_finished(WorkerState& state) {
    if (!state.unit) return;
    try {
      finish(*std::exchange(state.unit, nullptr), state.tally, state.watch.take_told());
    } catch (const std::exception&) {
      // The first failure is the one that is told.
    }
  }

  /// Draws a ticket; false if there is nothing left to do.
  bool take(HandOut::Range& units) {
    if (stop_asked()) return false;
    const std::uint64_t ticket = comm_.fetch_add(kTickets, 1);
    if (ticket >= kNoMoreTickets) stopped_ = true;
    units = hand_out_.range(ticket);
    return !units.empty();
  }

  bool stop_asked() {
    if (!stopped_ && options_.stop && options_.stop->load(std::memory_order_relaxed)) stop();
    return stopped_;
  }

  /// No unit is begun any more, here or elsewhere.
  void stop() {
    if (!stopped_.exchange(true)) stop_all(comm_);
  }

  /// The particles of a unit that are not finished; those that cannot be fabricated are `invalid` at once.
  std::shared_ptr<WorkUnit> make_unit(std::uint64_t index) {
    auto unit = std::make_shared<WorkUnit>();
    const std::uint64_t policies = scenario_.policies.size(), group = index / policies;
    unit->policy = static_cast<int>(index % policies);
    const std::string& policy = scenario_.policies[unit->policy].name;
    const bool elsewhere = elsewhere_[unit->policy];
    const std::uint64_t begin = options_.part.begin + group * group_;
    const std::uint64_t end = options_.part.begin + options_.part.count(options_.particles);
    for (std::uint64_t i = begin; i < std::min(end, begin + group_); ++i) {
      if (options_.is_finished && options_.is_finished(policy, i)) continue;
      const auto id = static_cast<std::uint32_t>(i);
      const std::vector<double> values = source_.draw(id);
      std::vector<double>* to = &unit->values;
      try {
        unit->particles.push_back(elsewhere ? known_by(id) : source_.fabricate(id, values));
      } catch (const InputError& error) {
        unit->records.push_back(unfabricated(id, scenario_, error.what()));
        to = &unit->record_values;
      }
      to->insert(to->end(), values.begin(), values.end());
    }
    return unit;
  }

  /// Traces of such blocks stand in the archive as if nothing had been.
  void tell_mixed_up() {
    const std::lock_guard lock(mixed_up_mutex_);
    for (const auto& [policy, found] : mixed_up_) {
      spdlog::warn(
          "policy {}: {} of robots beside each other failed ({}), and not when each was simulated alone, which is what "
          "is kept: its controller seems to mix up robots or lanes{}; 'graze check SCENARIO --determinism' looks at "
          "that",
          printable(scenario_.policies[policy].name),
          found.blocks == 1 ? "a block" : fmt::format("{} blocks", found.blocks), printable(found.reason),
          found.late ? ", or is now and then too slow for its timeout" : "");
    }
  }

  /// Hands over what came out. `told`: steps of it that the communicator knows of.
  void finish(WorkUnit& unit, Tally& tally, std::uint64_t told) {
    if (unit.mixes_up()) {
      const std::lock_guard lock(mixed_up_mutex_);
      MixedUp& found = mixed_up_[unit.policy];
      if (found.blocks++ == 0) found.reason = unit.failed_together;
      found.late = found.late || unit.came_late;
    }
    for (const UnfinishedParticle& particle : unit.unfinished) {
      ++unfinished_;
      comm_.fetch_add(kUnfinished, 1);
      if (options_.unfinished) options_.unfinished(scenario_.policies[unit.policy].name, particle);
    }
    if (options_.stopping_rule && !unit.unfinished.empty()) stop();  // the next look would wait for it in vain
    if (unit.records.empty()) return;
    tally.count(unit.records, unit.cost, told);
    if (options_.stopping_rule && options_.stopping_rule->count(unit.policy, unit.records)) stop();
    sink_(unit.policy, std::move(unit.records), std::move(unit.record_values));
  }

  const Scenario& scenario_;
  const CampaignOptions& options_;
  Communicator& comm_;
  const TraceSink& sink_;
  const int threads_;
  const ParticleSource source_;
  const RunElsewhere run_elsewhere_;
  const std::vector<bool> elsewhere_;  // of each policy: its particles are fabricated where they are simulated
  const std::uint64_t group_;          // particles per unit of work
  const HandOut hand_out_;
  std::atomic<bool> stopped_{false};
  std::atomic<std::uint64_t> unfinished_{0};
  struct MixedUp {
    std::uint64_t blocks = 0;
    std::string reason;  // of the first
    bool late = false;   // some of them did not come back in time
  };
  std::mutex mixed_up_mutex_;
  std::map<int, MixedUp> mixed_up_;  // by policy
  std::mutex runs_mutex_;
  std::vector<std::shared_ptr<const void>> runs_;
  std::mutex error_mutex_;
  std::exception_ptr error_;  // the first
};

}  // namespace

CampaignProgress progress_of(Communicator& comm) {
  const auto counts = comm.read(kTraces, kSteps - kTraces + 1);
  const auto of = [&](SharedCounter counter) { return counts[counter - kTraces]; };
  return {of(kTraces), of(kSuccess), of(kKnownFailure), of(kUnknownFailure), of(kInvalid), of(kSteps)};
}

void stop_all(Communicator& comm) { comm.fetch_add(kTickets, kNoMoreTickets); }

CampaignEnd run_campaign(const Scenario& scenario, const CampaignOptions& options, Communicator& comm,
                         const TraceSink& sink) {
  // Whoever destroys a controller waits for it; to the end of the process, since nobody knows where the last one ends.
  if (libraries_allowed() != LibraryLoading::refused) {
    [[maybe_unused]] static const auto* const ends = new EndHangingControllers(WatchedCalls::ends);
  }
  return Campaign(scenario, options, comm, sink).run();
}

}  // namespace graze
