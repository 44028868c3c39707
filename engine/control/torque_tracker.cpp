// Tracker `torque`: passes the policy's torques on and closes no loop.

#include "engine/control/policy.h"
#include "engine/control/rows.h"

namespace graze {

namespace {

class TorqueTracker : public Tracker {
 public:
  TargetKind kind() const override { return TargetKind::joint; }
  bool know(int, const Tracker& other) override { return dynamic_cast<const TorqueTracker*>(&other) != nullptr; }
  unsigned reads() const override { return 0; }

  void track(const Observation&, const Targets& targets, LaneMask active, ActuatorCommand& command) override {
    for (int k = 0; k < targets.tau.rows(); ++k) {
      copy_lanes(command.tau.row(k), targets.tau.row(k), active);
      fill_lanes(command.kp.row(k), 0.0, active);
      fill_lanes(command.kd.row(k), 0.0, active);
      fill_lanes(command.ki.row(k), 0.0, active);
    }
  }
};

const TrackerRegistration torque_tracker_registration(
    "torque", {"passes the policy's torques on; without any, the robot is limp", {}}, TargetKind::joint,
    [](const ControlContext&, const Described&, const std::vector<int>&) -> std::unique_ptr<Tracker> {
      return std::make_unique<TorqueTracker>();
    });

}  // namespace

}  // namespace graze
