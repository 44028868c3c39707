// The gait planner without a robot: timing, swing path, prediction, modes.

#include <random>

#include "engine/control/gait_planner.h"
#include "engine/control/gait_settings.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

// Table 1: liftoff {25, 75, 0, 50} % with a duty of 75 %: each foot swings for the quarter that follows its liftoff,
// one foot at a time, in the order LH LF RH RF.
TEST(GaitTiming, WalkSwingsOneFootAtATime) {
  const GaitTiming walk({0.25 - 0.75, 0.75 - 0.75, 0.0 - 0.75, 0.5 - 0.75}, {0.75, 0.75, 0.75, 0.75}, 0.3);
  const int order[] = {2, 0, 3, 1};
  for (int quarter = 0; quarter < 4; ++quarter) {
    for (const double within : {0.0, 0.01, 0.5, 0.99}) {
      const double phase = (quarter + within) / 4;
      for (int foot = 0; foot < 4; ++foot) EXPECT_EQ(walk.in_stance(foot, phase), foot != order[quarter]) << phase;
      EXPECT_NEAR(walk.until_touchdown(order[quarter], phase), (1 - within) * 0.075, 1e-9);
    }
  }
  EXPECT_TRUE(walk.flights().empty());
  EXPECT_EQ(walk.hop_velocity(0.3, 9.81), 0);
  EXPECT_NEAR(walk.phase(0.3 * 7 + 0.1), 1.0 / 3, 1e-12);
}

// Figure 69's walking trot: touchdown {50, 0, 0, 50} %, duty 60 % and liftoff {10, 60, 60, 10} % are the same gait.
TEST(GaitTiming, LiftoffAndTouchdownAreTheSameGait) {
  const GaitTiming a({0.5, 0.0, 0.0, 0.5}, {0.6, 0.6, 0.6, 0.6}, 1.0);
  const GaitTiming b({0.1 - 0.6, 0.6 - 0.6, 0.6 - 0.6, 0.1 - 0.6}, {0.6, 0.6, 0.6, 0.6}, 1.0);
  for (int i = 0; i < 1000; ++i) {
    for (int foot = 0; foot < 4; ++foot) EXPECT_EQ(a.in_stance(foot, i * 1e-3), b.in_stance(foot, i * 1e-3)) << i;
  }
}

// A trot with duty 30 % has two flights of 20 % per cycle. Thrown up at takeoff with g T/2 the base falls back to the
// height of takeoff when the flight ends, with -g T/2; over the whole cycle it rises as much as it sinks.
TEST(GaitTiming, FlightsAreBallistic) {
  const GaitTiming run({0.0, 0.5, 0.5, 0.0}, {0.3, 0.3, 0.3, 0.3}, 0.4);
  ASSERT_EQ(run.flights().size(), 2u);
  EXPECT_NEAR(run.flights()[0].takeoff, 0.3, 1e-6);
  EXPECT_NEAR(run.flights()[0].duration, 0.2 * 0.4, 1e-6);
  EXPECT_NEAR(run.flights()[0].stance, 0.3 * 0.4, 1e-6);
  const double g = 9.81, T = 0.08;
  EXPECT_NEAR(run.hop_velocity(0.3, g), g * T / 2, 1e-6);
  EXPECT_NEAR(run.hop_velocity(0.4, g), 0, 1e-6);
  EXPECT_NEAR(run.hop_velocity(0.15, g), 0, 1e-6);
  EXPECT_NEAR(run.hop_velocity(0.0, g), -g * T / 2, 1e-6);
  double height = 0;
  for (int i = 0; i < 4000; ++i) height += run.hop_velocity((i + 0.5) / 4000, g) * 0.4 / 4000;
  EXPECT_NEAR(height, 0, 1e-7);
}

