#pragma once
// When a particle's disturbances act on the lane that it is in.

#include <cstdint>

#include "engine/block_physics.h"

namespace graze {

/// Where a trace is before a step.
struct StepPlace {
  std::uint32_t done = 0;   // steps since t = 0
  std::uint32_t first = 0;  // at which the trace began
  double step = 0;          // s, of the physics
};

/// Pushes and loads a lane as is due in the step that follows. A push over a duration gives each step its share of the
/// impulse, so that the sum is exact; one without falls into the step that holds its time. A payload comes with the
/// first step that begins no earlier than its time.
void disturb(int lane, const Particle& particle, const StepPlace& place, BlockPhysics& physics);

/// The share of a push that falls into the step from `from` to `from + step` (s), 0 to 1.
double push_share(const BodyDisturbance& push, double from, double step);

}  // namespace graze
