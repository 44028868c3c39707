// Policy `gait`: the locomotion policy of Algorithm 6. Forward kinematics of the sensed joints, the planner of
// Algorithm 7, and, for trackers of joints, inverse kinematics of the nominal legs. Keys: docs/control.md.

#include "engine/control/gait_settings.h"
#include "engine/control/ik.h"
#include "engine/control/joint_values.h"
#include "engine/model/kinematics.h"

namespace graze {

namespace {

class Gait : public Policy {
 public:
  Gait(const ControlContext& context, GaitSetup setup, TargetKind kind)
      : kind_(kind),
        na_(context.nominal.na()),
        initial_(actuated_positions(context.nominal, context.initial)),
        planner_(std::move(setup.parameters)),
        legs_(std::move(setup.legs)),
        steering_(std::move(setup.steering)) {
    for (const Leg& leg : legs_) {
      reference_.push_back(leg.chain.select(context.initial.q));
      ik_.emplace_back(leg.chain, reference_.back());
    }
    for (Lane& lane : lanes_) {
      lane.feet.resize(legs_.size());
      lane.guess = reference_;
    }
  }

  std::vector<int> effectors() const override {
    std::vector<int> frames;
    for (const Leg& leg : legs_) frames.push_back(leg.frame);
    return frames;
  }

  void start(int lane) override {
    lanes_[lane].running = false;
    lanes_[lane].guess = reference_;
    steering_->start(lane);
  }

  unsigned reads() const override {
    const GaitParameters& p = planner_.parameters();
    return kJointPosition | (p.global_up ? kBaseRpy : 0u) | (p.recovery ? kLinkForce : 0u) | steering_->reads();
  }

  void act(const Observation& observation, LaneMask active, Targets& targets) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) act_lane(observation, lane, targets);
    }
  }

 private:
  struct Lane {
    bool running = false;
    double last_time = 0;  // s
    std::vector<FootPlan> feet;
    std::vector<Chain::Values> guess;  // joint solution of the last step, per leg
  };

  GaitInput sense(const Observation& observation, int lane) const {
    GaitInput input;
    input.t = observation.time[lane];
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      const Chain& chain = legs_[i].chain;
      Chain::Values q(chain.size());
      for (int j = 0; j < chain.size(); ++j) {
        q[j] = observation.joint_position(chain.joints()[j].actuator, lane);
      }
      input.x[i] = chain.position(q);
      if (!planner_.parameters().recovery) continue;
      for (const int frame : legs_[i].body_frames) input.force[i] += observation.link_force(frame, lane);
    }
    if (planner_.parameters().global_up) {
      input.up_B = rotation_from_rpy(observation.base_rpy.vec3(0, lane)).row(2).transpose();
    }
    return input;
  }

  void act_lane(const Observation& observation, int lane, Targets& targets) {
    Lane& own = lanes_[lane];
    GaitInput input = sense(observation, lane);
    input.command = steering_->command(observation, lane);
    if (!own.running) {
      planner_.start(input, own.feet);
      own.running = true;
    } else {
      input.dt = input.t - own.last_time;
    }
    own.last_time = input.t;
    planner_.plan(input, own.feet);
    for (int k = 0; k < na_; ++k) {
      targets.q(k, lane) = initial_[k];
      targets.v(k, lane) = targets.tau(k, lane) = 0;
    }
    for (std::size_t i = 0; i < legs_.size(); ++i) write(own, i, lane, targets);
  }

  void write(Lane& own, std::size_t leg, int lane, Targets& targets) {
    const FootPlan& plan = own.feet[leg];
    const int row = static_cast<int>(3 * leg);
    for (int i = 0; i < 3; ++i) {
      targets.x(row + i, lane) = plan.x[i];
      targets.xd(row + i, lane) = plan.xd[i];
    }
    if (kind_ != TargetKind::joint) return;
    Chain::Values& q = own.guess[leg];
    ik_[leg].solve(plan.x, q);
    const Chain::Values v = ik_[leg].velocity(q, plan.xd);
    for (int j = 0; j < ik_[leg].chain().size(); ++j) {
      const int k = ik_[leg].chain().joints()[j].actuator;
      targets.q(k, lane) = q[j];
      targets.v(k, lane) = v[j];
    }
  }

  TargetKind kind_;
  int na_;
  std::vector<double> initial_;
  GaitPlanner planner_;
  std::vector<Leg> legs_;
  std::unique_ptr<Steering> steering_;
  std::vector<Chain::Values> reference_;
  std::vector<InverseKinematics> ik_;
  std::array<Lane, kLanes> lanes_;
};

const PolicyRegistration registration("gait",
                                      [](const ControlContext& context, const Settings& settings,
                                         TargetKind kind) -> std::unique_ptr<Policy> {
                                        return std::make_unique<Gait>(context, read_gait(context, settings), kind);
                                      });

}  // namespace

}  // namespace graze
