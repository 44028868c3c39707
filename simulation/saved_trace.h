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

/// A trace at a control step, after all that the steps up to then have done. It never changes; any number of runs and
/// threads may go on from it.
struct SavedTrace {
  std::uint32_t particle;
  std::uint32_t step;                        // physics steps done since t = 0
  double time;                               // s
  std::shared_ptr<const SavedLane> physics;  // bodies, contacts, warm starts
  LaneTape::Content rest;                    // all else of a run's lane
  std::string policy_kind;                   // policy_kind() of its policy
  double period;                             // s, control step

  /// Memory that `rest` takes, bytes.
  std::size_t bytes() const { return rest.size(); }
};

/// Whose memory a policy's is: "gait, control operational_pd". Policies of one kind that differ in their numbers can go
/// on from each other's traces.
std::string policy_kind(const PolicySpec& policy);

/// Throws InputError unless a trace of `particle` under `policy` can go on from `saved`.
void check_saved(const Scenario& scenario, const PolicySpec& policy, std::uint32_t particle, const SavedTrace* saved);

}  // namespace graze
