#pragma once
// Traces that begin elsewhere than the scenario says, and what of RunOptions is refused.

#include <cstdint>
#include <span>
#include <vector>

#include "simulation/block_run.h"

namespace graze {

/// The step at which a trace begins.
std::uint32_t first_step(const Timing& timing, const Beginning& beginning);
/// The particles in the states of their beginnings, one for each.
std::vector<Particle> begun_elsewhere(std::span<const Particle> particles, std::span<const Beginning> beginnings);

}  // namespace graze
