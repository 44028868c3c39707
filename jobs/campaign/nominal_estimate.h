#pragma once
// The nominal robot on its way: what its sensors tell of it at a moment, for predictions from there on.

#include <string>

#include "simulation/estimate.h"
#include "simulation/simulation.h"

namespace graze {

struct NominalEstimate {
  StateEstimate estimate;
  bool remembers = true;  // false: its policy cannot tell what it remembers; candidates start afresh
  std::shared_ptr<const SavedTrace>
      saved;  // when the verdict is there; null: it was not asked for, or the trace ends before
};

/// When, s, rounded to control steps.
struct NominalTimes {
  double at = 0;        // the estimate is taken
  double verdict = -1;  // the trace is saved, not before `at`; negative: it is not
};

/// Simulates the nominal robot under a policy with the jitter of its sensors and control lag, and takes what they read,
/// with what the controller remembers. Throws InputError if the trace ends before, and says how; SavedTraceError if its
/// policy cannot be saved.
NominalEstimate nominal_estimate(const Simulation& simulation, const std::string& policy, const NominalTimes& times);

/// How the nominal robot's trace ends if it goes on under another policy from where it was saved. Throws
/// SavedTraceError if that is of another kind.
TraceRecord gone_on(const Simulation& simulation, const std::string& policy, std::shared_ptr<const SavedTrace> saved);

/// "success", "known failure of 'upright'", "invalid: …".
std::string how_it_ends(const Scenario& scenario, const TraceRecord& trace);

}  // namespace graze
