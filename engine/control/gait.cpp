// Policy `gait`: the locomotion policy of Algorithm 6. Forward kinematics of the sensed joints, the planner of
// Algorithm 7, and, for trackers of joints, inverse kinematics of the nominal legs. Keys: gait_settings.cpp.

#include "engine/control/gait_settings.h"
#include "engine/control/ik.h"
#include "engine/control/joint_values.h"
#include "engine/control/kernel.h"
#include "engine/control/lane_gait.h"
#include "engine/lanes/isa.h"

namespace graze {

namespace {

class Gait : public Policy {
 public:
  Gait(const ControlContext& context, GaitSetup setup, TargetKind kind)
      : kernel_(GRAZE_KERNEL(chosen_isa(), find_control_kernel)),
        initial_(actuated_positions(context.nominal, context.initial)),
        legs_(std::move(setup.legs)),
        steering_(std::move(setup.steering)),
        command_(kCommandRows),
        last_time_(1) {
    for (const Leg& leg : legs_) {
      feet_names_.push_back(context.nominal.frames[leg.frame].name);
      reference_.push_back(leg.chain.select(context.initial.q));
      closed_.push_back(detect_hip_knee(leg.chain, reference_.back()));
    }
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const Leg& leg = legs_[i];
      views_.push_back({leg.chain.view(), closed_[i] ? &*closed_[i] : nullptr, reference_[i].data(),
                        static_cast<int>(leg.body_frames.size()), leg.body_frames.data()});
    }
    view_ = {setup.parameters, views_.data(), kind == TargetKind::joint, context.nominal.na(), initial_.data()};
    const int feet = static_cast<int>(legs_.size());
    feet_ = BlockArray((feet * kernel_.foot_doubles + kLanes - 1) / kLanes);
    guess_ = BlockArray(feet * kMaxChainJoints);
  }

  std::vector<int> effectors() const override {
    std::vector<int> frames;
    for (const Leg& leg : legs_) frames.push_back(leg.frame);
    return frames;
  }

  void start(int lane) override {
    fresh_.set(lane);
    steering_->start(lane);
  }

  bool know(int lane, const Policy& other) override {
    const auto* const robot = dynamic_cast<const Gait*>(&other);
    if (robot == nullptr || robot->effectors() != effectors()) return false;
    if (!each_) each_.emplace(view_);
    if (!each_->fits(robot->view_)) return false;
    each_->put(lane, robot->view_);
    return true;
  }

  void carry(int lane, LaneTape& tape) override {
    bool fresh = fresh_[lane];
    tape.carry(fresh);
    fresh_.set(lane, fresh);
    for (BlockArray* rows : {&command_, &last_time_, &guess_}) tape.carry(*rows, lane);
    const int feet = static_cast<int>(legs_.size());
    std::vector<double> memory(static_cast<std::size_t>(feet * kernel_.foot_numbers));
    if (!tape.reads()) kernel_.copy_feet(feet_.row(0), feet, lane, memory.data(), false);
    for (double& number : memory) tape.carry(number);
    if (tape.reads()) kernel_.copy_feet(feet_.row(0), feet, lane, memory.data(), true);
    steering_->carry(lane, tape);
  }

  unsigned reads() const override {
    const GaitParameters& p = view_.p;
    const unsigned righting = p.stabilizer.on ? kBaseRpy | kBaseRate : 0u;
    return kJointPosition | righting | (p.global_up ? kBaseTilt : 0u) | (p.recovery ? kLinkForce : 0u) |
           steering_->reads();
  }

  std::vector<Inside> inside() const override {
    std::vector<Inside> out;
    for (const std::string& foot : feet_names_) out.push_back({foot + ".mode", "1"});
    for (const char* axis : {"vx", "vy", "vz"}) out.push_back({std::string("command.") + axis, "m/s"});
    for (const char* axis : {"wx", "wy", "wz"}) out.push_back({std::string("command.") + axis, "rad/s"});
    return out;
  }

  void look_inside(int lane, double* out) const override {
    const int feet = static_cast<int>(legs_.size());
    kernel_.foot_modes(feet_.row(0), feet, lane, out);
    for (int i = 0; i < kCommandRows; ++i) out[feet + i] = command_(i, lane);
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    steering_->steer(observation, active, command_);
    GaitCall call{};
    call.active = active.bits();
    call.fresh = active.bits() & fresh_.bits();
    call.time = observation.time.data();
    call.joint_position = observation.joint_position.row(0);
    if (view_.p.global_up || view_.p.stabilizer.on) call.base_rpy = observation.base_rpy.row(0);
    if (view_.p.stabilizer.on) call.base_rate = observation.base_rate.row(0);
    if (view_.p.recovery) call.link_force = observation.link_force.row(0);
    call.command = command_.row(0);
    call.feet = feet_.row(0);
    call.last_time = last_time_.row(0);
    call.guess = guess_.row(0);
    call.q = targets.q.row(0);
    call.v = targets.v.row(0);
    call.tau = targets.tau.row(0);
    call.x = targets.x.row(0);
    call.xd = targets.xd.row(0);
    each_ ? kernel_.gait_of_each(each_->view(), call) : kernel_.gait(view_, call);
    fresh_ = LaneMask(fresh_.bits() & ~active.bits());
  }

 private:
  const ControlKernel& kernel_;
  std::vector<double> initial_;
  std::vector<Leg> legs_;
  std::vector<std::string> feet_names_;
  std::unique_ptr<Steering> steering_;
  std::vector<Chain::Values> reference_;
  std::vector<std::optional<HipKneeView>> closed_;
  std::vector<LegOf<double>> views_;
  GaitOf<double> view_{};
  std::optional<LaneGait> each_;  // if lanes know robots of their own
  LaneMask fresh_;                // started, and not called since
  BlockArray command_, last_time_, feet_, guess_;
};

const PolicyRegistration gait_registration("gait", gait_description(),
                                           [](const ControlContext& context, const Described& own,
                                              TargetKind kind) -> std::unique_ptr<Policy> {
                                             return std::make_unique<Gait>(context, read_gait(context, own), kind);
                                           });

}  // namespace

}  // namespace graze
