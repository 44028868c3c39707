// Tracker `operational_pd`: a virtual spring and damper between each effector and
// its target, in the base frame; f = kp (x_des - x) + kd (xd_des - xd), tau = J^T f, with x, xd and J from the nominal
// kinematics at the sensed joint state. As in the published controller there is no gravity or inertia compensation, so
// that a loaded foot stands off its target by f / kp.
//
// A damper that is held over a control period h overshoots standstill when kd h exceeds the inertia m that the effector
// shows, and is unstable beyond 2 m. LINKS' shins of 31 g show 11 g across the shin, and kd = 20 N s/m at h = 1 ms is
// 20 g. `implicit` evaluates the damper at the velocity that it leads to, v + h M^-1 J^T f, with the nominal leg's M:
// kd becomes (1/kd + h J M^-1 J^T)^-1, which tends to kd as h tends to 0. `implicit: false` is the published law.

#include "engine/control/kernel.h"
#include "engine/control/lane_chain.h"
#include "engine/control/policy.h"
#include "engine/dynamics/chain.h"
#include "engine/lanes/isa.h"

namespace graze {

namespace {

const Description& operational_pd_description() {
  static const Description text = {
      "pulls each foot to its target by a spring and a damper in space; torques by the leg's transposed Jacobian",
      {{"kp", {Form::number(Quantity::stiffness, Bound::not_negative)}, Default::required(), "spring"},
       {"kd", {Form::number(Quantity::damping, Bound::not_negative)}, Default::value("0 N s/m"), "damper"},
       {"implicit",
        {Form::flag()},
        Default::value("true"),
        "damps by the velocity that follows; `false`: by the present one, as published"}},
      {},
      {},
      "f = kp (x_des − x) + kd (ẋ_des − ẋ) in the base frame, τ = Jᵀ f."};
  return text;
}

class OperationalPd : public Tracker {
 public:
  OperationalPd(const ControlContext& context, const Described& own, const std::vector<int>& effectors)
      : kernel_(GRAZE_KERNEL(chosen_isa(), find_control_kernel)) {
    view_.kp = own.number("kp");
    view_.kd = own.number("kd");
    view_.period = own.flag("implicit") ? context.period : 0.0;
    view_.na = context.nominal.na();
    for (const int frame : effectors) chains_.emplace_back(context.nominal, frame);
    for (const Chain& chain : chains_) views_.push_back(chain.view());
    view_.effectors = static_cast<int>(views_.size());
    view_.chains = views_.data();
  }

  TargetKind kind() const override { return TargetKind::effector; }

  bool know(int lane, const Tracker& other) override {
    const auto* const robot = dynamic_cast<const OperationalPd*>(&other);
    if (robot == nullptr || robot->views_.size() != views_.size()) return false;
    if (lane_chains_.empty()) begin_each();
    for (std::size_t e = 0; e < views_.size(); ++e) {
      if (!lane_chains_[e].fits(robot->views_[e])) return false;
    }
    put(lane, robot->views_);
    return true;
  }
  unsigned reads() const override { return kJointPosition | kJointVelocity; }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    const OperationalPdCall call{active.bits(),
                                 observation.joint_position.row(0),
                                 observation.joint_velocity.row(0),
                                 targets.tau.row(0),
                                 targets.x.row(0),
                                 targets.xd.row(0),
                                 command.tau.row(0),
                                 command.kp.row(0),
                                 command.kd.row(0),
                                 command.ki.row(0)};
    lane_chains_.empty() ? kernel_.operational_pd(view_, call) : kernel_.operational_pd_of_each(each_, call);
  }

 private:
  /// From now on each lane has numbers of its own; first those of the nominal robot.
  void begin_each() {
    for (const ChainView& chain : views_) lane_chains_.emplace_back(chain);
    lane_views_.resize(views_.size());
    each_ = {view_.effectors, lane_views_.data(), view_.kp, view_.kd, view_.period, view_.na};
    for (int lane = 0; lane < kLanes; ++lane) put(lane, views_);
  }

  void put(int lane, const std::vector<ChainView>& chains) {
    for (std::size_t e = 0; e < chains.size(); ++e) {
      lane_chains_[e].put(lane, chains[e]);
      lane_views_[e] = lane_chains_[e].view();
    }
  }

  const ControlKernel& kernel_;
  std::vector<Chain> chains_;
  std::vector<ChainView> views_;
  OperationalPdOf<double> view_{};
  // If lanes know robots of their own.
  std::vector<LaneChain> lane_chains_;
  std::vector<ChainOf<LaneNumber>> lane_views_;
  OperationalPdOf<LaneNumber> each_{};
};

const TrackerRegistration operational_pd_registration(
    "operational_pd", operational_pd_description(), TargetKind::effector,
    [](const ControlContext& context, const Described& own, const std::vector<int>& effectors)
        -> std::unique_ptr<Tracker> { return std::make_unique<OperationalPd>(context, own, effectors); });

}  // namespace

}  // namespace graze
