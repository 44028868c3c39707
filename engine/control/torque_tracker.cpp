// Tracker `torque`: {}. Passes the policy's torques on and closes no loop.

#include "engine/control/policy.h"

namespace graze {

namespace {

class TorqueTracker : public Tracker {
 public:
  TargetKind kind() const override { return TargetKind::joint; }
  unsigned reads() const override { return 0; }

  void track(const Observation&, const Targets& targets, LaneMask active, ActuatorCommand& command) override {
    for (int k = 0; k < targets.tau.rows(); ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!active[lane]) continue;
        command.tau(k, lane) = targets.tau(k, lane);
        command.kp(k, lane) = command.kd(k, lane) = command.ki(k, lane) = 0;
      }
    }
  }
};

const TrackerRegistration registration("torque", TargetKind::joint,
                                       [](const ControlContext&, const Settings& settings,
                                          const std::vector<int>&) -> std::unique_ptr<Tracker> {
                                         settings.allow({});
                                         return std::make_unique<TorqueTracker>();
                                       });

}  // namespace

}  // namespace graze
