#pragma once
// Sensors for those who watch traces.

#include "engine/model/world.h"
#include "engine/sensing/sensors.h"
#include "scenarios/scenario.h"

namespace graze {

/// What an observer sees of the sensors: all groups, as the controller has or would have them, and without errors.
/// Draws are keyed by channel, so that what the controller reads is here with the same bits.
class WatchedSensors {
 public:
  WatchedSensors(const Scenario& s, std::uint64_t seed)
      : sensors_(s.model, channel_names(s.world->robot), sensor_noise(s, seed)),
        exact_(s.model, channel_names(s.world->robot), SensorNoise{}) {}

  void start(int lane, const Particle& particle) {
    sensors_.start(lane, particle);
    Particle exact;
    exact.id = particle.id;
    exact_.start(lane, exact);
  }

  template <class... Arguments>
  void sense(const Arguments&... arguments) {
    sensors_.sense(arguments..., sensed_);
    exact_.sense(arguments..., truth_);
  }

  const Observation& sensed() const { return sensed_; }
  const Observation& truth() const { return truth_; }

 private:
  Sensors sensors_, exact_;
  Observation sensed_, truth_;
};

}  // namespace graze
