// Tracker `operational_pd`: {kp: N/m, kd: N s/m, implicit: true}. A virtual spring and damper between each effector and
// its target, in the base frame; f = kp (x_des - x) + kd (xd_des - xd), tau = J^T f, with x, xd and J from the nominal
// kinematics at the sensed joint state. As in the published controller there is no gravity or inertia compensation, so
// that a loaded foot stands off its target by f / kp.
//
// A damper that is held over a control period h overshoots standstill when kd h exceeds the inertia m that the effector
// shows, and is unstable beyond 2 m. LINKS' shins of 31 g show 11 g across the shin, and kd = 20 N s/m at h = 1 ms is
// 20 g. `implicit` evaluates the damper at the velocity that it leads to, v + h M^-1 J^T f, with the nominal leg's M:
// kd becomes (1/kd + h J M^-1 J^T)^-1, which tends to kd as h tends to 0. `implicit: false` is the published law.

#include "engine/control/chain.h"
#include "engine/control/policy.h"

namespace graze {

namespace {

class OperationalPd : public Tracker {
 public:
  OperationalPd(const ControlContext& context, const Settings& settings, const std::vector<int>& effectors) {
    settings.allow({"kp", "kd", "implicit"});
    kp_ = settings.at("kp").non_negative(Quantity::stiffness);
    kd_ = settings.has("kd") ? settings.at("kd").non_negative(Quantity::damping) : 0.0;
    if (settings.flag_or("implicit", true)) period_ = context.period;
    for (const int frame : effectors) chains_.emplace_back(context.nominal, frame);
  }

  TargetKind kind() const override { return TargetKind::effector; }
  unsigned reads() const override { return kJointPosition | kJointVelocity; }

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
      const Vec3 f =
          kp_ * (targets.x.vec3(row, lane) - x) + damping(chain, q, J) * (targets.xd.vec3(row, lane) - J * v);
      const Chain::Values tau = J.transpose() * f;
      for (int i = 0; i < chain.size(); ++i) command.tau(chain.joints()[i].actuator, lane) += tau[i];
    }
  }

  /// kd, or, integrated implicitly over the control period, (1/kd + h J M^-1 J^T)^-1.
  Mat3 damping(const Chain& chain, const Chain::Values& q, const Chain::Jacobian& J) const {
    if (period_ == 0 || kd_ == 0) return kd_ * Mat3::Identity();
    const Chain::Jacobian MinvJt = chain.inertia(q).ldlt().solve(J.transpose()).transpose();
    const Mat3 mobility = J * MinvJt.transpose();  // inverse of the inertia that the effector shows, 1/kg
    return (Mat3::Identity() / kd_ + period_ * mobility).inverse();
  }

  double kp_ = 0, kd_ = 0;
  double period_ = 0;  // s; 0: explicit
  std::vector<Chain> chains_;
};

const TrackerRegistration registration("operational_pd", TargetKind::effector,
                                       [](const ControlContext& context, const Settings& settings,
                                          const std::vector<int>& effectors) -> std::unique_ptr<Tracker> {
                                         return std::make_unique<OperationalPd>(context, settings, effectors);
                                       });

}  // namespace

}  // namespace graze
