// Policy `hold`: stands as it began: nominal initial joint positions, or, for a tracker of effectors, nothing to follow
// (refused).

#include "engine/control/joint_values.h"
#include "engine/control/rows.h"

namespace graze {

namespace {

class Hold : public Policy {
 public:
  explicit Hold(const ControlContext& context) : q_(actuated_positions(context.nominal, context.initial)) {}

  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }

  void act(const Observation&, LaneMask active, Targets& targets) override {
    for (int k = 0; k < static_cast<int>(q_.size()); ++k) {
      fill_lanes(targets.q.row(k), q_[k], active);
      fill_lanes(targets.v.row(k), 0.0, active);
      fill_lanes(targets.tau.row(k), 0.0, active);
    }
  }

 private:
  std::vector<double> q_;
};

const PolicyRegistration hold_registration("hold", {"keeps the joints where the nominal robot begins", {}},
                                           [](const ControlContext& context, const Described& own,
                                              TargetKind kind) -> std::unique_ptr<Policy> {
                                             need_joint_targets(own, kind, "hold");
                                             return std::make_unique<Hold>(context);
                                           });

}  // namespace

}  // namespace graze
