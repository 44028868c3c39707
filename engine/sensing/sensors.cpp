#include "engine/sensing/sensors.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string>

#include "engine/model/measures.h"
#include "engine/model/placement.h"
#include "engine/model/rotation.h"
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
  bool has(const std::string& name) const { return index_.count(name) > 0; }

 private:
  std::map<std::string, int> index_;
};

constexpr double kNotRead = std::numeric_limits<double>::quiet_NaN();

/// Sizes a group; what nobody reads stays NaN, so that a forgotten declaration cannot pass for a reading.
void resize_group(BlockArray& group, int rows, bool read) {
  if (group.rows() == rows) return;
  group = BlockArray(rows);
  if (read) return;
  for (int i = 0; i < rows; ++i) std::fill_n(group.row(i), kLanes, kNotRead);
}

/// The same three numbers in every lane.
void fill(BlockArray& group, const Vec3& value) {
  for (int i = 0; i < 3; ++i) std::fill_n(group.row(i), kLanes, value[i]);
}

/// Where a reading's true value comes from; index into ReadingView::source.
enum Source : int { kPositions, kVelocities, kAccelerations, kTorques };

/// The groups whose readings are sums of a true value and an error; index into ReadingView::out.
constexpr std::array kSums = {
    &Observation::joint_position, &Observation::joint_velocity, &Observation::joint_acceleration,
    &Observation::joint_torque,   &Observation::base_position,  &Observation::base_velocity,
    &Observation::base_rate,      &Observation::imu_linear,     &Observation::imu_angular};
enum SumGroup : int {
  kSumJointPosition,
  kSumJointVelocity,
  kSumJointAcceleration,
  kSumJointTorque,
  kSumBasePosition,
  kSumBaseVelocity,
  kSumBaseRate,
  kSumImuLinear,
  kSumImuAngular
};

}  // namespace

Sensors::Sensors(const Model& nominal, const std::vector<std::string>& names, SensorNoise noise, unsigned reads,
                 Isa isa)
    : nominal_(nominal), reads_(reads), kernel_(GRAZE_KERNEL(isa, find_sensing_kernel)), seed_(noise.seed), isa_(isa) {
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
  for (int frame = 0; frame < static_cast<int>(nominal_.frames.size()); ++frame) {
    const std::string flag = "sensor.contact." + nominal_.frames[frame].name;
    if (!channel.has(flag + ".missed")) continue;
    layout_.flags.push_back({frame, channel(flag + ".missed"), channel(flag + ".false")});
  }
  weight_ = robot_weight(nominal_);
  noise.jitter.resize(names.size());
  const int channels = static_cast<int>(names.size());
  bias_ = error_ = BlockArray(channels);
  encoder_error_ = encoder_velocity_error_ = torque_error_ = BlockArray(nominal_.na());
  for (int i = nominal_.floating_base ? 1 : 0; i < static_cast<int>(nominal_.bodies.size()); ++i) {
    if (nominal_.bodies[i].type == JointType::floating) objects_.push_back(i);
  }
  for (const Collider& collider : nominal_.colliders) {
    frame_of_collider_.push_back(collider.is_object ? -1 : nominal_.frame(collider.link));
  }
  std::vector<LaneNoise::Channel> drawn;
  for (const int c : needed_channels()) {
    if (noise.jitter[c]) drawn.push_back({hash_[c], c, *noise.jitter[c]});
  }
  noise_ = LaneNoise(noise.seed, drawn, isa);
  list_readings();
}

void Sensors::list_readings() {
  const auto add = [&](unsigned group, Source source, int source_row, int error_row, int sum, int row) {
    if (reads(group)) readings_.push_back({source, source_row, error_row, sum, row});
  };
  for (int k = 0; k < nominal_.na(); ++k) {
    const Body& body = nominal_.bodies[nominal_.actuated[k]];
    add(kJointPosition, kPositions, body.q, layout_.position[k], kSumJointPosition, k);
    add(kJointVelocity, kVelocities, body.v, layout_.velocity[k], kSumJointVelocity, k);
    add(kJointAcceleration, kAccelerations, body.v, layout_.acceleration[k], kSumJointAcceleration, k);
    add(kJointTorque, kTorques, k, layout_.torque[k], kSumJointTorque, k);
  }
  if (!nominal_.floating_base) return;
  const Body& base = nominal_.bodies[0];
  for (int i = 0; i < 3; ++i) {
    add(i < 2 ? kBasePlace : kBaseHeight, kPositions, base.q + 4 + i, i < 2 ? layout_.gps + i : layout_.z,
        kSumBasePosition, i);
    add(kBaseVelocity, kVelocities, base.v + 3 + i, layout_.estimate_velocity + i, kSumBaseVelocity, i);
    add(kBaseRate, kVelocities, base.v + i, layout_.estimate_rate + i, kSumBaseRate, i);
    add(kImuLinear, kAccelerations, base.v + 3 + i, layout_.imu_linear + i, kSumImuLinear, i);
    add(kImuAngular, kAccelerations, base.v + i, layout_.imu_angular + i, kSumImuAngular, i);
  }
}

