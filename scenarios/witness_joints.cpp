// Witnesses of joints and actuators. Several joints: the least margin.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/control/joint_values.h"
#include "scenarios/names.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

/// A joint that its stop holds is beyond it by what the solvers leave, rad or m: rounding, and over a step a speed of
/// about twice the solver's tolerance (1e-6 rad/s; 2e-9 rad were seen at steps of 1 ms). Beyond by less than this, five
/// times what steps of 10 ms leave, counts as at the stop, 0.
constexpr double kAtStop = 1e-7;

constexpr const char* kAll = "*";
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Indices into Model::actuated; all of them by default.
std::vector<int> read_joints(const Described& own, const Model& nominal) {
  const auto joints = own.find("joints");
  const std::vector<std::string> names = driven_names(nominal);
  if (joints) return match_names(*joints, joints->text(), names, "joint");
  if (names.empty()) own.settings().fail_key("the robot has no joints");
  return match_names(own.settings(), kAll, names, "joint");
}

std::string joints_text(const Described& own) {
  const std::string pattern = own.settings().text_or("joints", kAll);
  return pattern == kAll ? "all joints" : pattern;
}

/// Keeps the joints for which `limited` holds; refuses if none is left.
template <typename Limited>
std::vector<int> only(const Described& own, const Model& nominal, const char* limit, Limited limited) {
  std::vector<int> joints = read_joints(own, nominal);
  std::erase_if(joints, [&](int k) { return !limited(nominal.bodies[nominal.actuated[k]]); });
  if (joints.empty()) {
    own.settings().fail_key(
        fmt::format("no joint that matches '{}' has {} in the URDF", own.settings().text_or("joints", kAll), limit));
  }
  return joints;
}

/// Least of a function of each joint, over joints.
class OverJoints : public Witness {
 public:
  explicit OverJoints(const Model& nominal, const std::vector<int>& joints) {
    for (const int k : joints) {
      const Body& body = nominal.bodies[nominal.actuated[k]];
      joints_.push_back({nominal.actuated[k], body.q, body.v, k});
    }
  }

  int numbers() const override { return kLimits * static_cast<int>(joints_.size()); }

  void read(const Model& model, int lane, BlockArray& own) const override {
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const Body& body = model.bodies[joints_[i].body];
      const double limits[kLimits] = {body.lower, body.upper, body.effort, body.velocity};
      for (int k = 0; k < kLimits; ++k) own(static_cast<int>(i) * kLimits + k, lane) = limits[k];
    }
  }

  PartKind parts() const override { return joints_.size() > 1 ? PartKind::joint : PartKind::none; }

  void evaluate(const WitnessInput& in, const BlockArray& own, double* out, double* part) const override {
    std::fill_n(out, kLanes, std::numeric_limits<double>::infinity());
    std::fill_n(part, kLanes, double{kNoPart});
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      double value[kLanes];
      margin(in, joints_[i], own.row(static_cast<int>(i) * kLimits), value);
      for (int lane = 0; lane < kLanes; ++lane) {
        part[lane] = value[lane] < out[lane] ? joints_[i].k : part[lane];
        out[lane] = value[lane] < out[lane] ? value[lane] : out[lane];
      }
    }
  }

 protected:
  struct Joint {
    int body, q, v, k;  // k: index of the actuator
  };
  /// A particle's own limits, rows of `limits`.
  enum Limit { kLower, kUpper, kEffort, kVelocity, kLimits };
  static const double* limit(const double* limits, Limit which) { return limits + which * kLanes; }

 private:
  virtual void margin(const WitnessInput& in, const Joint& joint, const double* limits, double* out) const = 0;
  std::vector<Joint> joints_;
};

class JointLimits : public OverJoints {
 public:
  JointLimits(const Model& nominal, const std::vector<int>& joints, double spare)
      : OverJoints(nominal, joints), spare_(spare) {}