// The path meets its knots and end velocities, and position, velocity and acceleration are continuous at inner knots.
TEST(SwingSpline, InterpolatesWithContinuousAcceleration) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto random = [&] { return Vec3(u(generator), u(generator), u(generator)); };
  for (int n = 0; n < 50; ++n) {
    const std::array<Vec3, 4> knots = {random(), random(), random(), random()};
    const Vec3 v0 = random(), v3 = random();
    const double t0 = 2, T = 0.6, eps = 1e-6;
    const SwingSpline path(knots, v0, v3, t0, T);
    for (int k = 0; k < 4; ++k) EXPECT_LT((path.at(t0 + k * T / 3).x - knots[k]).norm(), 1e-12);
    EXPECT_LT((path.at(t0).xd - v0).norm(), 1e-12);
    EXPECT_LT((path.at(t0 + T).xd - v3).norm(), 1e-12);
    for (const double knot : {t0 + T / 3, t0 + 2 * T / 3}) {
      EXPECT_LT((path.at(knot - 1e-12).xd - path.at(knot + 1e-12).xd).norm(), 1e-8);
      const Vec3 before = (path.at(knot).xd - path.at(knot - eps).xd) / eps;
      const Vec3 after = (path.at(knot + eps).xd - path.at(knot).xd) / eps;
      // One-sided differences of a cubic err by eps/2 times the third derivative: at most 6 (4 + 4 + ...) / h^3 ~ 1e4.
      EXPECT_LT((before - after).norm(), 1e4 * eps);
    }
    const double t = t0 + 0.37 * T;
    EXPECT_LT(((path.at(t + eps).x - path.at(t - eps).x) / (2 * eps) - path.at(t).xd).norm(), 1e-7);
  }
}

// Figure 71: the via points lie one step height above both ends, the second moved on by overshoot times the step.
TEST(SwingSpline, KnotsOfFigure71) {
  const Vec3 a(0.1, 0.05, -0.15), b(0.2, 0.04, -0.15), up(0, 0, 0.04);
  const auto plain = swing_knots(a, b, up, 0);
  EXPECT_EQ(plain[0], a);
  EXPECT_EQ(plain[3], b);
  EXPECT_LT((plain[1] - (a + up)).norm() + (plain[2] - (b + up)).norm(), 1e-15);
  const auto over = swing_knots(a, Vec3(b + Vec3(0, 0, 0.02)), up, 0.5);
  EXPECT_LT((over[2] - (b + Vec3(0, 0, 0.02) + up + 0.5 * (b - a))).norm(), 1e-15);  // horizontal part only
}

// The predicted base pose is the exact arc: a fine Euler integration of the planar motion ends there.
TEST(BaseCommand, PredictionIsTheArc) {
  for (const double turn : {0.0, 1e-9, -0.5, 3.0}) {
    BaseCommand command;
    command.v = {0.2, -0.1, 0};
    command.w.z() = turn;
    const double T = 0.7;
    const int n = 200000;
    double x = 0, y = 0, yaw = 0;
    for (int i = 0; i < n; ++i) {
      const double middle = yaw + turn * T / n / 2;
      x += (0.2 * std::cos(middle) + 0.1 * std::sin(middle)) * T / n;
      y += (0.2 * std::sin(middle) - 0.1 * std::cos(middle)) * T / n;
      yaw += turn * T / n;
    }
    const PlanarPose pose = predict(command, T);
    EXPECT_NEAR(pose.x, x, 1e-10);
    EXPECT_NEAR(pose.y, y, 1e-10);
    EXPECT_NEAR(pose.yaw, yaw, 1e-10);
  }
}

GaitParameters walk_parameters() {
  GaitParameters p;
  p.timing = GaitTiming({-0.5, 0, -0.75, -0.25}, {0.75, 0.75, 0.75, 0.75}, 0.4);
  p.step_height = 0.03;
  const double x[] = {0.12, 0.12, -0.12, -0.12}, y[] = {0.08, -0.08, 0.08, -0.08};
  for (int i = 0; i < 4; ++i) {
    p.origin[i] = {x[i], y[i], -0.15};
    p.hip[i] = {x[i], y[i] / 2, -0.03};
    p.reach[i] = 0.17;
  }
  return p;
}

