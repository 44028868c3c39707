#pragma once
// The jitter of the control lag.

#include <vector>

#include "engine/sensing/noise.h"
#include "sampling/stream.h"
#include "scenarios/scenario.h"

namespace graze {

/// The jitter of the control lag, drawn at each control step: row 0.
inline LaneNoise lag_noise(const Scenario& scenario, std::uint64_t seed) {
  std::vector<LaneNoise::Channel> channels;
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    if (parameter.name == "control.lag" && parameter.jitter) {
      channels.push_back({name_hash(parameter.name), 0, *parameter.jitter});
    }
  }
  return LaneNoise(seed, channels);
}

}  // namespace graze
