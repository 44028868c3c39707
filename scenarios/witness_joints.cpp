// Witnesses of joints and actuators. Several joints: the least margin.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenarios/keys.h"
#include "scenarios/names.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

/// Indices into Model::actuated; all of them by default.
std::vector<int> read_joints(const Settings& settings, const Model& nominal) {
  const auto joints = settings.find("joints");
  const std::vector<std::string> names = driven_names(nominal);
  if (joints) return match_names(*joints, joints->text(), names, "joint");
  if (names.empty()) settings.fail_key("the robot has no joints");
  return match_names(settings, "*", names, "joint");
}

std::string joints_text(const Settings& settings) {
  const std::string pattern = settings.text_or("joints", "*");
  return pattern == "*" ? "all joints" : pattern;
}

/// Keeps the joints for which `limited` holds; refuses if none is left.
template <typename Limited>
std::vector<int> only(const Settings& settings, const Model& nominal, const char* limit, Limited limited) {
  std::vector<int> joints = read_joints(settings, nominal);
  std::erase_if(joints, [&](int k) { return !limited(nominal.bodies[nominal.actuated[k]]); });
  if (joints.empty()) {
    settings.fail_key(
        fmt::format("no joint that matches '{}' has {} in the URDF", settings.text_or("joints", "*"), limit));
  }
  return joints;
}

/// Least of a function of (body, actuator index) over joints.
class OverJoints : public Witness {
 public:
  explicit OverJoints(std::vector<int> joints) : joints_(std::move(joints)) {}

  double evaluate(const WitnessInput& in) const override {
    double least = std::numeric_limits<double>::infinity();
    for (const int k : joints_) least = std::min(least, margin(in, in.model.bodies[in.model.actuated[k]], k));
    return least;
  }

 private:
  virtual double margin(const WitnessInput& in, const Body& body, int k) const = 0;
  std::vector<int> joints_;
};

class JointLimits : public OverJoints {
 public:
  JointLimits(std::vector<int> joints, double spare) : OverJoints(std::move(joints)), spare_(spare) {}

 private:
  double margin(const WitnessInput& in, const Body& body, int) const override {
    const double q = in.state.q(body.q, in.lane);
    return std::min(q - body.lower, body.upper - q) - spare_;
  }
  double spare_;  // rad or m to keep from the limit
};

class TorqueLimits : public OverJoints {
 public:
  using OverJoints::OverJoints;

 private:
  double margin(const WitnessInput& in, const Body&, int k) const override { return in.headroom(k, in.lane); }
};

/// §6.1.1: the linear torque-speed line in all four quadrants, tau_max - |v| tau_max / v_max - |tau|.
class TorqueSpeed : public OverJoints {
 public:
  using OverJoints::OverJoints;

 private:
  double margin(const WitnessInput& in, const Body& body, int k) const override {
    const double speed = std::abs(in.state.v(body.v, in.lane));
    return body.effort * (1.0 - speed / body.velocity) - std::abs(in.tau(k, in.lane));
  }
};

class JointSpeed : public OverJoints {
 public:
  JointSpeed(std::vector<int> joints, double below) : OverJoints(std::move(joints)), below_(below) {}

 private:
  double margin(const WitnessInput& in, const Body& body, int) const override {
    return std::min(below_, body.velocity) - std::abs(in.state.v(body.v, in.lane));
  }
  double below_;  // rad/s; infinite: the joint's own limit
};

}  // namespace

ReadWitness read_joint_limits(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("joint_limits"));
  std::vector<int> joints = only(settings, nominal, "position limits",
                                 [](const Body& b) { return std::isfinite(b.lower) || std::isfinite(b.upper); });
  const auto spare = settings.find("margin");
  return {std::make_shared<JointLimits>(std::move(joints), spare ? spare->non_negative(Quantity::angle) : 0.0),
          "position limits of " + joints_text(settings), "rad"};
}

ReadWitness read_torque_limits(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("torque_limits"));
  std::vector<int> joints =
      only(settings, nominal, "an effort limit", [](const Body& b) { return std::isfinite(b.effort); });
  return {std::make_shared<TorqueLimits>(std::move(joints)), "torque limits of " + joints_text(settings), "N m"};
}

ReadWitness read_torque_speed(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("torque_speed"));
  std::vector<int> joints = only(settings, nominal, "both an effort and a velocity limit",
                                 [](const Body& b) { return std::isfinite(b.effort) && std::isfinite(b.velocity); });
  return {std::make_shared<TorqueSpeed>(std::move(joints)), "torque-speed line of " + joints_text(settings), "N m"};
}

ReadWitness read_joint_speed(const Settings& settings, const Model& nominal) {
  settings.allow(keys_of("joint_speed"));
  const auto limit = settings.find("below");
  const double below = limit ? limit->positive(Quantity::angular_velocity) : std::numeric_limits<double>::infinity();
  std::vector<int> joints =
      limit ? read_joints(settings, nominal)
            : only(settings, nominal, "a velocity limit", [](const Body& b) { return std::isfinite(b.velocity); });
  return {std::make_shared<JointSpeed>(std::move(joints), below), "speed of " + joints_text(settings), "rad/s"};
}

}  // namespace graze
