#pragma once
// Where the base shall go (§9.4): a constant velocity, or steering toward waypoints, holonomic or like a car.

#include <array>
#include <memory>

#include "engine/sensing/sensors.h"
#include "engine/settings/settings.h"

namespace graze {

/// Velocity of the base in its own level frame: linear (m/s) and angular (rad/s).
struct BaseCommand {
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
  bool operator==(const BaseCommand& other) const { return v == other.v && w == other.w; }
};

/// Planar pose of a frame that moves with a constant command for `duration` s from the origin: an exact arc.
struct PlanarPose {
  double x = 0, y = 0, yaw = 0;
  Vec3 transform(const Vec3& p) const;
};
PlanarPose predict(const BaseCommand& command, double duration);

class Steering {
 public:
  virtual ~Steering() = default;
  virtual void start(int lane) = 0;
  virtual unsigned reads() const = 0;  // as Policy::reads
  virtual BaseCommand command(const Observation& observation, int lane) = 0;
};

/// Reads `velocity: [forward, strafe, turn]` or `[vx, vy, vz, wx, wy, wz]`, or `waypoints: {points, tolerance, speed:
/// {forward, strafe, turn}, steering: driving | holonomic, loop}` of a gait. Throws InputError.
std::unique_ptr<Steering> read_steering(const Settings& gait, bool floating_base);

}  // namespace graze
