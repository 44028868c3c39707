#include "simulation/predictor.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

#include "engine/settings/signal_stack.h"
#include "simulation/contained.h"
#include "simulation/prediction_tally.h"

namespace graze {
namespace {

using Clock = std::chrono::steady_clock;

/// Of the deadline, kept for what comes after the last step: threads that end, sums, which take 0.2 ms for 1000
/// particles here, and times in which a processor is another's. At most 5 ms: with 2 ms 18 of 1000 calls were up to 4
/// ms late on a machine that others share.
constexpr double kReserve = 0.05, kMostReserve = 5e-3;  // share; s

/// Eight particles as they were fabricated; made once.
struct ParticleBlock {
  std::mutex mutex;  // while they are made
  bool made = false;
  std::vector<Particle> particles;
  std::uint64_t failed = 0;  // that could not be made
  std::string why;           // the first of these could not
};

/// The blocks of a simulation's particles.
class ParticleBlocks {
 public:
  explicit ParticleBlocks(const Simulation& simulation) : simulation_(simulation) {}

  /// Made now if it has not been. Throws PastDeadline.
  ParticleBlock& at(std::uint64_t index, std::uint64_t particles, const TraceWatch& watch) {
    ParticleBlock* block = nullptr;
    {
      const std::lock_guard lock(mutex_);
      block = &blocks_[index];
    }
    const std::lock_guard lock(block->mutex);
    if (!block->made) make(index, particles, watch, *block);
    return *block;
  }

  /// Forgets those that are too many to keep, and one that lacks some of its particles.
  void trim(std::uint64_t particles) {
    if (particles % kLanes > 0) blocks_.erase(particles / kLanes);
    blocks_.erase(blocks_.lower_bound(Predictor::kKeptParticles / kLanes), blocks_.end());
  }

 private:
  void make(std::uint64_t index, std::uint64_t particles, const TraceWatch& watch, ParticleBlock& block) const {
    const std::uint64_t end = std::min((index + 1) * kLanes, particles);
    std::vector<Particle> made;
    std::uint64_t failed = 0;
    std::string why;
    for (std::uint64_t id = index * kLanes; id < end; ++id) {
      watch.check();
      try {
        made.push_back(simulation_.particle(static_cast<std::uint32_t>(id)));
      } catch (const InputError& error) {
        if (failed++ == 0) why = error.what();
      }
    }
    block.particles = std::move(made);
    block.failed = failed;
    block.why = std::move(why);
    block.made = true;
  }

  const Simulation& simulation_;
  std::mutex mutex_;  // guards the map; blocks stay where they are
  std::map<std::uint64_t, ParticleBlock> blocks_;
};

/// Recording costs time, and nobody reads it.
Scenario without_records(const Scenario& scenario) {
  Scenario out = scenario;
  out.recording.telemetry = Telemetry::none;
  out.recording.phases = out.recording.events = false;
  return out;
}

/// Throws InputError.
double end_of_prediction(const Scenario& scenario, const StateEstimate& estimate, const PredictionLimits& limits) {
  const Timing& timing = scenario.timing;
  if (!(limits.horizon >= 0)) throw InputError(fmt::format("a horizon of {} s; it must be > 0", limits.horizon));
  const double end = limits.horizon > 0 ? estimate.time + limits.horizon : timing.end;
  if (end > timing.end + 1e-9) {
    throw InputError(
        fmt::format("a horizon of {} s from {} s on ends at {} s, beyond the scenario's end ({} s); let it be "
                    "{:.6g} s, or time.end {:.6g} s",
                    limits.horizon, estimate.time, end, timing.end, timing.end - estimate.time, end));
  }
  return std::round(end / timing.step) * timing.step;
}

/// Throws InputError.
std::uint64_t most_particles(const Simulation& simulation, const PredictionLimits& limits) {
  if (!(limits.deadline > 0)) throw InputError(fmt::format("a deadline of {} s; it must be > 0", limits.deadline));
  if (limits.particles == 0 && std::isinf(limits.deadline)) {
    throw InputError("a prediction without a deadline needs a number of particles");
  }
  const bool counted = simulation.scenario().design == Design::latin_hypercube;
  const std::uint64_t there = counted ? simulation.particles() : kParticleLimit;
  if (limits.particles > there) {
    throw InputError(fmt::format("{} particles; there are {}{}", limits.particles, there,
                                 counted ? ", which the Latin hypercube was made for" : ""));
  }
  return limits.particles > 0 ? limits.particles : there;
}

}  // namespace

struct Predictor::Impl {
  /// What one thread simulates with.
  struct Worker {
    explicit Worker(const Scenario& scenario) : run(scenario, scenario.seed, watch) {}
    TraceWatch watch;
    ContainedRun run;
  };
  /// One call: blocks under candidates, dealt out in order.
  struct Call {
    const StateEstimate& estimate;
    const EstimateDraws draws;
    const double end;  // s, of the traces
    const std::uint64_t particles;
    Clock::time_point stop;
    std::atomic<std::uint64_t> next{0}, steps{0};
    std::atomic<bool> failed{false};
    std::mutex mutex = {};                               // guards the rest
    std::map<std::uint64_t, PredictionTally> done = {};  // by block * candidates + candidate
    std::exception_ptr error = {};
  };

  const Simulation& simulation;
  const Scenario scenario;
  const PredictionLayout layout;
  std::vector<int> policies;
  std::vector<std::unique_ptr<Worker>> workers;
  ParticleBlocks blocks;