/// A planner whose feet are where it wants them, on a flat floor that carries all that do not swing.
struct Puppet {
  GaitPlanner planner;
  std::vector<FootPlan> feet = std::vector<FootPlan>(4);
  GaitInput input;
  std::array<bool, 4> carries = {true, true, true, true};
  explicit Puppet(const GaitParameters& p) : planner(p) {
    for (int i = 0; i < 4; ++i) input.x[i] = p.origin[i];
    planner.start(input, feet);
  }
  void step_to(double t) {
    input.dt = t - input.t;
    input.t = t;
    for (int i = 0; i < 4; ++i) {
      input.x[i] = feet[i].x;
      input.force[i] = carries[i] ? 5.0 : 0.0;
    }
    planner.plan(input, feet);
  }
};

// A foot that touches down at the planned place and is driven by the stance velocity stands on one spot of the world
// while the base moves on its arc, and its hip's origin passes over it at mid-stance (§9.2.5).
TEST(GaitPlanner, StanceFootStandsStillInTheWorld) {
  Puppet puppet(walk_parameters());
  puppet.input.command.v = {0.2, 0.05, 0};
  puppet.input.command.w.z() = -0.5;
  std::array<Vec3, 4> spot{};
  std::array<double, 4> since{};
  std::array<FootMode, 4> last{};
  const auto world = [&](double t, const Vec3& x) { return predict(puppet.input.command, t).transform(x); };
  for (int k = 1; k <= 1600; ++k) {
    const double t = k * 1e-3;
    puppet.step_to(t);
    for (int i = 0; i < 4; ++i) {
      const FootPlan& foot = puppet.feet[i];
      if (foot.mode == FootMode::stance && last[i] == FootMode::swing) {
        spot[i] = world(t, foot.x);
        since[i] = t;
      }
      if (foot.mode == FootMode::stance && since[i] > 0) {
        // Explicit Euler steps of 1 ms on a circle of at most 0.3 m at 0.5 rad/s over 0.3 s err by less than
        // h/2 |x''| T = 0.5e-3 * (0.3 * 0.25 + 0.2 * 0.5) * 0.3 = 3e-5 m.
        EXPECT_LT((world(t, foot.x) - spot[i]).norm(), 5e-5) << t;
        if (std::abs(t - since[i] - 0.15) < 5e-4) {
          EXPECT_LT((foot.x - puppet.planner.parameters().origin[i]).norm(),
                    5e-4);  // 0.2 m/s times 1 ms, and the above
        }
      }
      last[i] = foot.mode;
    }
  }
  for (int i = 0; i < 4; ++i) EXPECT_GT(since[i], 0);
}

// A foot that finds no ground at touchdown reaches down at the speed of the command (Algorithm 7, line 15), and the
// next foot waits in support until it stands.
TEST(GaitPlanner, ReachAndSupport) {
  Puppet puppet(walk_parameters());
  puppet.input.command.v = {0.2, 0, 0};
  puppet.carries[2] = false;  // LH lifts at 0 and should land at 0.1, when LF should lift
  double t = 0;
  while (t < 0.120) puppet.step_to(t += 1e-3);
  EXPECT_EQ(puppet.feet[2].mode, FootMode::reach);
  EXPECT_EQ(puppet.feet[0].mode, FootMode::support);
  EXPECT_NEAR(puppet.feet[2].xd.z(), -0.2, 1e-12);
  EXPECT_NEAR(puppet.feet[2].x.z(), -0.15 - 0.2 * 0.020, 0.2 * 1.5e-3);
  puppet.carries[2] = true;
  puppet.step_to(t += 1e-3);
  EXPECT_EQ(puppet.feet[2].mode, FootMode::stance);
  EXPECT_EQ(puppet.feet[0].mode, FootMode::swing);
  EXPECT_NEAR(puppet.feet[0].path.duration(), 0.2 - t, 1e-9);  // the swing is shortened by the wait (line 28)
}

