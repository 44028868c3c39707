// Tracker `prescribed`: joints follow the policy's positions exactly (dissertation §8.4): at the end
// of every physics step each stands where its encoder reads the target, by whatever torque that takes; with `limited`
// by no more than the actuator has. The back end solves it together with contact.

#include "engine/control/policy.h"

namespace graze {

namespace {

const Description& prescribed_description() {
  static const Description text = {
      "each joint is where the policy wants it, by whatever torque that takes (physics: lanes alone)",
      {{"limited", {Form::flag()}, Default::value("true"), "by no more torque than the actuators have"}}};
  return text;
}

class Prescribed : public Tracker {
 public:
  Prescribed(const ControlContext& context, const Described& own) {
    if (!context.solves_drives) {
      own.settings().fail(
          "prescribed motion is part of the contact solve of physics: lanes; other back ends know torques "
          "only (joint_pd comes nearest)");
    }
    value_ = own.flag("limited") ? 1 : 2;
  }

  TargetKind kind() const override { return TargetKind::joint; }
  bool know(int, const Tracker& other) override { return dynamic_cast<const Prescribed*>(&other) != nullptr; }
  unsigned reads() const override { return kServoPosition; }

  void track(const Observation&, const Targets& targets, LaneMask active, ActuatorCommand& command) override {
    for (int k = 0; k < targets.q.rows(); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane]) continue;
        command.q(k, lane) = targets.q(k, lane);
        command.v(k, lane) = targets.v(k, lane);
        command.tau(k, lane) = command.kp(k, lane) = command.kd(k, lane) = command.ki(k, lane) = 0;
        command.prescribed(k, lane) = value_;
      }
    }
  }

 private:
  double value_ = 1;  // see ActuatorCommand
};

const TrackerRegistration prescribed_registration("prescribed", prescribed_description(), TargetKind::joint,
                                                  [](const ControlContext& context, const Described& own,
                                                     const std::vector<int>&) -> std::unique_ptr<Tracker> {
                                                    return std::make_unique<Prescribed>(context, own);
                                                  });

}  // namespace

}  // namespace graze
