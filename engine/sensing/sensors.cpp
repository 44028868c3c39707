#include "engine/sensing/sensors.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "engine/model/kinematics.h"
#include "sampling/stream.h"

namespace graze {

namespace {

/// Channel numbers by name; a name that channel_names() does not have throws.
class ChannelIndex {
 public:
  explicit ChannelIndex(const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < names.size(); ++i) index_[names[i]] = static_cast<int>(i);
  }
  int operator()(const std::string& name) const { return index_.at(name); }

 private:
  std::map<std::string, int> index_;
};

/// Sizes a group; one that nobody reads is filled with NaN, so that a forgotten declaration cannot pass for a reading.
void resize_group(BlockArray& group, int rows, bool read) {
  if (group.rows() == rows) return;
  group = BlockArray(rows);
  if (read) return;
  for (int i = 0; i < rows; ++i) std::fill_n(group.row(i), kLanes, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

Sensors::Sensors(const Model& nominal, const std::vector<std::string>& names, SensorNoise noise, unsigned reads)
    : nominal_(nominal), noise_(std::move(noise)), reads_(reads) {
  const ChannelIndex channel(names);
  for (const int body : nominal_.actuated) {
    const std::string& joint = nominal_.bodies[body].joint;
    layout_.position.push_back(channel("sensor.encoder." + joint + ".position"));
    layout_.velocity.push_back(channel("sensor.encoder." + joint + ".velocity"));
    layout_.acceleration.push_back(channel("sensor.encoder." + joint + ".acceleration"));
    layout_.torque.push_back(channel("sensor.torque." + joint));
    layout_.actuator.push_back(channel("actuator.torque." + joint));
  }
  if (nominal_.floating_base) {
    layout_.imu_linear = channel("sensor.imu.linear.x");
    layout_.imu_angular = channel("sensor.imu.angular.roll");
    layout_.gps = channel("sensor.gps.x");
    layout_.magnetometer = channel("sensor.magnetometer.roll");
    layout_.z = channel("sensor.estimate.z");
    layout_.estimate_velocity = channel("sensor.estimate.velocity.x");
    layout_.estimate_rate = channel("sensor.estimate.rate.roll");
  }
  for (const std::string& name : names) hash_.push_back(name_hash(name));
  noise_.jitter.resize(names.size());
  const int channels = static_cast<int>(names.size());
  bias_ = error_ = BlockArray(channels);
  zero_ = encoder_error_ = encoder_velocity_error_ = torque_error_ = BlockArray(nominal_.na());
  for (const Collider& collider : nominal_.colliders) {
    frame_of_collider_.push_back(collider.is_object ? -1 : nominal_.frame(collider.link));
  }
  for (const int c : needed_channels()) {
    if (noise_.jitter[c]) drawn_.push_back(c);
  }
}

std::vector<int> Sensors::needed_channels() const {
  // The actuators use these whatever the policy reads.
  std::vector<int> needed = layout_.position;
  const auto add = [&](const std::vector<int>& channels) {
    needed.insert(needed.end(), channels.begin(), channels.end());
  };
  add(layout_.velocity);
  add(layout_.actuator);
  if (reads(kJointAcceleration)) add(layout_.acceleration);
  if (reads(kJointTorque)) add(layout_.torque);
  if (nominal_.floating_base) {
    if (reads(kBasePosition)) add({layout_.gps, layout_.gps + 1, layout_.z});
    const std::pair<SensedGroup, int> triples[] = {{kBaseRpy, layout_.magnetometer},
                                                   {kBaseVelocity, layout_.estimate_velocity},
                                                   {kBaseRate, layout_.estimate_rate},
                                                   {kImuLinear, layout_.imu_linear},
                                                   {kImuAngular, layout_.imu_angular}};
    for (const auto& [group, first] : triples) {
      if (reads(group)) add({first, first + 1, first + 2});
    }
  }
  std::sort(needed.begin(), needed.end());
  return needed;
}

void Sensors::resize(Observation& out) const {
  const int na = nominal_.na();
  resize_group(out.joint_position, na, reads(kJointPosition));
  resize_group(out.joint_velocity, na, reads(kJointVelocity));
  resize_group(out.joint_acceleration, na, reads(kJointAcceleration));
  resize_group(out.joint_torque, na, reads(kJointTorque));
  resize_group(out.base_position, 3, reads(kBasePosition));
  resize_group(out.base_rpy, 3, reads(kBaseRpy));
  resize_group(out.base_velocity, 3, reads(kBaseVelocity));
  resize_group(out.base_rate, 3, reads(kBaseRate));
  resize_group(out.imu_linear, 3, reads(kImuLinear));
  resize_group(out.imu_angular, 3, reads(kImuAngular));
  resize_group(out.link_force, static_cast<int>(nominal_.frames.size()), reads(kLinkForce));
}

void Sensors::start(int lane, const Particle& particle) {
  particle_[lane] = particle.id;
  for (int c = 0; c < bias_.rows(); ++c) {
    bias_(c, lane) = c < static_cast<int>(particle.sensor_bias.size()) ? particle.sensor_bias[c] : 0.0;
    error_(c, lane) = bias_(c, lane);
  }
  for (int k = 0; k < nominal_.na(); ++k) {
    zero_(k, lane) = k < static_cast<int>(particle.joint_zero.size()) ? particle.joint_zero[k] : 0.0;
    encoder_error_(k, lane) = error_(layout_.position[k], lane) - zero_(k, lane);
    encoder_velocity_error_(k, lane) = error_(layout_.velocity[k], lane);
    torque_error_(k, lane) = error_(layout_.actuator[k], lane);
  }
}

void Sensors::draw_errors(const std::array<std::uint32_t, kLanes>& step, LaneMask active) {
  for (const int c : drawn_) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const double u = uniform(noise_.seed, particle_[lane], hash_[c], step[lane]);
      error_(c, lane) = bias_(c, lane) + noise_.jitter[c]->quantile(u);
    }
  }
}

void Sensors::sense(const BlockPhysics& physics, const BlockArray& tau, double h,
                    const std::array<std::uint32_t, kLanes>& step, const std::array<double, kLanes>& time,
                    LaneMask active, Observation& out) {
  resize(out);
  draw_errors(step, active);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) continue;
    out.time[lane] = time[lane];
    for (int k = 0; k < nominal_.na(); ++k) {
      encoder_error_(k, lane) = error_(layout_.position[k], lane) - zero_(k, lane);
      encoder_velocity_error_(k, lane) = error_(layout_.velocity[k], lane);
      torque_error_(k, lane) = error_(layout_.actuator[k], lane);
    }
  }
  read_joints(physics.state(), tau, active, out);
  if (nominal_.floating_base) read_base(physics.state(), active, out);
  if (reads(kLinkForce)) read_contacts(physics, h, active, out);
}

