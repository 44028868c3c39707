#pragma once
// A trace in its middle, from which others go on: the whole lane of a run, physics, controller, actuators and
// judgement.

#include <cstdint>
#include <memory>
#include <string>

#include "engine/block_physics.h"
#include "engine/lanes/lane_tape.h"
#include "scenarios/scenario.h"

namespace graze {

/// What a saved trace and the run that goes on from it must have in common, beside the particle.
struct TraceKind {
  std::uint64_t numbering;  // numbering_of() the scenario's model
  std::string policy;       // policy_kind()
  std::uint64_t task;       // a digest of what is judged, and of how witnesses tell their bounds (six digits)
  Recording recording;
  double step, control;  // s
};

TraceKind trace_kind(const Scenario& scenario, const PolicySpec& policy);

/// A trace at a control step, after all that the steps up to then have done. It never changes; any number of runs and
/// threads may go on from it.
struct SavedTrace {
  std::uint32_t particle;
  std::uint64_t own;                         // own_numbers_of() the particle
  std::uint32_t step;                        // physics steps done since t = 0
  double time;                               // s
  std::shared_ptr<const SavedLane> physics;  // bodies, contacts, warm starts
  LaneTape::Content rest;                    // all else of a run's lane
  std::shared_ptr<const TraceKind> kind;     // of the run that saved it
};

/// What the controller of a robot knows at a control step, before it acts: what its policy and tracker remember, its
/// last targets and those that the lag still holds back, and the integrals of its servos. Of the world it knows nothing
/// but what it has sensed, so that other particles can go on with it, which have lags of their own.
struct ControllerMemory {
  std::uint64_t numbering;  // numbering_of() the nominal model
  std::string policy;       // policy_kind()
  double time;              // s
  LaneTape::Content content;
};

/// A trace cannot be saved as it was asked for, or does not fit where it should go on. Whoever asked is to blame and no
/// particle: it leaves Simulator::run.
class SavedTraceError : public InputError {
 public:
  using InputError::InputError;
};

/// Whose memory a policy's is: "gait by waypoints, control inverse_dynamics, delay 1 ms". Policies of one kind that
/// differ in their other numbers can go on from each other's traces.
std::string policy_kind(const PolicySpec& policy);

/// A digest of all numbers by which particles differ, but for the initial state, which is past in a saved trace.
std::uint64_t own_numbers_of(const Particle& particle);

/// Throws SavedTraceError unless a trace of `particle` in a run of the kind `here` under `policy` can go on from
/// `saved`.
void check_saved(const Scenario& scenario, const PolicySpec& policy, const TraceKind& here, const Particle& particle,
                 const SavedTrace* saved);

}  // namespace graze