std::vector<int> Sensors::needed_channels() const {
  std::vector<int> needed = layout_.actuator;  // whatever the policy reads
  const auto add = [&](const std::vector<int>& channels) {
    needed.insert(needed.end(), channels.begin(), channels.end());
  };
  if (reads(kJointPosition | kServoPosition)) add(layout_.position);
  if (reads(kJointVelocity | kServoVelocity)) add(layout_.velocity);
  if (reads(kJointAcceleration)) add(layout_.acceleration);
  if (reads(kJointTorque)) add(layout_.torque);
  if (reads(kLinkForce)) {
    for (const Flag& flag : layout_.flags) add({flag.missed, flag.invented});
  }
  if (nominal_.floating_base) {
    if (reads(kBasePlace)) add({layout_.gps, layout_.gps + 1});
    if (reads(kBaseHeight)) add({layout_.z});
    if (reads(kBaseTilt)) add({layout_.magnetometer, layout_.magnetometer + 1});
    if (reads(kBaseYaw)) add({layout_.magnetometer + 2});
    const std::pair<SensedGroup, int> triples[] = {{kBaseVelocity, layout_.estimate_velocity},
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
  const bool fresh = out.base_rpy.rows() == 0;
  resize_group(out.joint_position, na, reads(kJointPosition));
  resize_group(out.joint_velocity, na, reads(kJointVelocity));
  resize_group(out.joint_acceleration, na, reads(kJointAcceleration));
  resize_group(out.joint_torque, na, reads(kJointTorque));
  resize_group(out.base_position, 3, reads(kBasePlace) && reads(kBaseHeight));
  resize_group(out.base_rpy, 3, reads(kBaseTilt) && reads(kBaseYaw));
  resize_group(out.base_velocity, 3, reads(kBaseVelocity));
  resize_group(out.base_rate, 3, reads(kBaseRate));
  resize_group(out.imu_linear, 3, reads(kImuLinear));
  resize_group(out.imu_angular, 3, reads(kImuAngular));
  resize_group(out.link_force, static_cast<int>(nominal_.frames.size()), reads(kLinkForce));
  resize_group(out.link_push, 6 * static_cast<int>(nominal_.frames.size()), reads(kLinkPush));
  resize_group(out.object_state, kObjectRows * static_cast<int>(objects_.size()), reads(kObjectState));
  if (!fresh || nominal_.floating_base) return;
  const Pose X_WB = fixed_base_pose(nominal_);
  if (reads(kBasePosition)) fill(out.base_position, X_WB.translation());
  if (reads(kBaseRpy)) fill(out.base_rpy, rpy_from_rotation(X_WB.linear()));
}

void Sensors::start(int lane, const Particle& particle) {
  particle_[lane] = particle.id;
  for (int c = 0; c < bias_.rows(); ++c) {
    bias_(c, lane) = c < static_cast<int>(particle.sensor_bias.size()) ? particle.sensor_bias[c] : 0.0;
  }
  for (int k = 0; k < nominal_.na() && k < static_cast<int>(particle.joint_zero.size()); ++k) {
    bias_(layout_.position[k], lane) -= particle.joint_zero[k];
  }
  for (int c = 0; c < bias_.rows(); ++c) error_(c, lane) = bias_(c, lane);
  if (reads(kLinkForce)) add_flag_noise(lane);
  copy_errors();
}

/// From now on draws for the flags that may err in this lane. A channel's draws depend on its name alone, so that
/// others beside it change no bit.
void Sensors::add_flag_noise(int lane) {
  const std::size_t before = flag_channels_.size();
  for (const Flag& flag : layout_.flags) {
    for (const int c : {flag.missed, flag.invented}) {
      const auto is_it = [&](const LaneNoise::Channel& channel) { return channel.row == c; };
      if (!(bias_(c, lane) > 0) || std::any_of(flag_channels_.begin(), flag_channels_.end(), is_it)) continue;
      flag_channels_.push_back({hash_[c], c, Distribution::uniform(0, 1)});
    }
  }
  if (flag_channels_.size() == before) return;
  flag_noise_ = LaneNoise(seed_, flag_channels_, isa_);
  zero_ = BlockArray(bias_.rows());
  flag_uniform_ = BlockArray(bias_.rows());
  for (int c = 0; c < flag_uniform_.rows(); ++c) std::fill_n(flag_uniform_.row(c), kLanes, 1.0);
}

/// Bernoulli errors of the contact flags: with its channel's probability a touch reads as none, and none as one.
void Sensors::mistake_contacts(const std::array<std::uint32_t, kLanes>& step, LaneMask active, BlockArray& force) {
  if (flag_channels_.empty()) return;
  flag_noise_.draw(particle_, step, active, zero_, flag_uniform_);
  for (const Flag& flag : layout_.flags) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      double& read = force(flag.frame, lane);
      const bool touches = read > 0;
      const int c = touches ? flag.missed : flag.invented;
      if (flag_uniform_(c, lane) < bias_(c, lane)) read = touches ? 0.0 : weight_;
    }
  }
}