// In support, a foot beyond its reach swings although another still searches for ground (line 22).
TEST(GaitPlanner, OverreachForcesASwing) {
  Puppet puppet(walk_parameters());
  puppet.input.command.v = {0.2, 0, 0};
  puppet.carries[2] = false;
  double t = 0;
  while (t < 0.110) puppet.step_to(t += 1e-3);
  ASSERT_EQ(puppet.feet[0].mode, FootMode::support);
  puppet.feet[0].x = puppet.planner.parameters().hip[0] - 0.18 * Vec3::UnitZ();
  puppet.step_to(t += 1e-3);
  EXPECT_EQ(puppet.feet[0].mode, FootMode::swing);
}

// Without recovery modes timing alone decides.
TEST(GaitPlanner, WithoutRecoveryTimingDecides) {
  GaitParameters p = walk_parameters();
  p.recovery = false;
  Puppet puppet(p);
  puppet.carries = {false, false, false, false};
  for (double t = 1e-3; t < 0.8; t += 1e-3) {
    puppet.step_to(t);
    for (int i = 0; i < 4; ++i) {
      const bool stance = p.timing.in_stance(i, p.timing.phase(t));
      EXPECT_EQ(puppet.feet[i].mode, stance ? FootMode::stance : FootMode::swing);
    }
  }
}

// A new command moves the goal of a foot in the first part of its swing and not in the last (redirect).
TEST(GaitPlanner, RedirectsEarlySwings) {
  for (const auto& [moment, redirected] : {std::pair{0.05, true}, std::pair{0.09, false}}) {
    Puppet puppet(walk_parameters());
    puppet.input.command.v = {0.1, 0, 0};
    double t = 0;
    while (t < moment) puppet.step_to(t += 1e-3);
    ASSERT_EQ(puppet.feet[2].mode, FootMode::swing);
    puppet.input.command.v = {0.2, 0, 0};
    puppet.step_to(t += 1e-3);
    const Vec3 goal = puppet.feet[2].path.at(1.0).x;
    const double shift = 0.1 * 0.15;  // 0.1 m/s more for half a stance of 0.3 s
    const double from = puppet.planner.parameters().origin[2].x() + shift;
    EXPECT_NEAR(goal.x(), redirected ? from + shift : from, 1e-12);
  }
}

// Settling: all feet stand and move the base smoothly to its commanded height; then the gait's clock begins.
TEST(GaitPlanner, SettlesToTheCommandedHeight) {
  GaitParameters p = walk_parameters();
  p.settle = 0.5;
  GaitInput input;
  std::vector<FootPlan> feet(4);
  for (int i = 0; i < 4; ++i) input.x[i] = p.origin[i] + Vec3(0.01, 0.02, -0.02);
  const GaitPlanner planner(p);
  planner.start(input, feet);
  const auto at = [&](double t) {
    input.t = t;
    planner.plan(input, feet);
    return feet[2];
  };
  const Vec3 begin = input.x[2];
  EXPECT_LT((at(0).x - begin).norm() + at(0).xd.norm(), 1e-12);
  EXPECT_LT((at(0.125).x - begin - Vec3(0, 0, 0.02 * 0.15625)).norm(), 1e-12);  // 3 s^2 - 2 s^3 at a quarter
  EXPECT_NEAR(at(0.25).xd.z(), 0.02 * 1.5 / 0.5, 1e-12);
  EXPECT_EQ(at(0.499).mode, FootMode::stance);
  EXPECT_NEAR(feet[2].x.z(), -0.15, 1e-6);
  EXPECT_EQ(at(0.5).mode, FootMode::swing);  // LH lifts at 0 % of the gait
}

// The foot lifts along the world's vertical when asked to, as sensed through the base's attitude.
TEST(GaitPlanner, GlobalUp) {
  GaitParameters p = walk_parameters();
  p.global_up = true;
  Puppet puppet(p);
  puppet.input.up_B = Vec3(0.1, 0, 1).normalized();
  puppet.step_to(1e-3);
  ASSERT_EQ(puppet.feet[2].mode, FootMode::swing);
  const Vec3 start = puppet.feet[2].path.start();
  const double third = puppet.feet[2].path.duration() / 3;
  EXPECT_LT((puppet.feet[2].path.at(1e-3 + third).x - start - 0.03 * puppet.input.up_B).norm(), 1e-12);
}

}  // namespace
}  // namespace graze
