#pragma once
// Sensors for those who watch traces.

#include <optional>

#include "engine/model/world.h"
#include "engine/sensing/sensors.h"
#include "scenarios/scenario.h"

namespace graze {

/// What an observer sees of the sensors: all groups, as the controller has or would have them, and without errors.
/// Draws are keyed by channel, so that what the controller reads is here with the same bits. Nothing until begin().
class WatchedSensors {
 public:
  /// `on`: somebody looks at them from now on; else nothing is sensed. `s` outlives this.
  void begin(const Scenario& s, std::uint64_t seed, bool on) {
    on_ = on;
    sensed_ = truth_ = {};
    if (!on || sensors_) return;
    sensors_.emplace(s.model, channel_names(s.world->robot), sensor_noise(s, seed));
    exact_.emplace(s.model, channel_names(s.world->robot), SensorNoise{});
  }

  void start(int lane, const Particle& particle) {
    if (!on_) return;
    sensors_->start(lane, particle);
    Particle exact;
    exact.id = particle.id;
    exact_->start(lane, exact);
  }

  template <class... Arguments>
  void sense(const Arguments&... arguments) {
    if (!on_) return;
    sensors_->sense(arguments..., sensed_);
    exact_->sense(arguments..., truth_);
  }

  const Observation& sensed() const { return sensed_; }
  const Observation& truth() const { return truth_; }

 private:
  bool on_ = false;
  std::optional<Sensors> sensors_, exact_;
  Observation sensed_, truth_;
};

}  // namespace graze
