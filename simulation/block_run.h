#pragma once
// Traces (Algorithm 1, inner loop): simulates particles of one policy, W at a time, and says how each trace ended. A
// lane whose trace has ended takes the next particle at once. In: a scenario, a policy, particles. Out: one TraceRecord
// per particle.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/control/policy.h"
#include "engine/sensing/sensors.h"
#include "scenarios/scenario.h"
#include "simulation/phases.h"
#include "simulation/saved_trace.h"
#include "simulation/trace.h"

namespace graze {

/// What some traces cost, for rates. Costs of several runs add up.
struct RunCost {
  std::uint64_t steps = 0;  // physics steps, of one particle each
  bool timed = false;       // ask for `seconds`
  PhaseSeconds seconds{};   // by phase
};

/// Who saves the traces of a block, and what its controllers know.
class TraceSaver {
 public:
  virtual ~TraceSaver() = default;
  virtual std::shared_ptr<const SavedTrace> save(int lane) = 0;
  virtual std::shared_ptr<const ControllerMemory> remember(int lane) = 0;
};

/// One trace after a physics step, or at its start. Arrays are [quantity][lane] and valid during the call.
struct StepView {
  int lane;
  std::uint32_t particle;
  std::size_t index;               // of the particle, among those of the run
  std::uint32_t step;              // physics steps done since t = 0
  std::uint32_t first;             // at which the trace began: 0, unless it was given another Beginning
  double time;                     // s
  const BlockPhysics& physics;     // state and contacts
  const BlockArray& tau;           // [na], of the step; 0 at the start
  const BlockArray& headroom;      // [na], of the step: the limit less the torque that was asked for; < 0: it was cut
  const ActuatorCommand& command;  // that the step ran under; means nothing at the start
  const BlockArray& requirements;  // [requirement], witness values
  const BlockArray& objective;     // [leaf of the objective], witness values
  const Model& model;              // the particle's own
  const Controller& controller;    // targets and lag of the last control step
  // At the last control step, all groups, whatever the policy reads; not before the first, nor if the observer does not
  // look at them (TraceObserver::senses).
  const Observation& sensed;
  const Observation& truth;  // the same without any error
  bool ends;                 // the trace ends with this step, whatever is seen
  TraceSaver& saver;

  /// The trace as it is now, from which others can go on (RunOptions::saved); none if it ends here. Throws
  /// SavedTraceError between two control steps, and if its policy or back end cannot be saved.
  std::shared_ptr<const SavedTrace> save() const { return saver.save(lane); }
  /// What the controller knows now, with which others can begin (Beginning::memory). Throws as save().
  std::shared_ptr<const ControllerMemory> remember() const { return saver.remember(lane); }
};

/// Watches traces, step by step, without touching them.
class TraceObserver {
 public:
  virtual ~TraceObserver() = default;
  /// At the start of a trace and after each of its steps. False: it has seen enough, and the trace ends here.
  virtual bool see(const StepView& step) = 0;
  /// Whether it looks at StepView::sensed or truth; what nobody looks at is not computed.
  virtual bool senses() const { return true; }
};

/// Where a trace begins, other than at the scenario's initial state and t = 0. What happened before is forgotten: no
/// contact is under way, solvers start afresh, and requirements are judged from here on.
struct Beginning {
  double time = 0;  // s, a whole number of control periods and before the traces' end
  State state;      // q [nq], v [nv], see Model
  std::shared_ptr<const ControllerMemory> memory = {};  // of this moment; null: the controller starts afresh
};

/// How some particles are simulated.
struct RunOptions {
  TraceObserver* observer = nullptr;           // sees every step of every trace; without one nothing is gathered for it
  std::span<const Beginning> beginnings = {};  // one per particle; none: all begin as the scenario says
  // One per particle: it goes on from there, to the bits that it would have come to. The observer sees it from the next
  // step on. None: all begin anew.
  std::span<const std::shared_ptr<const SavedTrace>> saved = {};
  double end =
      0;  // s, when traces end: a whole number of physics steps, no later than the scenario's; 0: the scenario's
  // The controller knows each particle in place of the nominal robot: designs that plan with their own numbers. They
  // have the parts of the scenario's robot, and their models outlive the run.
  bool informed = false;
};

/// Throws InputError unless each of so many particles has a beginning that a trace under this policy can have, or none
/// is given, and traces can end when they shall.
void check_beginnings(const Scenario& scenario, const PolicySpec& policy, std::size_t particles,
                      const RunOptions& options);

/// Throws SavedTraceError unless each of the particles has a saved trace that it can go on from, or none is given.
void check_saved(const Scenario& scenario, const PolicySpec& policy, std::span<const Particle> particles,
                 const RunOptions& options);

class TraceWatch;

/// Simulates blocks of one scenario under one policy. Owned by one thread; reused for many blocks. What a trace comes
/// out as depends on (scenario, policy, seed, particle) alone.
class BlockRun {
 public:
  /// `scenario` outlives this. Throws InputError if the policy's settings are wrong.
  BlockRun(const Scenario& scenario, const PolicySpec& policy, std::uint64_t seed);
  ~BlockRun();
  BlockRun(BlockRun&&) noexcept;

  /// From now on traces are shown to `watch` (which outlives this), and run() throws Overtime if it says so.
  void watch(TraceWatch* watch);
  /// One record per particle, in the same order. Throws InputError if a beginning is none that a trace can have. What
  /// the observer throws leaves the object unusable.
  std::vector<TraceRecord> run(std::span<const Particle> particles, RunCost* cost = nullptr,
                               const RunOptions& options = {});

  /// run() in parts, for who looks at the traces between two steps: begin(), then step() until it returns false. The
  /// traces have the bits that run() gives. `particles` and what `options` refer to outlive them. Throws as run().
  void begin(std::span<const Particle> particles, const RunOptions& options = {});
  /// One physics step of all lanes. False: every trace has ended.
  bool step();
  /// Ends the traces of some lanes where they are, as an observer's false does.
  void stop(LaneMask lanes);
  /// One per particle; whole where its trace has ended.
  const std::vector<TraceRecord>& records() const;
  /// Of the trace that goes on in a lane; none unless the scenario records events.
  const std::vector<Event>& events(int lane) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace graze
