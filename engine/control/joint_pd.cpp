// Tracker `joint_pd`. The servo itself runs in the actuators, at every physics step and on the encoder.

#include <fmt/format.h>

#include <algorithm>

#include "engine/control/joint_values.h"
#include "engine/control/rows.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

const Description& joint_pd_description() {
  static const Description text = {
      "a servo in each joint: spring kp, damper kd and integral ki towards the policy's positions",
      {servo_spring(),
       servo_damper(),
       {"ki",
        {Form::joint_numbers(Quantity::dimensionless, Bound::not_negative)},
        Default::value("0"),
        "integral, N m/(rad s) or N/(m s); it stands still while the torque is cut"},
       {"implicit",
        {Form::flag()},
        Default::value("true"),
        "a servo at every physics step; `false`: a torque from the sensed state, held for the control step"}}};
  return text;
}

class JointPd : public Tracker {
 public:
  JointPd(const ControlContext& context, const Described& own) {
    doubt_unnamed(context.nominal, own.at("kp"), "are limp");
    kp_ = read_gains(context.nominal, own, "kp", Quantity::stiffness);
    kd_ = read_gains(context.nominal, own, "kd", Quantity::damping);
    ki_ = read_gains(context.nominal, own, "ki");
    implicit_ = own.flag("implicit");
    if (!implicit_ && any(ki_)) own.at("ki").fail_key("goes with servos; with 'implicit: false' there is no integral");
  }

  TargetKind kind() const override { return TargetKind::joint; }
  bool know(int, const Tracker& other) override {  // gains follow from no number of the robot
    return dynamic_cast<const JointPd*>(&other) != nullptr;
  }
  unsigned reads() const override {
    if (!implicit_) return (any(kp_) ? kJointPosition : 0u) | (any(kd_) ? kJointVelocity : 0u);
    return (any(kp_) || any(ki_) ? kServoPosition : 0u) | (any(kd_) ? kServoVelocity : 0u);
  }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    if (!implicit_) return track_by_torque(observation, targets, active, command);
    for (int k = 0; k < static_cast<int>(kp_.size()); ++k) {
      copy_lanes(command.tau.row(k), targets.tau.row(k), active);
      copy_lanes(command.q.row(k), targets.q.row(k), active);
      copy_lanes(command.v.row(k), targets.v.row(k), active);
      fill_lanes(command.kp.row(k), kp_[k], active);
      fill_lanes(command.kd.row(k), kd_[k], active);
      fill_lanes(command.ki.row(k), ki_[k], active);
    }
  }

 private:
  static bool any(const std::vector<double>& gains) {
    return std::any_of(gains.begin(), gains.end(), [](double gain) { return gain != 0; });
  }

  /// The law at the beginning of the control step, as a torque: what makes a stiff servo need short steps (§8.1).
  void track_by_torque(const Observation& observation, const Targets& targets, LaneMask active,
                       ActuatorCommand& command) const {
    for (int k = 0; k < static_cast<int>(kp_.size()); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane]) continue;
        double tau = targets.tau(k, lane);  // what no gain reads is not sensed, and NaN
        if (kp_[k] != 0) tau += kp_[k] * (targets.q(k, lane) - observation.joint_position(k, lane));
        if (kd_[k] != 0) tau += kd_[k] * (targets.v(k, lane) - observation.joint_velocity(k, lane));
        command.tau(k, lane) = tau;
        command.kp(k, lane) = command.kd(k, lane) = command.ki(k, lane) = 0;
      }
    }
  }

  std::vector<double> kp_, kd_, ki_;
  bool implicit_ = true;
};

const TrackerRegistration joint_pd_registration("joint_pd", joint_pd_description(), TargetKind::joint,
                                                [](const ControlContext& context, const Described& own,
                                                   const std::vector<int>&) -> std::unique_ptr<Tracker> {
                                                  return std::make_unique<JointPd>(context, own);
                                                });

}  // namespace

}  // namespace graze
