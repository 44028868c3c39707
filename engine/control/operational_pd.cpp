// Tracker `operational_pd`: {kp: N/m, kd: N s/m}. A virtual spring and damper between each effector and its target, in
// the base frame; f = kp (x_des - x) + kd (xd_des - xd), tau = J^T f, with x, xd and J from the nominal kinematics at
// the sensed joint state. As in the published controller there is no gravity or inertia compensation, so that a loaded
// foot stands off its target by f / kp.

#include "engine/control/chain.h"
#include "engine/control/policy.h"

namespace graze {

namespace {

class OperationalPd : public Tracker {
 public:
  OperationalPd(const ControlContext& context, const Settings& settings, const std::vector<int>& effectors) {
    settings.allow({"kp", "kd"});
    kp_ = settings.at("kp").non_negative(Quantity::stiffness);
    kd_ = settings.has("kd") ? settings.at("kd").non_negative(Quantity::damping) : 0.0;
    for (const int frame : effectors) chains_.emplace_back(context.nominal, frame);
  }

  TargetKind kind() const override { return TargetKind::effector; }

  void track(const Observation& observation, const Targets& targets, LaneMask active,
             ActuatorCommand& command) override {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) track_lane(observation, targets, lane, command);
    }
  }

 private:
  void track_lane(const Observation& observation, const Targets& targets, int lane, ActuatorCommand& command) const {
    for (int k = 0; k < command.tau.rows(); ++k) {
      command.tau(k, lane) = targets.tau(k, lane);
      command.kp(k, lane) = command.kd(k, lane) = command.ki(k, lane) = 0;
    }
    Chain::Jacobian J;
    for (std::size_t e = 0; e < chains_.size(); ++e) {
      const Chain& chain = chains_[e];
      Chain::Values q(chain.size()), v(chain.size());
      for (int i = 0; i < chain.size(); ++i) {
        q[i] = observation.joint_position(chain.joints()[i].actuator, lane);
        v[i] = observation.joint_velocity(chain.joints()[i].actuator, lane);
      }
      const int row = static_cast<int>(3 * e);
      const Vec3 x = chain.position(q, J);
      const Vec3 f = kp_ * (targets.x.vec3(row, lane) - x) + kd_ * (targets.xd.vec3(row, lane) - J * v);
      const Chain::Values tau = J.transpose() * f;
      for (int i = 0; i < chain.size(); ++i) command.tau(chain.joints()[i].actuator, lane) += tau[i];
    }
  }

  double kp_ = 0, kd_ = 0;
  std::vector<Chain> chains_;
};

const TrackerRegistration registration("operational_pd", TargetKind::effector,
                                       [](const ControlContext& context, const Settings& settings,
                                          const std::vector<int>& effectors) -> std::unique_ptr<Tracker> {
                                         return std::make_unique<OperationalPd>(context, settings, effectors);
                                       });

}  // namespace

}  // namespace graze
