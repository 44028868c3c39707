// Policy `gait_switch`: one gait until a moment, another from then on, at once and from wherever the feet are (§4.3.3).
// Both gaits go by the same clock, that of the trace, so that gaits of one duration are in the same phase.

#include <fmt/format.h>

#include "engine/control/registry.h"
#include "engine/settings/warnings.h"

namespace graze {

namespace {

constexpr double kSwitchSlack = 1e-9;  // s, by which sums of control steps may miss a moment

const Description& gait_switch_description() {
  static const Description text = {
      "walks by one gait and, from a moment on, by another, at once and from wherever the feet are",
      {{"at", {Form::number(Quantity::time, Bound::not_negative)}, Default::required(), "when the other gait begins"},
       {"from", {Form::section("policy.gait", "as `gait`")}, Default::required(), "the first gait"},
       {"to", {Form::section("policy.gait", "as `gait`")}, Default::required(), "the gait from then on"}}};
  return text;
}

class GaitSwitch : public Policy {
 public:
  GaitSwitch(const ControlContext& context, const Described& own, TargetKind kind)
      : from_(make_gait(context, own.at("from"), kind)),
        to_(make_gait(context, own.at("to"), kind)),
        at_(own.number("at")) {
    if (from_->effectors() != to_->effectors())
      own.at("to").fail_key("both gaits must have the same feet, in one order");
    if (at_ >= context.end - kSwitchSlack) {
      warn(own.at("at"), fmt::format("{}: the other gait never begins: no trace is longer than {:g} s",
                                     own.at("at").text(), context.end));
    }
  }

  void start(int lane) override {
    from_->start(lane);
    switched_.set(lane, false);
  }

  void carry(int lane, LaneTape& tape) override {
    bool switched = switched_[lane];
    tape.carry(switched);
    switched_.set(lane, switched);
    from_->carry(lane, tape);
    to_->carry(lane, tape);
  }

  unsigned reads() const override { return from_->reads() | to_->reads(); }
  std::vector<int> effectors() const override { return from_->effectors(); }

  std::vector<Inside> inside() const override {
    std::vector<Inside> out = {{"switched", "1"}};
    for (const auto& [policy, name] : {std::pair(from_.get(), "from."), {to_.get(), "to."}}) {
      for (const Inside& one : policy->inside()) out.push_back({name + one.name, one.unit});
    }
    return out;
  }

  void look_inside(int lane, double* out) const override {
    *out++ = switched_[lane] ? 1 : 0;
    from_->look_inside(lane, out);
    to_->look_inside(lane, out + from_->inside().size());
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    LaneMask before, after;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      const bool late = observation.time[lane] >= at_ - kSwitchSlack;
      if (late && !switched_[lane]) {
        to_->start(lane);
        switched_.set(lane);
      }
      (late ? after : before).set(lane);
    }
    if (before.bits() != 0) from_->act(observation, before, targets);
    if (after.bits() != 0) to_->act(observation, after, targets);
  }

 private:
  static std::unique_ptr<Policy> make_gait(const ControlContext& context, const Settings& gait, TargetKind kind) {
    const PolicyEntry& entry = policy_registry().at("gait");
    return entry.make(context, Described(gait, entry.text), kind);
  }

  std::unique_ptr<Policy> from_, to_;
  double at_;  // s
  LaneMask switched_;
};

const PolicyRegistration gait_switch_registration("gait_switch", gait_switch_description(),
                                                  [](const ControlContext& context, const Described& own,
                                                     TargetKind kind) -> std::unique_ptr<Policy> {
                                                    return std::make_unique<GaitSwitch>(context, own, kind);
                                                  });

}  // namespace

}  // namespace graze
