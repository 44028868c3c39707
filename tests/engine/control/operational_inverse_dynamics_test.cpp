// The tracker `operational_inverse_dynamics`: feet get the accelerations that are asked of them, by either map, and a
// robot that differs from its model trots.

#include <gmock/gmock.h>

#include "engine/control/leg_ik.h"
#include "engine/dynamics/chain.h"
#include "tests/engine/control/inverse_dynamics_support.h"

namespace graze {
namespace {

using ::testing::HasSubstr;

constexpr double kH = 1e-3;

std::string operational(const std::string& gains) { return "operational_inverse_dynamics: {" + gains + "}"; }

/// Of a robot whose base is fixed, trotting in the air: how much feet (m/s) and joints (rad/s) move otherwise after a
/// step than their law says, at most.
struct Missed {
  double feet = 0, joints = 0;
};

/// What the law with gains kp and kd makes of one leg in lane 0.
void check_leg(const LaneLoop& loop, const Chain& chain, int foot, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
               double kp, double kd, Missed& missed) {
  const ChainView& view = chain.view();
  double at[3], slow[3], fast[3];
  for (int i = 0; i < 3; ++i) {
    const int k = view.joint[i].actuator;
    at[i] = q[k], slow[i] = v[k];
    fast[i] = (loop.state().q(k, 0) - q[k]) / kH;  // joints move at the velocity of the solve
  }
  Vec3T<double> J[3];
  const Vec3T<double> x = chain_jacobian<double, 3>(view, at, J);
  const Targets& targets = loop.controller().targets_in_force();
  const auto of = [&](const BlockArray& rows) {
    return Vec3T<double>{rows(3 * foot, 0), rows(3 * foot + 1, 0), rows(3 * foot + 2, 0)};
  };
  Vec3T<double> before{0, 0, 0}, after{0, 0, 0};
  for (int i = 0; i < 3; ++i) before = axpy(slow[i], J[i], before), after = axpy(fast[i], J[i], after);
  const Vec3T<double> a = axpy(kp, of(targets.x) - x, kd * (of(targets.xd) - before));
  const Vec3T<double> off = after - before - kH * a;
  missed.feet = std::max(missed.feet, std::sqrt(dot(off, off)));
  for (int i = 0; i < 3; ++i) missed.joints = std::max(missed.joints, std::abs(fast[i] - slow[i] - kH * dot(J[i], a)));
}

Missed missed_in_the_air(const std::string& control, double kp, double kd) {
  World world = strong_links();
  world.robot.floating_base = false;
  world.objects.clear();  // its feet would stand on the ground
  const Scene scene(world);
  LaneLoop loop(scene, trot(control));
  loop.start(0, scene.particle());
  std::vector<Chain> chains;
  for (const int frame : loop.controller().policy().effectors()) chains.emplace_back(scene.model, frame);
  Missed out;
  for (int step = 0; step < 400; ++step) {
    const Eigen::VectorXd q = loop.state().q.column(0), v = loop.state().v.column(0);
    loop.advance();
    for (std::size_t foot = 0; foot < chains.size(); ++foot) {
      check_leg(loop, chains[foot], static_cast<int>(foot), q, v, kp, kd, out);
    }
  }
  return out;
}

// With `inverse` the foot's velocity after a step is J v + h (kp (x_des - x) + kd (xd_des - J v)), but for the damping
// of least squares; with `transposed` joints get J^T times that acceleration.
TEST(OperationalInverseDynamics, AcceleratesAsAsked) {
  const Missed inverse = missed_in_the_air(operational("kp: 2e3, kd: 50, horizon: 1 ms, model: none"), 2e3, 50);
  EXPECT_LT(inverse.feet, 2e-4) << "m/s, of changes by up to 0.1";
  const Missed transposed =
      missed_in_the_air(operational("kp: 1e5, kd: 1e3, horizon: 1 ms, model: none, map: transposed"), 1e5, 1e3);
  EXPECT_LT(transposed.joints, 1e-7);
  EXPECT_GT(transposed.feet, 1e-3) << "the two maps are two laws";
}

/// How far particles of other masses, friction and feet trot in 1.5 s, m; those that fell or failed: 0.
std::vector<double> ways(const std::string& control) {
  const Scene nominal(links_world());
  LaneLoop loop(nominal, trot(control));
  const std::pair<double, double> robots[] = {{1.0, 1.0}, {1.2, 0.6}, {0.8, 1.2}, {1.1, 0.8}};
  for (int lane = 0; lane < 4; ++lane) {
    loop.start(lane, other_robot(robots[lane].first, robots[lane].second, lane));
  }
  for (int step = 0; step < 1500; ++step) loop.advance();
  std::vector<double> out;
  for (int lane = 0; lane < 4; ++lane) {
    const bool stands = !loop.physics().fault(lane) && loop.state().rotation(0, lane)(2, 2) > 0.8;
    out.push_back(stands ? loop.state().q(4, lane) : 0.0);
  }
  return out;
}

// The gait is commanded 0.2 m/s, so 0.3 m in all; with a spring beside it as with accelerations alone.
TEST(OperationalInverseDynamics, TrotsThoughTheRobotIsAnother) {
  const std::string alone = "kp: 5e3, kd: 100, contacts: {within: 1 cm}";
  for (const std::string& gains : {alone, alone + ", servo: {kp: 300, kd: 6}"}) {
    for (const double way : ways(operational(gains))) EXPECT_GT(way, 0.15) << gains;
  }
}

TEST(OperationalInverseDynamics, RefusesWhatItCannotDo) {
  const Scene scene(links_world());
  const auto error = [&](const std::string& policy) {
    return input_error([&] { Controller(scene.context(), Settings::parse(policy, "policy.yaml")); });
  };
  EXPECT_THAT(error(trot(operational("kp: 1, map: invers"))), HasSubstr("did you mean 'inverse'?"));
  EXPECT_THAT(error(trot(operational("kp: -1"))), HasSubstr("-1"));
  EXPECT_THAT(error(trot(operational("kp: 1, servo: {kd: 1}"))), HasSubstr("kp"));
  EXPECT_THAT(error(trot(operational("kd: 1"))), HasSubstr("kp"));
  EXPECT_THAT(error(hold(operational("kp: 1"))), HasSubstr("hold"));
}

}  // namespace
}  // namespace graze
