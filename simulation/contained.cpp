#include "simulation/contained.h"

#include <iterator>
#include <limits>
#include <new>
#include <optional>

#include "engine/library/library_use.h"
#include "simulation/particles.h"

namespace graze {
namespace {

/// What went wrong, and whose matter it is.
struct Fault {
  enum class Of { robot, machine, controller } of;
  std::string reason;
};

/// Rethrows what no particle can be blamed for.
Fault fault_of(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const MachineError&) {
    throw;
  } catch (const SavedTraceError&) {
    throw;
  } catch (const Overtime&) {
    return {Fault::Of::machine, "took longer than the watchdog allows"};
  } catch (const CallLost& lost) {
    return {Fault::Of::controller, lost.what()};
  } catch (const LeftUnfinished& left) {
    return {Fault::Of::controller, left.what()};
  } catch (const std::bad_alloc&) {
    return {Fault::Of::machine, "out of memory"};
  } catch (const std::exception& error) {
    return {Fault::Of::robot, error.what()};
  } catch (...) {
    return {Fault::Of::robot, "an exception of unknown type"};
  }
}

/// Appends the values of the particle that stands at `index`.
void keep_values(WorkUnit& unit, std::size_t index) {
  const std::size_t width = unit.values.size() / unit.particles.size();
  const auto first = unit.values.begin() + static_cast<std::ptrdiff_t>(index * width);
  std::copy_n(first, width, std::back_inserter(unit.record_values));
}

}  // namespace

void take_over(WorkUnit& unit) {
  if (!unit.alone && unit.particles.size() > 1) {
    unit.alone = true;
    return;
  }
  unit.unfinished.push_back({unit.particles[unit.next].id, "did not come back from a step; its thread was given up"});
  ++unit.next;
}

struct ContainedRun::Attempt {
  std::vector<TraceRecord> records;
  std::optional<Fault> fault;
};

ContainedRun::ContainedRun(const Scenario& scenario, std::uint64_t seed, TraceWatch& watch, RunElsewhere elsewhere)
    : scenario_(scenario), seed_(seed), watch_(watch), elsewhere_(std::move(elsewhere)) {}

void ContainedRun::run(WorkUnit& unit, const RunOptions& options) {
  if (unit.particles.size() > 1 && !unit.alone) {
    Attempt together = attempt(unit, 0, unit.particles.size(), options);
    if (!together.fault) {
      std::move(together.records.begin(), together.records.end(), std::back_inserter(unit.records));
      for (; !unit.done(); ++unit.next) keep_values(unit, unit.next);
      return;
    }
    unit.alone = true;
    // A controller's process that somebody has killed says nothing of the controller.
    unit.came_late =
        together.fault->of == Fault::Of::controller && together.fault->reason.find(kKilled) == std::string::npos;
    if (unit.came_late || together.fault->of == Fault::Of::robot) unit.failed_together = together.fault->reason;
  }
  for (; !unit.done(); ++unit.next) {
    close(unit, attempt(unit, unit.next, 1, options));
  }
}

BlockRun& ContainedRun::run_here(int policy) {
  auto run = runs_.find(policy);
  if (run == runs_.end()) {
    run = runs_.emplace(policy, BlockRun(scenario_, scenario_.policies[policy], seed_)).first;
    run->second.watch(&watch_);
  }
  return run->second;
}

/// Null if the unit is simulated here. Particles that are alone, since one of them is suspect, begin afresh each: what
/// one has spoilt shall not be laid at the next one's door.
RemoteRun* ContainedRun::run_elsewhere(const WorkUnit& unit, const RunOptions& options) {
  if (!elsewhere_ || options.observer || !options.beginnings.empty() || !options.saved.empty()) return nullptr;
  auto run = remotes_.find(unit.policy);
  if (unit.alone && run != remotes_.end() && run->second) {
    remotes_.erase(run);
    run = remotes_.end();
  }
  if (run == remotes_.end()) run = remotes_.emplace(unit.policy, elsewhere_(unit.policy)).first;
  return run->second.get();
}

/// Simulates `count` particles of a unit from `begin` on.
ContainedRun::Attempt ContainedRun::attempt(WorkUnit& unit, std::size_t begin, std::size_t count, RunOptions options) {
  BlockRun* const here = run_elsewhere(unit, options) ? nullptr : &run_here(unit.policy);
  const auto particles = std::span(unit.particles).subspan(begin, count);
  if (!options.beginnings.empty()) options.beginnings = options.beginnings.subspan(begin, count);
  if (!options.saved.empty()) options.saved = options.saved.subspan(begin, count);
  Attempt out;
  RunCost mine;
  std::exception_ptr thrown;
  watch_.enter();
  try {
    out.records = here ? here->run(particles, &mine, options) : remotes_.at(unit.policy)->run(particles, mine);
  } catch (const PastDeadline&) {  // between two steps, from where the next block begins afresh
    watch_.leave();
    throw;
  } catch (...) {
    thrown = std::current_exception();
  }
  watch_.leave();
  unit.cost.steps += mine.steps;
  if (!thrown) return out;
  runs_.erase(unit.policy);
  remotes_.erase(unit.policy);
  out.fault = fault_of(thrown);
  return out;
}

void ContainedRun::close(WorkUnit& unit, Attempt attempt) {
  const std::uint32_t particle = unit.particles[unit.next].id;
  unit.failed_alone += attempt.fault.has_value();
  if (attempt.fault && attempt.fault->of != Fault::Of::robot) {
    unit.unfinished.push_back({particle, attempt.fault->reason, attempt.fault->of == Fault::Of::controller});
    return;
  }
  if (attempt.fault) {
    TraceRecord& record = unit.records.emplace_back(unfabricated(particle, scenario_, attempt.fault->reason));
    record.end_time = std::numeric_limits<double>::quiet_NaN();  // some time after the start
  } else {
    unit.records.push_back(std::move(attempt.records.front()));
  }
  keep_values(unit, unit.next);
}

}  // namespace graze
