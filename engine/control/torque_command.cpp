// Policy `torque`: open-loop joint torques. Joints that nothing is said about get none. With control: {torque: {}} a
// robot without any command is limp.

#include "engine/control/joint_table.h"
#include "engine/control/joint_values.h"
#include "engine/control/rows.h"

namespace graze {

namespace {

const Description& torque_command_description() {
  static const Description text = {
      "gives the joints torques, constant or by a table over time",
      {{"constant",
        {Form::joint_numbers(Quantity::torque), Form::joint_numbers(Quantity::force)},
        Default::value("0"),
        "all along"},
       {"table", {Form::text("FILE")}, {}, "CSV `time,JOINT,…` of what is added to it over time"},
       interpolation_key()}};
  return text;
}

class TorqueCommand : public Policy {
 public:
  TorqueCommand(const ControlContext& context, const Described& own)
      : q0_(actuated_positions(context.nominal, context.initial)), constant_(q0_.size(), 0.0) {
    if (const auto constant = own.find("constant")) {
      constant_ = read_joint_values(context.nominal, *constant, Quantity::torque, 0.0, Quantity::force);
    }
    if (const auto table = own.find("table")) {
      table_ = JointTable::load(*table, actuated_names(context.nominal), read_interpolation(own));
    }
  }

  void start(int) override {}
  void carry(int, LaneTape&) override {}
  unsigned reads() const override { return 0; }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    for (int k = 0; k < static_cast<int>(q0_.size()); ++k) {
      fill_lanes(targets.q.row(k), q0_[k], active);
      fill_lanes(targets.v.row(k), 0.0, active);
      fill_lanes(targets.tau.row(k), constant_[k], active);
    }
    for (int lane = 0; lane < kLanes && table_; ++lane) {
      if (!active[lane]) continue;
      for (std::size_t c = 0; c < table_->columns().size(); ++c) {
        targets.tau(table_->columns()[c], lane) += table_->at(c, observation.time[lane]).value;
      }
    }
  }

 private:
  std::vector<double> q0_, constant_;
  std::optional<JointTable> table_;
};

const PolicyRegistration torque_command_registration("torque", torque_command_description(),
                                                     [](const ControlContext& context, const Described& own,
                                                        TargetKind kind) -> std::unique_ptr<Policy> {
                                                       if (kind != TargetKind::joint) {
                                                         own.settings().fail_key(
                                                             "torque gives joint torques; use control: {torque: {}}");
                                                       }
                                                       return std::make_unique<TorqueCommand>(context, own);
                                                     });

}  // namespace

}  // namespace graze
