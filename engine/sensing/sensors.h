#pragma once
// Sensors: what the controller is allowed to know. Truth plus a persistent bias (Eq. 13) plus a jitter drawn afresh at
// each control step (Eq. 14), per channel of Figure 15.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/block_physics.h"
#include "engine/sensing/noise.h"
#include "sampling/distribution.h"

namespace graze {

/// The groups of an Observation, as bit flags: which of them somebody reads.
enum SensedGroup : unsigned {
  kJointPosition = 1u << 0,
  kJointVelocity = 1u << 1,
  kJointAcceleration = 1u << 2,
  kJointTorque = 1u << 3,
  kBasePlace = 1u << 4,  // x and y of base_position
  kBaseTilt = 1u << 5,   // roll and pitch of base_rpy
  kBaseVelocity = 1u << 6,
  kBaseRate = 1u << 7,
  kImuLinear = 1u << 8,
  kImuAngular = 1u << 9,
  kLinkForce = 1u << 10,
  // Not of the observation: encoders that the actuators' own servos look at, at every physics step.
  kServoPosition = 1u << 11,
  kServoVelocity = 1u << 12,
  kBaseHeight = 1u << 13,  // z of base_position
  kBaseYaw = 1u << 14,     // yaw of base_rpy
  kBasePosition = kBasePlace | kBaseHeight,
  kBaseRpy = kBaseTilt | kBaseYaw,
  kLinkPush = 1u << 15,  // contact forces on links as vectors
  kObjectState = 1u << 16,
  kAllGroups = (1u << 17) - 1u
};

/// What is sensed at a control step, all lanes. Rows in the order of Model::actuated (na), SI units, world axes. What
/// nobody reads is NaN throughout. A base that is fixed to the world is where the nominal model has it, at
/// rest.
struct Observation {
  std::array<double, kLanes> time{};                              // s since the start of the trace
  BlockArray joint_position, joint_velocity, joint_acceleration;  // na rows, encoder
  BlockArray joint_torque;                                        // na rows, force sensor: torque that was applied
  BlockArray base_position;                                       // 3: x, y (GPS), z (state estimate)
  BlockArray base_rpy;                                            // 3: magnetometer
  BlockArray base_velocity;                                       // 3: state estimate, of the base origin
  BlockArray base_rate;                                           // 3: state estimate, angular velocity
  BlockArray imu_linear, imu_angular;  // 3 each: acceleration of the base origin, angular acceleration
  // One row per Model::frames: sum of normal contact forces on the link, N. Exact, but that a touch may be missed (0)
  // or be seen where there is none (the robot's weight): channels sensor.contact.LINK.{missed,false}.
  BlockArray link_force;
  // Six rows per frame: contact force on the link, N, and the point that it acts at, m, which is the mean of its
  // contact points by normal force; both in the world, exact. Zero where nothing presses.
  BlockArray link_push;
  // kObjectRows rows per movable object, in the order of Model::bodies: attitude (quaternion w x y z), position of its
  // frame (m), angular velocity (rad/s) and velocity (m/s), world, exact: what a camera that sees all would tell.
  BlockArray object_state;
};

/// Rows of an object in Observation::object_state.
inline constexpr int kObjectRows = 13;

/// The jitter of each channel, in the order of channel_names(), and where its draws come from.
struct SensorNoise {
  std::vector<std::optional<Distribution>> jitter;
  std::uint64_t seed = 0;
};

class Sensors {
 public:
  /// `names`: channel_names() of the robot. `reads`: the groups of Observation that will be read (SensedGroup); the
  /// others are neither drawn nor computed, which changes no value of those that are. `isa`: whose kernels are used;
  /// all give the same bits.
  Sensors(const Model& nominal, const std::vector<std::string>& names, SensorNoise noise, unsigned reads = kAllGroups,
          Isa isa = chosen_isa());

  void start(int lane, const Particle& particle);
  /// The channels that have an effect: what is read, and what the actuators use. Ascending.
  std::vector<int> needed_channels() const;
  /// Reads the active lanes. `step`: number of the control step per lane (keys the noise); `tau`: torques that were
  /// applied over the last physics step [na]; `h`: its length (contact impulse to force).
  void sense(const BlockPhysics& physics, const BlockArray& tau, double h,
             const std::array<std::uint32_t, kLanes>& step, const std::array<double, kLanes>& time, LaneMask active,
             Observation& out);

  /// Error of the encoders at the last control step, sensed minus true: what a servo's own loop sees between control
  /// steps. na rows.
  const BlockArray& encoder_error() const { return encoder_error_; }
  const BlockArray& encoder_velocity_error() const { return encoder_velocity_error_; }
  /// Error of the actuators' torque at the last control step ("sensed actuator torque noise", Figure 15). na rows.
  const BlockArray& torque_error() const { return torque_error_; }

 private:
  bool reads(unsigned group) const { return (reads_ & group) != 0; }
  void resize(Observation& out) const;
  void copy_errors();
  void list_readings();
  void list_forces(const BlockPhysics& physics);
  void see_objects(const BlockState& state, LaneMask active, BlockArray& out) const;
  void sum_pushes(const BlockPhysics& physics, double h, LaneMask active, BlockArray& push) const;
  void add_flag_noise(int lane);
  void mistake_contacts(const std::array<std::uint32_t, kLanes>& step, LaneMask active, BlockArray& force);

  /// Channels of a link's contact flag.
  struct Flag {
    int frame, missed, invented;
  };

  /// First channel of each group of three (or two, gps) that belong together.
  struct Layout {
    std::vector<int> position, velocity, acceleration, torque, actuator;  // per actuator
    std::vector<Flag> flags;                                              // links that can touch
    int imu_linear = 0, imu_angular = 0, gps = 0, magnetometer = 0, z = 0, estimate_velocity = 0, estimate_rate = 0;
  };
  Layout layout_;
  Model nominal_;
  std::vector<int> objects_;            // bodies that are movable objects
  std::vector<int> frame_of_collider_;  // Model::frames index of the link that a collider belongs to, -1: not a robot's
  unsigned reads_;
  const SensingKernel* kernel_;
  std::uint64_t seed_;
  Isa isa_;
  std::vector<std::uint64_t> hash_;                // of each channel's name
  double weight_ = 0;                              // N, what a contact that is not there reads
  LaneNoise flag_noise_;                           // uniforms of the flags' channels that may err in some lane
  std::vector<LaneNoise::Channel> flag_channels_;  // of flag_noise_
  BlockArray flag_uniform_, zero_;                 // channels
  LaneNoise noise_;                                // of the channels that are needed at each control step
  BlockArray bias_;                                // channels; of encoder positions less the joint's zero
  BlockArray error_;                               // channels: bias + jitter of this step
  std::vector<Reading> readings_;                  // sum of a row of state or torque and a row of error_
  std::vector<LinkForce> forces_;                  // of this step
  BlockArray encoder_error_, encoder_velocity_error_, torque_error_;
  std::array<std::uint32_t, kLanes> particle_{};
};

}  // namespace graze
