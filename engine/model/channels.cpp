// The sensor and actuator channels of a robot (Figure 15, and the contact flags' mistakes, which it does not have), in
// the one order that parameters, particles and sensors share: group by group, within a group joint by joint in the
// order of Model::actuated, axis by axis, or link by link.
#include "engine/model/world.h"

namespace graze {

namespace {

constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kAngles[] = {"roll", "pitch", "yaw"};

/// Channels of the base; a robot that is bolted down has no use for them (Figure 10 lists none).
void append_base_channels(std::vector<std::string>& names) {
  const auto each = [&](const std::string& prefix, const auto& suffixes) {
    for (const char* suffix : suffixes) names.push_back(prefix + suffix);
  };
  each("sensor.imu.linear.", kAxes);
  each("sensor.imu.angular.", kAngles);
  names.push_back("sensor.gps.x");
  names.push_back("sensor.gps.y");
  each("sensor.magnetometer.", kAngles);
  names.push_back("sensor.estimate.z");
  each("sensor.estimate.velocity.", kAxes);
  each("sensor.estimate.rate.", kAngles);
}

}  // namespace

std::vector<std::string> channel_names(const Robot& robot) {
  std::vector<std::string> joints, names;
  for (const Joint& joint : robot.joints) {
    if (joint.type == JointType::revolute || joint.type == JointType::prismatic) joints.push_back(joint.name);
  }
  for (const char* what : {"position", "velocity", "acceleration"}) {
    for (const std::string& joint : joints) names.push_back("sensor.encoder." + joint + "." + what);
  }
  for (const std::string& joint : joints) names.push_back("sensor.torque." + joint);
  if (robot.floating_base) append_base_channels(names);
  for (const std::string& joint : joints) names.push_back("actuator.torque." + joint);
  for (const Link& link : robot.links) {
    if (link.collisions.empty()) continue;
    for (const char* mistake : {"missed", "false"}) names.push_back("sensor.contact." + link.name + "." + mistake);
  }
  return names;
}

}  // namespace graze
