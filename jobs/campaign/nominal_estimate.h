#pragma once
// The nominal robot on its way: what its sensors tell of it at a moment, for predictions from there on.

#include <string>

#include "simulation/estimate.h"
#include "simulation/simulation.h"

namespace graze {

/// Simulates the nominal robot under a policy until `time` (s, rounded to a control step) with the jitter of its
/// sensors and control lag, and takes what they read there, with what the controller remembers. `remembers`: false: its
/// policy cannot tell what it remembers; candidates then start afresh. Throws InputError if the trace ends before, and
/// says how.
struct NominalEstimate {
  StateEstimate estimate;
  bool remembers = true;
};
NominalEstimate nominal_estimate(const Simulation& simulation, const std::string& policy, double time);

}  // namespace graze
