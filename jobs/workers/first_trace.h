#pragma once
// One trace under each controller of the user's own, before anybody simulates thousands.

#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// What became of particle 0 under a policy.
struct FirstTrace {
  std::string policy;
  std::string invalid = {}, unfinished = {};  // why; both empty: it has an outcome
  std::string outcome = {};                   // of a valid trace: "success", "known failure (upright) at 0.31 s"
  bool told = false;                          // that was told with what the controller has printed
  bool limp = false;                          // all torques were 0 from beginning to end
  std::vector<std::string> at_limit = {};     // joints whose torque was at its limit nearly all the time
  bool flips = false;                         // of one of these from control step to control step
};

/// Simulates particle 0 under each policy that the user has brought, a network or, if these are `trusted`, code, where
/// and as a campaign does. Throws as try_controllers(), whose checks are to be made before.
std::vector<FirstTrace> first_traces(const Scenario& scenario, bool trusted);

/// "policy walk, particle 0: success"; empty: it has none.
std::string outcome_of(const FirstTrace& trace);

/// "policy walk, particle 0: …", with what may be done about it; empty: there is nothing to tell.
std::string problem_of(const FirstTrace& trace);

}  // namespace graze
