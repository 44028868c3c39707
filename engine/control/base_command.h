#pragma once
// Where the base shall go (§9.4): a constant velocity, recorded commands, or steering toward waypoints, holonomic or
// like a car.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/lane_tape.h"
#include "engine/sensing/sensors.h"
#include "engine/settings/description.h"

namespace graze {

/// Rows of a command: velocity of the base in its own level frame, linear (m/s) and angular (rad/s).
inline constexpr int kCommandRows = 6;

class Steering {
 public:
  virtual ~Steering() = default;
  virtual void start(int lane) = 0;
  virtual void carry(int lane, LaneTape& tape) = 0;  // as Policy::carry
  virtual unsigned reads() const = 0;                // as Policy::reads
  /// Writes the active lanes of `command` (kCommandRows rows).
  virtual void steer(const Observation& observation, LaneMask active, BlockArray& command) = 0;
};

/// The keys of a gait of which one says where its base goes.
Key velocity_key();
Key waypoints_key();
Key commands_key();
/// Their names: "velocity", "waypoints", "commands".
const std::vector<std::string>& steering_keys();

/// The value of a gait's `velocity`: vx, vy, vz, wx, wy, wz in the base's level frame, m/s and rad/s; each item may
/// have its unit. Throws InputError.
std::array<double, kCommandRows> read_velocity(const Settings& settings);

/// Reads the one of these keys that a gait has. Throws InputError.
std::unique_ptr<Steering> read_steering(const Settings& gait, bool floating_base);

}  // namespace graze
