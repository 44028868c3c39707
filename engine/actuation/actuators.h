#pragma once
// Actuators: from what a tracker asks for to the torque that the joint gets. Servo PID on the encoder at every physics
// step, torque limit, and the linear torque-speed curve (§6.1.1).

#include <Eigen/Cholesky>
#include <array>
#include <memory>

#include "engine/block_physics.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/lanes/block.h"
#include "engine/lanes/isa.h"
#include "engine/lanes/lane_tape.h"
#include "engine/sensing/sensors.h"

namespace graze {

struct ActuatorRows;  // engine/lane_physics/kernel.h
struct LaneKernel;    // engine/lane_physics/kernel.h

/// Asked of the actuators until the next control step; na rows each. tau + kp (q - q_enc) + kd (v - v_enc) + ki *
/// integral.
struct ActuatorCommand {
  BlockArray tau, q, v, kp, kd, ki;
  // 1: the joint moves to q by the end of each physics step as far as its torque limits allow; 2: beyond them, too; 0:
  // not. Only back ends that solve drives know it.
  BlockArray prescribed;
  explicit ActuatorCommand(int na = 0) : tau(na), q(na), v(na), kp(na), kd(na), ki(na), prescribed(na) {}
};

class Actuators {
 public:
  /// `torque_speed`: the available torque falls linearly to 0 at the joint's no-load speed in the direction of motion.
  /// `drives_solved`: only for back ends that solve drives, so that apply() is never called and no trace pays for it.
  Actuators(const Model& nominal, bool torque_speed, bool drives_solved = false, Isa isa = chosen_isa());

  void start(int lane, const Particle& particle);
  /// Writes down, or reads back after start(), all that the lane's further way depends on.
  void carry(int lane, LaneTape& tape) { tape.carry(integral_, lane), tape.carry(headroom_, lane); }
  /// One physics step of h seconds under a command: the back end solves the servos with everything else if it can;
  /// otherwise they become torques first (apply). `tau` [na]: the torques of the step.
  void step(const ActuatorCommand& command, BlockPhysics& physics, const Sensors& sensors, double h, LaneMask active,
            BlockArray& tau);
  /// Torques [na] for one physics step of h seconds, limited. Also integrates the servos' error. The dampers kd act on
  /// the velocity that they lead to, v + h M^-1 tau_damper with the particle's own limb inertia M (base held still): a
  /// damper that is held constant over a step would otherwise overshoot standstill, and shake a light limb, as soon as
  /// kd h exceeds the inertia.
  void apply(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h, LaneMask active,
             BlockArray& tau);

  /// How far each torque stayed from its limit at the last step: limit - |demand|, negative when it was cut. na rows.
  const BlockArray& headroom() const { return headroom_; }

 private:
  /// What the kernels need to make a Drive of the command, and to follow its result.
  ActuatorRows rows_of_step(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h,
                            LaneMask active, BlockArray& tau);
  /// Poses and M of the lane's particle.
  void update_inertia(const BlockState& state, int lane);
  /// Adds the dampers' torques of a lane to demand_.
  void add_damping(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h, int lane);
  void apply_lane(const ActuatorCommand& command, const BlockState& state, const Sensors& sensors, double h, int lane,
                  BlockArray& tau);
  /// Largest torque in the direction of `sign` at joint speed v, N m.
  double available(int k, int lane, double sign, double v) const;

  const LaneKernel* kernel_;
  DynamicsModel nominal_;
  std::vector<int> v_index_, q_index_;
  bool torque_speed_, drives_solved_;
  BlockArray effort_, speed_, integral_, headroom_;  // na
  BlockArray q_error_;                               // na, of the encoder at the beginning of the step
  Drive drive_;
  DriveResult result_;
  std::vector<std::vector<int>> limbs_;  // actuators whose joints hang together without the base
  std::array<std::unique_ptr<DynamicsData<double>>, kLanes> dynamics_;  // of each lane's particle
  std::vector<double> demand_;                                          // na, scratch of one lane
  Eigen::MatrixXd M_;                                                   // scratch of one limb
  Eigen::VectorXd error_;                                               // scratch of one limb
  std::vector<double> q_;                                               // nq, scratch of one lane
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

}  // namespace graze