 private:
  void margin(const WitnessInput& in, const Joint& joint, const double* limits, double* out) const override {
    const double *q = in.state.q.row(joint.q), *lower = limit(limits, kLower), *upper = limit(limits, kUpper);
    for (int i = 0; i < kLanes; ++i) {
      const double value = std::min(q[i] - lower[i], upper[i] - q[i]) - spare_;
      out[i] = value < 0 && value >= -kAtStop ? 0.0 : value;
    }
  }
  double spare_;  // rad or m to keep from the limit
};

class TorqueLimits : public OverJoints {
 public:
  using OverJoints::OverJoints;

 private:
  void margin(const WitnessInput& in, const Joint& joint, const double*, double* out) const override {
    std::copy_n(in.headroom.row(joint.k), kLanes, out);
  }
};

/// §6.1.1: the linear torque-speed line in all four quadrants, tau_max - |v| tau_max / v_max - |tau|.
class TorqueSpeed : public OverJoints {
 public:
  using OverJoints::OverJoints;

 private:
  void margin(const WitnessInput& in, const Joint& joint, const double* limits, double* out) const override {
    const double *v = in.state.v.row(joint.v), *tau = in.tau.row(joint.k);
    const double *effort = limit(limits, kEffort), *velocity = limit(limits, kVelocity);
    for (int i = 0; i < kLanes; ++i) {
      out[i] = effort[i] * (1.0 - std::abs(v[i]) / velocity[i]) - std::abs(tau[i]);
    }
  }
};

class JointSpeed : public OverJoints {
 public:
  JointSpeed(const Model& nominal, const std::vector<int>& joints, double below)
      : OverJoints(nominal, joints), below_(below) {}

 private:
  void margin(const WitnessInput& in, const Joint& joint, const double* limits, double* out) const override {
    const double *v = in.state.v.row(joint.v), *velocity = limit(limits, kVelocity);
    for (int i = 0; i < kLanes; ++i) out[i] = std::min(below_, velocity[i]) - std::abs(v[i]);
  }
  double below_;  // rad/s or m/s; infinite: the joint's own limit
};

/// The unit of a margin over some joints: of those that turn, of those that slide, or both, "rad or m".
std::string unit_over(const Model& nominal, const std::vector<int>& joints, Quantity turning, Quantity sliding) {
  const auto slides = [&](int k) { return nominal.bodies[nominal.actuated[k]].type == JointType::prismatic; };
  if (std::all_of(joints.begin(), joints.end(), slides)) return std::string(unit_of(sliding));
  if (std::none_of(joints.begin(), joints.end(), slides)) return std::string(unit_of(turning));
  return fmt::format("{} or {}", unit_of(turning), unit_of(sliding));
}

std::string torque_unit(const Model& nominal, const std::vector<int>& joints) {
  return unit_over(nominal, joints, Quantity::torque, Quantity::force);
}

ReadWitness read_joint_limits(const Described& own, const Model& nominal) {
  const std::vector<int> joints = only(own, nominal, "position limits",
                                       [](const Body& b) { return std::isfinite(b.lower) || std::isfinite(b.upper); });
  const auto written = own.find("margin");
  const double spare =
      written ? written->non_negative(quantity_of_joints(nominal, *written, joints, Quantity::angle, Quantity::length))
              : own.default_number("margin");
  WitnessRange range;
  for (const int k : joints) {
    const Body& body = nominal.bodies[nominal.actuated[k]];
    const double middle = 0.5 * (body.upper - body.lower) - spare;
    if (!(middle < range.high)) continue;
    range.high = middle;
    range.why =
        fmt::format("joint {} has {:g} {} from limit to limit, and a margin of {:g} at both leaves nothing", body.joint,
                    body.upper - body.lower, body.type == JointType::prismatic ? "m" : "rad", spare);
  }
  std::string text = "position limits of " + joints_text(own);
  const std::string unit = unit_over(nominal, joints, Quantity::angle, Quantity::length);
  if (spare > 0) text += fmt::format(", less {:g} {}", spare, unit);
  return {std::make_shared<JointLimits>(nominal, joints, spare), text, unit, range};
}

