// Tracker `joint_pd`: {kp: N m/rad, kd: N m s/rad, ki: N m/(rad s)}, each a number or a map of joint globs. The servo
// itself runs in the actuators, at every physics step and on the encoder.

#include "engine/control/joint_values.h"

namespace graze {

namespace {

class JointPd : public Tracker {
 public:
  JointPd(const ControlContext& context, const Settings& settings) {
    settings.allow({"kp", "kd", "ki"});
    settings.at("kp");  // required
    kp_ = read_gains(context.nominal, settings, "kp", Quantity::rotational_stiffness);
    kd_ = read_gains(context.nominal, settings, "kd", Quantity::rotational_damping);
    ki_ = read_gains(context.nominal, settings, "ki", Quantity::dimensionless);
  }

  TargetKind kind() const override { return TargetKind::joint; }
  unsigned reads() const override { return 0; }

  void track(const Observation&, const Targets& targets, LaneMask active, ActuatorCommand& command) override {
    for (int k = 0; k < static_cast<int>(kp_.size()); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane]) continue;
        command.tau(k, lane) = targets.tau(k, lane);
        command.q(k, lane) = targets.q(k, lane);
        command.v(k, lane) = targets.v(k, lane);
        command.kp(k, lane) = kp_[k];
        command.kd(k, lane) = kd_[k];
        command.ki(k, lane) = ki_[k];
      }
    }
  }

 private:
  std::vector<double> kp_, kd_, ki_;
};

const TrackerRegistration registration("joint_pd", TargetKind::joint,
                                       [](const ControlContext& context, const Settings& settings,
                                          const std::vector<int>&) -> std::unique_ptr<Tracker> {
                                         return std::make_unique<JointPd>(context, settings);
                                       });

}  // namespace

}  // namespace graze
