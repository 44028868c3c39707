// One order is shared by parameters, particles and sensors: family by family; within one of joints channel by channel
// and joint by joint in the order of Model::actuated, of links link by link.
#include "engine/model/channels.h"

#include "engine/model/world.h"

namespace graze {
namespace {

/// A channel reads the truth plus an error of this quantity.
Key channel(const std::string& path, Quantity quantity, const char* help) {
  return {path, {Form::number(quantity)}, Default::value("0"), help};
}

/// Of a base, for x, y, z or roll, pitch, yaw.
std::vector<Key> three(const std::string& prefix, bool angular, Quantity quantity, const char* help) {
  std::vector<Key> out;
  for (const char* axis : {"x", "y", "z"}) {
    if (!angular) out.push_back(channel(prefix + axis, quantity, help));
  }
  for (const char* angle : {"roll", "pitch", "yaw"}) {
    if (angular) out.push_back(channel(prefix + angle, quantity, help));
  }
  return out;
}

std::vector<Key> operator+(std::vector<Key> a, const std::vector<Key>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<ChannelFamily> families() {
  using Of = ChannelFamily::Of;
  const Form chance = Form::fraction();
  return {
      {"encoder",
       Of::joint,
       {"encoders of the joints; of a prismatic one in m",
        {channel("sensor.encoder.JOINT.position", Quantity::angle, "of the joint, less its zero"),
         channel("sensor.encoder.JOINT.velocity", Quantity::angular_velocity, "of the joint"),
         channel("sensor.encoder.JOINT.acceleration", Quantity::angular_acceleration, "of the joint")}}},
      {"torque",
       Of::joint,
       {"force sensors of the joints",
        {channel("sensor.torque.JOINT", Quantity::torque, "that the joint's actuator applied")}}},
      {"imu",
       Of::base,
       {"inertial measurement unit in the base",
        three("sensor.imu.linear.", false, Quantity::acceleration, "acceleration of the base's origin") +
            three("sensor.imu.angular.", true, Quantity::angular_acceleration, "angular acceleration of the base")}},
      {"gps",
       Of::base,
       {"place of the base",
        {channel("sensor.gps.x", Quantity::length, "of the base"),
         channel("sensor.gps.y", Quantity::length, "of the base")}}},
      {"magnetometer",
       Of::base,
       {"attitude of the base", three("sensor.magnetometer.", true, Quantity::angle, "of the base")}},
      {"estimate",
       Of::base,
       {"state estimate of the base: what no sensor tells",
        std::vector<Key>{channel("sensor.estimate.z", Quantity::length, "height of the base")} +
            three("sensor.estimate.velocity.", false, Quantity::velocity, "of the base's origin") +
            three("sensor.estimate.rate.", true, Quantity::angular_velocity, "angular velocity of the base")}},
      {"actuator",
       Of::joint,
       {"what an actuator does beyond what it is asked for",
        {channel("actuator.torque.JOINT", Quantity::torque, "that is added to what was commanded")}}},
      {"contact",
       Of::link,
       {"contact flags of the links, which err with these probabilities at a control step; no jitter",
        {{"sensor.contact.LINK.missed", {chance}, Default::value("0"), "a touch is not seen"},
         {"sensor.contact.LINK.false", {chance}, Default::value("0"), "a touch is seen where there is none"}}}},
  };
}

std::string with_name(std::string path, const std::string& placeholder, const std::string& name) {
  return path.replace(path.find(placeholder), placeholder.size(), name);
}

}  // namespace

const std::vector<ChannelFamily>& channel_families() {
  static const std::vector<ChannelFamily> all = families();
  return all;
}

std::vector<std::string> channel_names(const Robot& robot) {
  using Of = ChannelFamily::Of;
  std::vector<std::string> joints, links, names;
  for (const Joint& joint : robot.joints) {
    if (joint.driven()) joints.push_back(joint.name);
  }
  for (const Link& link : robot.links) {
    if (!link.collisions.empty()) links.push_back(link.name);
  }
  for (const ChannelFamily& family : channel_families()) {
    const std::vector<std::string> paths = family.text.names();
    for (const std::string& path : paths) {
      if (family.of == Of::base && robot.floating_base) names.push_back(path);
      for (const std::string& joint : family.of == Of::joint ? joints : std::vector<std::string>{}) {
        names.push_back(with_name(path, "JOINT", joint));
      }
    }
    for (const std::string& link : family.of == Of::link ? links : std::vector<std::string>{}) {
      for (const std::string& path : paths) names.push_back(with_name(path, "LINK", link));
    }
  }
  return names;
}

}  // namespace graze
