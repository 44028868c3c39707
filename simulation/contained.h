#pragma once
// Faults stay where they arise: a particle that throws becomes an `invalid` trace, one that takes too long is left
// unfinished, and the traces of its neighbours have the bits that they have without it. In: a unit of work. Out: its
// traces, and the particles that have none.

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simulation/block_run.h"
#include "simulation/watchdog.h"

namespace graze {

/// A particle without a trace, by the fault of the machine, or of a controller that did not come back, and not of the
/// robot.
struct UnfinishedParticle {
  std::uint32_t particle;
  std::string reason;
  bool by_controller = false;
};

/// Some particles under one policy, and how far they are. It outlives a thread that hangs in it: another goes on.
struct WorkUnit {
  int policy = 0;
  std::vector<Particle> particles;
  std::vector<double> values;  // of `particles`, [particle][parameter]
  bool alone = false;          // one particle at a time, because something is wrong with one of them
  std::size_t next = 0;        // particles before it are done

  std::vector<TraceRecord> records;   // finished
  std::vector<double> record_values;  // of `records`, [record][parameter]
  std::vector<UnfinishedParticle> unfinished;
  RunCost cost;
  std::string failed_together;   // what the robots' controller or physics threw beside each other; empty: nothing
  bool came_late = false;        // that was a controller that did not come back, as the clock has decided
  std::size_t failed_alone = 0;  // particles that failed when they were alone afterwards

  bool done() const { return next == particles.size(); }
  /// Whether something failed in a block and nothing when each of its particles was alone: traces then depend on lanes
  /// or neighbours, as those of a controller that mixes up robots.
  bool mixes_up() const { return done() && !failed_together.empty() && failed_alone == 0; }
};

/// When a unit is taken over from a thread that hangs: a particle that was alone is left unfinished; of several each is
/// tried alone.
void take_over(WorkUnit& unit);

/// Particles that are simulated elsewhere have no trace, and are not to blame: their controller did not come back, as
/// the clock has decided, or its process did not get as far as them. what(): the reason.
class LeftUnfinished : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Simulates blocks of one policy somewhere else: what happens there does not happen to this process.
class RemoteRun {
 public:
  virtual ~RemoteRun() = default;
  /// As BlockRun::run, for particles of the campaign, which are known by their ids alone; one that cannot be fabricated
  /// is `invalid`. Returns one record for each, in their order. Adds the steps to `cost`. Throws Overtime for a trace
  /// that takes too long, LeftUnfinished, MachineError, and std::runtime_error for what else has gone wrong there,
  /// after which the object is of no more use.
  virtual std::vector<TraceRecord> run(std::span<const Particle> particles, RunCost& cost) = 0;
};
/// Begins one for a policy (its index) whose blocks run elsewhere; null for others. Called from any thread.
using RunElsewhere = std::function<std::unique_ptr<RemoteRun>(int policy)>;

/// Simulates units of one scenario. Owned by one thread.
class ContainedRun {
 public:
  /// `scenario` and `watch` outlive this. `elsewhere`: for blocks that nobody observes and that begin as the scenario
  /// says; empty: all run here.
  ContainedRun(const Scenario& scenario, std::uint64_t seed, TraceWatch& watch, RunElsewhere elsewhere = {});

  /// Goes on with a unit until it is done. If the block throws or takes too long its state is suspect: it is made anew
  /// and the particles are simulated one at a time (alone in a lane a trace has the same bits), so that only the guilty
  /// one is `invalid` or unfinished. Throws InputError if the policy's settings are wrong, SavedTraceError,
  /// MachineError, and GivenUp. An observer sees every step, again if particles are simulated again;
  /// `options.beginnings` as the unit's particles.
  /// PastDeadline leaves it, too: the unit is then as far as it was, and the next one may be run.
  void run(WorkUnit& unit, const RunOptions& options = {});
  /// Makes what simulates a policy now, not when it is first needed. Throws InputError.
  void prepare(int policy) { run_here(policy); }
  /// Ends what simulates elsewhere now, not with this.
  void end_elsewhere() { remotes_.clear(); }

 private:
  struct Attempt;
  Attempt attempt(WorkUnit& unit, std::size_t begin, std::size_t count, RunOptions options);
  void close(WorkUnit& unit, Attempt attempt);
  BlockRun& run_here(int policy);
  RemoteRun* run_elsewhere(const WorkUnit& unit, const RunOptions& options);

  const Scenario& scenario_;
  const std::uint64_t seed_;
  TraceWatch& watch_;
  const RunElsewhere elsewhere_;
  std::map<int, BlockRun> runs_;                       // by policy, made when first needed
  std::map<int, std::unique_ptr<RemoteRun>> remotes_;  // the same; null: the policy runs here
};

}  // namespace graze