ReadWitness read_torque_limits(const Described& own, const Model& nominal) {
  const std::vector<int> joints =
      only(own, nominal, "an effort limit", [](const Body& b) { return std::isfinite(b.effort); });
  return {std::make_shared<TorqueLimits>(nominal, joints), "torque limits of " + joints_text(own),
          torque_unit(nominal, joints)};
}

ReadWitness read_torque_speed(const Described& own, const Model& nominal) {
  const std::vector<int> joints = only(own, nominal, "both an effort and a velocity limit", [](const Body& b) {
    return std::isfinite(b.effort) && std::isfinite(b.velocity);
  });
  return {std::make_shared<TorqueSpeed>(nominal, joints), "torque-speed line of " + joints_text(own),
          torque_unit(nominal, joints)};
}

/// " below 2 m/s", the bound that is in force: where the URDF's limits are lower, they are.
std::string speed_bound(const Model& nominal, const std::vector<int>& joints, double below, const std::string& unit) {
  double least = kUnlimited, most = 0;
  for (const int k : joints) {
    least = std::min(least, nominal.bodies[nominal.actuated[k]].velocity);
    most = std::max(most, nominal.bodies[nominal.actuated[k]].velocity);
  }
  if (below <= least) return fmt::format(" below {:g} {}", below, unit);
  if (below < most) return fmt::format(" below {:g} {} or the URDF's limits, where they are lower", below, unit);
  if (least < most) return " below the URDF's limits";
  return fmt::format(" below the URDF's limit{}, {:g} {}", joints.size() > 1 ? "s" : "", least, unit);
}

ReadWitness read_joint_speed(const Described& own, const Model& nominal) {
  const auto limit = own.find("below");
  const std::vector<int> joints =
      limit ? read_joints(own, nominal)
            : only(own, nominal, "a velocity limit", [](const Body& b) { return std::isfinite(b.velocity); });
  const std::string unit = unit_over(nominal, joints, Quantity::angular_velocity, Quantity::velocity);
  double below = kUnlimited;
  if (limit) {
    below =
        limit->positive(quantity_of_joints(nominal, *limit, joints, Quantity::angular_velocity, Quantity::velocity));
  }
  const std::string bound = limit ? speed_bound(nominal, joints, below, unit) : " below the URDF's limits";
  return {std::make_shared<JointSpeed>(nominal, joints, below), "speed of " + joints_text(own) + bound, unit};
}

}  // namespace

std::vector<WitnessKind> joint_witnesses() {
  const Key joints = {"joints", {Form::text("GLOB")}, Default::value(kAll), "joints; of several the worst counts"};
  return {
      {"joint_limits",
       {"joints stay within their position limits, less a margin",
        {joints,
         {"margin",
          {Form::number(Quantity::angle, Bound::not_negative), Form::number(Quantity::length, Bound::not_negative)},
          Default::value("0"),
          "to keep from the limits; m of joints that slide"}},
        {},
        {},
        "Beyond by up to 1e-7 counts as 0, because a joint that its stop holds is there up to what the solver leaves; "
        "`bullet` may leave more (4e-5 rad) where a foot strikes."},
       "rad or m",
       read_joint_limits},
      {"torque_limits",
       {"no more torque is demanded of joints than their actuators have",
        {joints},
        {},
        {},
        "The margin is the limit minus the torque that was demanded, so below 0 where more was demanded than there "
        "is."},
       "N m or N",
       read_torque_limits},
      {"torque_speed",
       {"joints stay below their motors' linear torque-speed line",
        {joints},
        {},
        {},
        "The line is effort · (1 − |q̇| / q̇_max), in all four quadrants. It judges the torque that the joint got after "
        "it "
        "was cut at its limits; what was demanded beyond them `torque_limits` judges."},
       "N m or N",
       read_torque_speed},
      {"joint_speed",
       {"joints stay slower than a bound, by default the URDF's",
        {joints,
         {"below",
          {Form::number(Quantity::angular_velocity, Bound::positive),
           Form::number(Quantity::velocity, Bound::positive)},
          Default::words("the URDF's velocity limits"),
          "the bound, where the URDF's is not lower"}}},
       "rad/s or m/s",
       read_joint_speed},
  };
}

}  // namespace graze