void Sensors::read_joints(const BlockState& state, const BlockArray& tau, LaneMask active, Observation& out) const {
  for (int k = 0; k < nominal_.na(); ++k) {
    const Body& body = nominal_.bodies[nominal_.actuated[k]];
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      if (reads(kJointPosition)) out.joint_position(k, lane) = state.q(body.q, lane) + encoder_error_(k, lane);
      if (reads(kJointVelocity)) out.joint_velocity(k, lane) = state.v(body.v, lane) + encoder_velocity_error_(k, lane);
      if (reads(kJointAcceleration))
        out.joint_acceleration(k, lane) = state.a(body.v, lane) + error_(layout_.acceleration[k], lane);
      if (reads(kJointTorque)) out.joint_torque(k, lane) = tau(k, lane) + error_(layout_.torque[k], lane);
    }
  }
}

void Sensors::read_base(const BlockState& state, LaneMask active, Observation& out) const {
  const Body& base = nominal_.bodies[0];
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) continue;
    const Quat quaternion(state.q(base.q, lane), state.q(base.q + 1, lane), state.q(base.q + 2, lane),
                          state.q(base.q + 3, lane));
    const Vec3 rpy = !reads(kBaseRpy) ? Vec3(0, 0, 0) : rpy_from_rotation(quaternion.toRotationMatrix());
    for (int i = 0; i < 3; ++i) {
      const int position_channel = i < 2 ? layout_.gps + i : layout_.z;
      if (reads(kBasePosition))
        out.base_position(i, lane) = state.q(base.q + 4 + i, lane) + error_(position_channel, lane);
      if (reads(kBaseRpy)) out.base_rpy(i, lane) = rpy[i] + error_(layout_.magnetometer + i, lane);
      if (reads(kBaseVelocity))
        out.base_velocity(i, lane) = state.v(base.v + 3 + i, lane) + error_(layout_.estimate_velocity + i, lane);
      if (reads(kBaseRate))
        out.base_rate(i, lane) = state.v(base.v + i, lane) + error_(layout_.estimate_rate + i, lane);
      if (reads(kImuLinear))
        out.imu_linear(i, lane) = state.a(base.v + 3 + i, lane) + error_(layout_.imu_linear + i, lane);
      if (reads(kImuAngular))
        out.imu_angular(i, lane) = state.a(base.v + i, lane) + error_(layout_.imu_angular + i, lane);
    }
  }
}

void Sensors::read_contacts(const BlockPhysics& physics, double h, LaneMask active, Observation& out) const {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!active[lane]) continue;
    for (int f = 0; f < out.link_force.rows(); ++f) out.link_force(f, lane) = 0;
    for (const Contact& contact : physics.contacts(lane)) {
      const double force = contact.normal_impulse() / h;
      for (const int collider : {contact.a, contact.b}) {
        if (frame_of_collider_[collider] >= 0) out.link_force(frame_of_collider_[collider], lane) += force;
      }
    }
  }
}

}  // namespace graze
