#include "jobs/campaign.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

#include "jobs/block_run.h"
#include "jobs/hand_out.h"
#include "jobs/particles.h"

namespace graze {
namespace {

/// The particles of one unit of work: those that could be made, and the records of those that could not.
struct Group {
  std::vector<Particle> particles;
  std::vector<double> values;  // of `particles`, [particle][parameter]
  std::vector<TraceRecord> failed;
  std::vector<double> failed_values;
};

/// Particles per unit of work: a block. Where lanes cost the same whether they are busy or not and traces may end
/// early, several blocks, so that lanes that have ended can be refilled; but no less than 8 units for each worker.
std::uint64_t group_size(const Scenario& scenario, std::uint64_t particles, std::uint64_t workers) {
  constexpr std::uint64_t kMostBlocks = 8, kUnitsPerWorker = 8;
  if (scenario.physics != "lanes" || !scenario.task.stop_at_violation) return kLanes;
  const std::uint64_t blocks = particles * scenario.policies.size() / (kLanes * kUnitsPerWorker * workers);
  return kLanes * std::clamp<std::uint64_t>(blocks, 1, kMostBlocks);
}

// Units per ticket at most: what a worker does between two looks at the shared counters, some tenths of a second.
constexpr std::uint64_t kMostUnits = 16;
// Added to the tickets, it ends the handing out everywhere.
constexpr std::uint64_t kNoMoreTickets = std::uint64_t{1} << 48;

/// What a worker has counted and not yet told the crew.
class Tally {
 public:
  explicit Tally(Crew& crew) : crew_(crew) {}

  void count(const std::vector<TraceRecord>& records, const RunCost& cost) {
    at(kTraces) += records.size();
    at(kSteps) += cost.steps;
    for (const TraceRecord& record : records) ++at(kSuccess + static_cast<std::size_t>(record.outcome));
    if (Clock::now() - told_ > std::chrono::seconds(1)) tell();
  }
  void tell() {
    crew_.add(kTraces, counts_);
    counts_ = {};
    told_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::uint64_t& at(std::size_t counter) { return counts_[counter - kTraces]; }
  Crew& crew_;
  std::array<std::uint64_t, kSteps - kTraces + 1> counts_{};
  Clock::time_point told_ = Clock::now();
};

class Campaign {
 public:
  Campaign(const Scenario& scenario, const CampaignOptions& options, Crew& crew, const TraceSink& sink)
      : scenario_(scenario),
        options_(options),
        crew_(crew),
        sink_(sink),
        threads_(options.threads > 0 ? options.threads : default_threads()),
        source_(scenario, options.seed, options.particles),
        group_(group_size(scenario, options.particles, workers())),
        hand_out_((options.particles + group_ - 1) / group_ * scenario.policies.size(), workers(),
                  options.looks ? 1 : kMostUnits) {}

  bool run() {
    std::vector<std::thread> threads;
    for (int i = 1; i < threads_; ++i) threads.emplace_back([this] { work(); });
    work();
    for (std::thread& thread : threads) thread.join();
    if (error_) std::rethrow_exception(error_);
    return !stopped_ || (options_.looks && options_.looks->answered_at() > 0);
  }

 private:
  using Runs = std::map<int, BlockRun>;  // by policy, made when first needed

  std::uint64_t workers() const { return options_.workers > 0 ? options_.workers : threads_; }

  /// One thread's part: units of work until there are none left.
  void work() {
    Runs runs;
    Tally tally(crew_);
    try {
      for (std::uint64_t ticket = 0; take(ticket);) {
        const HandOut::Range units = hand_out_.range(ticket);
        for (std::uint64_t unit = units.begin; unit < units.end && !stop_asked(); ++unit) run_unit(unit, runs, tally);
        tally.tell();
      }
    } catch (...) {
      const std::lock_guard lock(error_mutex_);
      if (!error_) error_ = std::current_exception();
      stop();
    }
  }

  /// Draws a ticket; false if there is nothing left to do.
  bool take(std::uint64_t& ticket) {
    if (stop_asked()) return false;
    ticket = crew_.fetch_add(kTickets, 1);
    if (ticket >= kNoMoreTickets) stopped_ = true;
    return !hand_out_.range(ticket).empty();
  }

  bool stop_asked() {
    if (!stopped_ && options_.stop && options_.stop->load(std::memory_order_relaxed)) stop();
    return stopped_;
  }

  /// No unit is begun any more, here or elsewhere.
  void stop() {
    if (!stopped_.exchange(true)) crew_.fetch_add(kTickets, kNoMoreTickets);
  }

  void run_unit(std::uint64_t unit, Runs& runs, Tally& tally) {
    const int policies = static_cast<int>(scenario_.policies.size());
    const int policy = static_cast<int>(unit % policies);
    Group group = make_group(unit / policies, scenario_.policies[policy].name);
    if (group.particles.empty() && group.failed.empty()) return;
    auto run = runs.find(policy);
    if (run == runs.end()) {
      run = runs.emplace(policy, BlockRun(scenario_, scenario_.policies[policy], options_.seed)).first;
    }
    RunCost cost;
    std::vector<TraceRecord> records = run->second.run(group.particles, &cost);
    std::move(group.failed.begin(), group.failed.end(), std::back_inserter(records));
    group.values.insert(group.values.end(), group.failed_values.begin(), group.failed_values.end());
    tally.count(records, cost);
    if (options_.looks && options_.looks->count(policy, records)) stop();
    sink_(policy, std::move(records), std::move(group.values));
  }

  /// The particles of a group that are not finished under a policy.
  Group make_group(std::uint64_t index, const std::string& policy) {
    Group group;
    const std::uint64_t end = std::min<std::uint64_t>(options_.particles, (index + 1) * group_);
    for (std::uint64_t i = index * group_; i < end; ++i) {
      if (options_.is_finished && options_.is_finished(policy, i)) continue;
      const auto id = static_cast<std::uint32_t>(i);
      const std::vector<double> values = source_.draw(id);
      try {
        group.particles.push_back(source_.fabricate(id, values));
        group.values.insert(group.values.end(), values.begin(), values.end());
      } catch (const InputError& error) {
        group.failed.push_back(unfabricated(id, scenario_, error.what()));
        group.failed_values.insert(group.failed_values.end(), values.begin(), values.end());
      }
    }
    return group;
  }

  const Scenario& scenario_;
  const CampaignOptions& options_;
  Crew& crew_;
  const TraceSink& sink_;
  const int threads_;
  const ParticleSource source_;
  const std::uint64_t group_;  // particles per unit of work
  const HandOut hand_out_;
  std::atomic<bool> stopped_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;  // the first
};

}  // namespace

CampaignProgress progress_of(Crew& crew) {
  const auto counts = crew.read(kTraces, kSteps - kTraces + 1);
  const auto of = [&](SharedCounter counter) { return counts[counter - kTraces]; };
  return {of(kTraces), of(kSuccess), of(kKnownFailure), of(kUnknownFailure), of(kInvalid), of(kSteps)};
}

bool run_campaign(const Scenario& scenario, const CampaignOptions& options, Crew& crew, const TraceSink& sink) {
  return Campaign(scenario, options, crew, sink).run();
}

}  // namespace graze