  Impl(const Simulation& s, const std::vector<std::string>& candidates, int threads)
      : simulation(s), scenario(without_records(s.scenario())), layout(prediction_layout(scenario)), blocks(s) {
    if (candidates.empty()) throw InputError("a prediction needs a candidate");
    for (const std::string& name : candidates) {
      const int policy = s.policy(name);
      if (std::count(policies.begin(), policies.end(), policy) > 0) {
        throw InputError(fmt::format("{}: is a candidate twice", name));
      }
      policies.push_back(policy);
    }
    const unsigned all = std::max(1u, std::thread::hardware_concurrency());
    for (unsigned i = 0; i < (threads > 0 ? static_cast<unsigned>(threads) : all); ++i) {
      workers.push_back(std::make_unique<Worker>(scenario));
      for (const int policy : policies) workers.back()->run.prepare(policy);
    }
  }

  /// Simulates one block under one candidate.
  PredictionTally simulate(Worker& worker, Call& call, std::uint64_t block, int policy) {
    const ParticleBlock& all = blocks.at(block, call.particles, worker.watch);
    WorkUnit unit;
    unit.policy = policy;
    unit.particles = all.particles;
    std::vector<Beginning> beginnings;
    for (const Particle& one : unit.particles) {
      beginnings.push_back({call.estimate.time, call.draws.draw(one), call.estimate.memory});
    }
    RunOptions options;
    options.beginnings = beginnings;
    options.end = call.end;
    if (!unit.particles.empty()) worker.run.run(unit, options);
    call.steps += unit.cost.steps;
    if (!unit.unfinished.empty()) throw MachineError("a prediction: " + unit.unfinished.front().reason);
    PredictionTally out(layout);
    for (const TraceRecord& trace : unit.records) out.add(layout, trace, call.estimate.time, call.end);
    out.add_unfabricated(all.failed, all.why);
    return out;
  }

  void work(Worker& worker, Call& call) {
    worker.watch.stop_at(call.stop);
    const std::uint64_t candidates = policies.size();
    try {
      while (!call.failed) {
        worker.watch.check();
        const std::uint64_t item = call.next++;
        if (item / candidates * kLanes >= call.particles) return;
        PredictionTally tally = simulate(worker, call, item / candidates, policies[item % candidates]);
        const std::lock_guard lock(call.mutex);
        call.done.emplace(item, std::move(tally));
      }
    } catch (const PastDeadline&) {
    } catch (...) {
      const std::lock_guard lock(call.mutex);
      call.error = std::current_exception();
      call.failed = true;
    }
  }

  void work_together(Call& call) {
    std::vector<std::thread> others;
    const std::uint64_t items = (call.particles + kLanes - 1) / kLanes * policies.size();
    const auto busy = static_cast<std::size_t>(std::min<std::uint64_t>(items, workers.size()));
    for (std::size_t i = 1; i < busy; ++i) {
      others.emplace_back([this, &call, i] {
        const SignalStack stack;
        work(*workers[i], call);
      });
    }
    work(*workers.front(), call);
    for (std::thread& one : others) one.join();
    if (call.error) std::rethrow_exception(call.error);
  }

  /// Sums up the blocks that count.
  Prediction sum_up(Call& call) const {
    const std::size_t candidates = policies.size();
    std::vector<PredictionTally> tallies(candidates, PredictionTally(layout));
    std::uint64_t blocks_done = 0;
    for (std::uint64_t item = 0; call.done.count(item) > 0; ++item) blocks_done = (item + 1) / candidates;
    for (std::uint64_t item = 0; item < blocks_done * candidates; ++item) {
      tallies[item % candidates].add(call.done.at(item));
    }
    Prediction out;
    out.particles = std::min(blocks_done * kLanes, call.particles);
    out.horizon = call.end - call.estimate.time;
    for (std::size_t i = 0; i < candidates; ++i) {
      out.candidates.push_back(tallies[i].told(layout, scenario.policies[static_cast<std::size_t>(policies[i])].name));
    }
    out.best = best_of(out.candidates);
    out.steps = call.steps;
    return out;
  }

  void check_estimate(const StateEstimate& estimate, double end) const {
    const Beginning one = {estimate.time, estimate.state, estimate.memory};
    RunOptions options;
    options.beginnings = {&one, 1};
    options.end = end;
    for (const int policy : policies) {
      check_beginnings(scenario, scenario.policies[static_cast<std::size_t>(policy)], 1, options);
    }
  }
};

Predictor::Predictor(const Simulation& simulation, const std::vector<std::string>& candidates, int threads)
    : impl_(std::make_unique<Impl>(simulation, candidates, threads)) {}
Predictor::~Predictor() = default;

void Predictor::prepare(std::uint64_t particles) {
  const std::uint64_t some = std::min(particles, kKeptParticles) / kLanes * kLanes;
  const TraceWatch unhurried;
  for (std::uint64_t block = 0; block * kLanes < some; ++block) impl_->blocks.at(block, some, unhurried);
}

Prediction Predictor::predict(const StateEstimate& estimate, const PredictionLimits& limits) {
  const Clock::time_point begin = Clock::now();
  const std::uint64_t particles = most_particles(impl_->simulation, limits);
  const double end = end_of_prediction(impl_->scenario, estimate, limits);
  impl_->check_estimate(estimate, end);
  auto stop = Clock::time_point::max();
  constexpr double kLongest = 1e6;  // s; later is never
  if (limits.deadline < kLongest) {
    const double some = limits.deadline - std::min(kReserve * limits.deadline, kMostReserve);
    stop = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(some));
  }
  Impl::Call call{.estimate = estimate,
                  .draws = EstimateDraws(impl_->scenario, estimate),
                  .end = end,
                  .particles = particles,
                  .stop = stop};
  impl_->work_together(call);
  impl_->blocks.trim(particles);
  Prediction out = impl_->sum_up(call);
  out.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  out.in_time = out.seconds <= limits.deadline;
  return out;
}

}  // namespace graze
