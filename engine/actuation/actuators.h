#pragma once
// Actuators: from what a tracker asks for to the torque that the joint gets. Servo PID on the encoder at every physics
// step, torque limit, and the linear torque-speed curve (§6.1.1).

#include "engine/lanes/block.h"
#include "engine/physics.h"
#include "engine/sensing/sensors.h"

namespace graze {

/// Asked of the actuators until the next control step; na rows each. tau + kp (q - q_enc) + kd (v - v_enc) + ki *
/// integral.
struct ActuatorCommand {
  BlockArray tau, q, v, kp, kd, ki;
  explicit ActuatorCommand(int na = 0) : tau(na), q(na), v(na), kp(na), kd(na), ki(na) {}
};

class Actuators {
 public:
  /// `torque_speed`: the available torque falls linearly to 0 at the joint's no-load speed in the direction of motion.
  Actuators(const Model& nominal, bool torque_speed);

  void start(int lane, const Particle& particle);
  /// Torques [na] for one physics step of h seconds, limited. Also integrates the servos' error.
  void apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h, LaneMask active,
             BlockArray& tau);

  /// How far each torque stayed from its limit at the last apply: limit - |asked|, negative when it was cut. na rows.
  const BlockArray& headroom() const { return headroom_; }

 private:
  /// Largest torque in the direction of `sign` at joint speed v, N m.
  double available(int k, int lane, double sign, double v) const;

  std::vector<int> v_index_, q_index_;
  bool torque_speed_;
  BlockArray effort_, speed_, integral_, headroom_;  // na
};

}  // namespace graze