/// Hands out the errors that the actuators use.
void Sensors::copy_errors() {
  for (int k = 0; k < nominal_.na(); ++k) {
    std::copy_n(error_.row(layout_.position[k]), kLanes, encoder_error_.row(k));
    std::copy_n(error_.row(layout_.velocity[k]), kLanes, encoder_velocity_error_.row(k));
    std::copy_n(error_.row(layout_.actuator[k]), kLanes, torque_error_.row(k));
  }
}

/// The shares of the contacts in the forces on links, in the order of the contacts.
void Sensors::list_forces(const BlockPhysics& physics) {
  forces_.clear();
  for (const ContactPoint& point : physics.contact_points()) {
    for (const int collider : {point.a, point.b}) {
      const int frame = frame_of_collider_[collider];
      if (frame >= 0) forces_.push_back({point.row(kNormalImpulse), point.lanes.bits(), frame});
    }
  }
}

/// Contact forces on links, and where they act.
void Sensors::sum_pushes(const BlockPhysics& physics, double h, LaneMask active, BlockArray& push) const {
  BlockArray pressed(push.rows() / 6);  // N s
  for (int lane = 0; lane < kLanes; ++lane) {
    for (int k = 0; active[lane] && k < push.rows(); ++k) push(k, lane) = 0;
  }
  for (const ContactPoint& point : physics.contact_points()) {
    for (const int collider : {point.a, point.b}) {
      const int frame = frame_of_collider_[collider];
      if (frame < 0) continue;
      const double side = collider == point.a ? 1 : -1;
      for (int lane = 0; lane < kLanes; ++lane) {
        const double normal = point.lanes[lane] && active[lane] ? point(kNormalImpulse, lane) : 0.0;
        if (!(normal > 0)) continue;
        pressed(frame, lane) += normal;
        const double share = normal / pressed(frame, lane);
        for (int k = 0; k < 3; ++k) {
          const auto impulse = static_cast<ContactRow>(kImpulse + k), place = static_cast<ContactRow>(kPoint + k);
          push(6 * frame + k, lane) += side * point(impulse, lane) / h;
          double& at = push(6 * frame + 3 + k, lane);
          at += share * (point(place, lane) - at);
        }
      }
    }
  }
}

/// Where the movable objects are, and how they move.
void Sensors::see_objects(const BlockState& state, LaneMask active, BlockArray& out) const {
  int row = 0;
  const auto copy = [&](const BlockArray& from, int first, int count) {
    for (int k = first; k < first + count; ++k, ++row) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (active[lane]) out(row, lane) = from(k, lane);
      }
    }
  };
  for (const int body : objects_) {
    copy(state.q, nominal_.bodies[body].q, 7);
    copy(state.v, nominal_.bodies[body].v, 6);
  }
}

void Sensors::sense(const BlockPhysics& physics, const BlockArray& tau, double h,
                    const std::array<std::uint32_t, kLanes>& step, const std::array<double, kLanes>& time,
                    LaneMask active, Observation& out) {
  resize(out);
  noise_.draw(particle_, step, active, bias_, error_);
  copy_errors();
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane]) out.time[lane] = time[lane];
  }
  const BlockState& state = physics.state();
  const std::array source = {state.q.row(0), state.v.row(0), state.a.row(0), tau.row(0)};
  std::array<double*, kSums.size()> sums;
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = (out.*kSums[i]).row(0);
  ReadingView view{};
  view.active = active.bits();
  view.source = source.data();
  view.error = error_.row(0);
  view.out = sums.data();
  view.reading_count = static_cast<int>(readings_.size());
  view.readings = readings_.data();
  if (nominal_.floating_base && reads(kBaseRpy)) {
    view.quaternion = state.q.row(nominal_.bodies[0].q);
    view.rpy_error = error_.row(layout_.magnetometer);
    view.rpy = out.base_rpy.row(0);
  }
  if (reads(kLinkForce)) {
    list_forces(physics);
    view.frame_count = out.link_force.rows();
    view.link_force = out.link_force.row(0);
    view.force_count = static_cast<int>(forces_.size());
    view.forces = forces_.data();
    view.h = h;
  }
  kernel_->read(view);
  if (view.rpy != nullptr) {  // the three come together
    if (!reads(kBaseTilt)) std::fill_n(out.base_rpy.row(0), 2 * kLanes, kNotRead);
    if (!reads(kBaseYaw)) std::fill_n(out.base_rpy.row(2), kLanes, kNotRead);
  }
  if (reads(kLinkForce)) mistake_contacts(step, active, out.link_force);
  if (reads(kLinkPush)) sum_pushes(physics, h, active, out.link_push);
  if (reads(kObjectState)) see_objects(state, active, out.object_state);
}

}  // namespace graze
