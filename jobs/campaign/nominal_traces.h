#pragma once
// The nominal robot in the nominal world, simulated: what a campaign's traces are compared with.

#include <string>
#include <vector>

#include "scenarios/scenario.h"
#include "simulation/trace.h"

namespace graze {

/// Whose streams a policy draws from that rolls dice itself: no particle of a campaign has this id.
inline constexpr std::uint32_t kNominalParticle = kParticleLimit;

/// A trace for each of the policies, with its contact phases: every parameter at its nominal value, no jitter of
/// sensors and control lag. A function of the scenario and its seed (which matters to a policy's own draws alone).
/// Throws InputError: no such policy.
std::vector<TraceRecord> nominal_traces(const Scenario& scenario, const std::vector<std::string>& policies);

}  // namespace graze
