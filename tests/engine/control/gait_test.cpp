// The gait planner without a robot: timing, swing path, prediction, modes.

#include <random>

#include "engine/control/gait_planner.h"
#include "engine/control/gait_timing.h"
#include "tests/engine/control/support.h"

namespace graze {
namespace {

using Vector = Vec3T<double>;

Vec3 eigen(const Vector& a) { return {a.x, a.y, a.z}; }
Vector lane(const Vec3& a) { return {a.x(), a.y(), a.z()}; }

using Fractions = std::vector<double>;

// Table 1: liftoff {25, 75, 0, 50} % with a duty of 75 %: each foot swings for the quarter that follows its liftoff,
// one foot at a time, in the order LH LF RH RF.
TEST(GaitTiming, WalkSwingsOneFootAtATime) {
  const GaitTiming walk =
      make_timing(Fractions{0.25 - 0.75, 0.75 - 0.75, 0.0 - 0.75, 0.5 - 0.75}, Fractions(4, 0.75), 0.3);
  const int order[] = {2, 0, 3, 1};
  for (int quarter = 0; quarter < 4; ++quarter) {
    for (const double within : {0.0, 0.01, 0.5, 0.99}) {
      const double phase = (quarter + within) / 4;
      for (int foot = 0; foot < 4; ++foot) EXPECT_EQ(in_stance(walk, foot, phase), foot != order[quarter]) << phase;
      EXPECT_NEAR(until_touchdown(walk, order[quarter], phase), (1 - within) * 0.075, 1e-9);
    }
  }
  EXPECT_EQ(walk.flight_count, 0);
  EXPECT_EQ(hop_velocity(walk, 0.3, 9.81), 0);
  EXPECT_NEAR(phase_at(walk, 0.3 * 7 + 0.1), 1.0 / 3, 1e-12);
}

// Figure 69's walking trot: touchdown {50, 0, 0, 50} %, duty 60 % and liftoff {10, 60, 60, 10} % are the same gait.
TEST(GaitTiming, LiftoffAndTouchdownAreTheSameGait) {
  const GaitTiming a = make_timing(Fractions{0.5, 0.0, 0.0, 0.5}, Fractions(4, 0.6), 1.0);
  const GaitTiming b = make_timing(Fractions{0.1 - 0.6, 0.6 - 0.6, 0.6 - 0.6, 0.1 - 0.6}, Fractions(4, 0.6), 1.0);
  for (int i = 0; i < 1000; ++i) {
    for (int foot = 0; foot < 4; ++foot) EXPECT_EQ(in_stance(a, foot, i * 1e-3), in_stance(b, foot, i * 1e-3)) << i;
  }
}

// A trot with duty 30 % has two flights of 20 % per cycle. Thrown up at takeoff with g T/2 the base falls back to the
// height of takeoff when the flight ends, with -g T/2; over the whole cycle it rises as much as it sinks.
TEST(GaitTiming, FlightsAreBallistic) {
  const GaitTiming run = make_timing(Fractions{0.0, 0.5, 0.5, 0.0}, Fractions(4, 0.3), 0.4);
  ASSERT_EQ(run.flight_count, 2);
  EXPECT_NEAR(run.flights[0].takeoff, 0.3, 1e-6);
  EXPECT_NEAR(run.flights[0].duration, 0.2 * 0.4, 1e-6);
  EXPECT_NEAR(run.flights[0].stance, 0.3 * 0.4, 1e-6);
  const double g = 9.81, T = 0.08;
  EXPECT_NEAR(hop_velocity(run, 0.3, g), g * T / 2, 1e-6);
  EXPECT_NEAR(hop_velocity(run, 0.4, g), 0, 1e-6);
  EXPECT_NEAR(hop_velocity(run, 0.15, g), 0, 1e-6);
  EXPECT_NEAR(hop_velocity(run, 0.0, g), -g * T / 2, 1e-6);
  double height = 0;
  for (int i = 0; i < 4000; ++i) height += hop_velocity(run, (i + 0.5) / 4000, g) * 0.4 / 4000;
  EXPECT_NEAR(height, 0, 1e-7);
}

struct Sample {
  Vec3 x, xd;
};
Sample at(const SwingPath<double>& path, double t) {
  Vector x, xd;
  sample(path, t, x, xd);
  return {eigen(x), eigen(xd)};
}

// The path meets its knots and end velocities, and position, velocity and acceleration are continuous at inner knots.
TEST(SwingSpline, InterpolatesWithContinuousAcceleration) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto random = [&] { return Vec3(u(generator), u(generator), u(generator)); };
  for (int n = 0; n < 50; ++n) {
    const Vec3 knots[4] = {random(), random(), random(), random()};
    const Vector knot[4] = {lane(knots[0]), lane(knots[1]), lane(knots[2]), lane(knots[3])};
    const Vec3 v0 = random(), v3 = random();
    const double t0 = 2, T = 0.6, eps = 1e-6;
    const SwingPath<double> path = path_through(knot, lane(v0), lane(v3), t0, T);
    for (int k = 0; k < 4; ++k) EXPECT_LT((at(path, t0 + k * T / 3).x - knots[k]).norm(), 1e-12);
    EXPECT_LT((at(path, t0).xd - v0).norm(), 1e-12);
    EXPECT_LT((at(path, t0 + T).xd - v3).norm(), 1e-12);
    for (const double knot : {t0 + T / 3, t0 + 2 * T / 3}) {
      EXPECT_LT((at(path, knot - 1e-12).xd - at(path, knot + 1e-12).xd).norm(), 1e-8);
      const Vec3 before = (at(path, knot).xd - at(path, knot - eps).xd) / eps;
      const Vec3 after = (at(path, knot + eps).xd - at(path, knot).xd) / eps;
      // One-sided differences of a cubic err by eps/2 times the third derivative: at most 6 (4 + 4 + ...) / h^3 ~ 1e4.
      EXPECT_LT((before - after).norm(), 1e4 * eps);
    }
    const double t = t0 + 0.37 * T;
    EXPECT_LT(((at(path, t + eps).x - at(path, t - eps).x) / (2 * eps) - at(path, t).xd).norm(), 1e-7);
  }
}

// Figure 71: the via points lie one step height above both ends, the second moved on by overshoot times the step.
TEST(SwingSpline, KnotsOfFigure71) {
  const Vec3 a(0.1, 0.05, -0.15), b(0.2, 0.04, -0.15), up(0, 0, 0.04);
  Vector knot[4];
  swing_knots(lane(a), lane(b), lane(up), 0, knot);
  EXPECT_EQ(eigen(knot[0]), a);
  EXPECT_EQ(eigen(knot[3]), b);
  EXPECT_LT((eigen(knot[1]) - (a + up)).norm() + (eigen(knot[2]) - (b + up)).norm(), 1e-15);
  swing_knots(lane(a), lane(b + Vec3(0, 0, 0.02)), lane(up), 0.5, knot);
  EXPECT_LT((eigen(knot[2]) - (b + Vec3(0, 0, 0.02) + up + 0.5 * (b - a))).norm(), 1e-15);  // horizontal part only
}

// The predicted base pose is the exact arc: a fine Euler integration of the planar motion ends there.
TEST(BaseCommand, PredictionIsTheArc) {
  for (const double turn : {0.0, 1e-9, -0.5, 3.0}) {
    const BaseCommandT<double> command{{0.2, -0.1, 0}, {0, 0, turn}};
    const double T = 0.7;
    const int n = 200000;
    double x = 0, y = 0, yaw = 0;
    for (int i = 0; i < n; ++i) {
      const double middle = yaw + turn * T / n / 2;
      x += (0.2 * std::cos(middle) + 0.1 * std::sin(middle)) * T / n;
      y += (0.2 * std::sin(middle) - 0.1 * std::cos(middle)) * T / n;
      yaw += turn * T / n;
    }
    const PlanarPoseT<double> pose = predict(command, T);
    EXPECT_NEAR(pose.x, x, 1e-10);
    EXPECT_NEAR(pose.y, y, 1e-10);
    EXPECT_NEAR(pose.yaw, yaw, 1e-10);
  }
}

GaitParameters walk_parameters() {
  GaitParameters p;
  p.timing = make_timing(Fractions{-0.5, 0, -0.75, -0.25}, Fractions(4, 0.75), 0.4);
  p.step_height = 0.03;
  const double x[] = {0.12, 0.12, -0.12, -0.12}, y[] = {0.08, -0.08, 0.08, -0.08};
  for (int i = 0; i < 4; ++i) {
    Vec3::Map(p.origin[i]) = Vec3(x[i], y[i], -0.15);
    Vec3::Map(p.hip[i]) = Vec3(x[i], y[i] / 2, -0.03);
    p.reach[i] = 0.17;
  }
  return p;
}

/// A planner whose feet are where it wants them, on a flat floor that carries all that do not swing.
struct Puppet {
  GaitParameters p;
  FootPlan<double> feet[4] = {};
  GaitSenses<double> input{};
  std::array<bool, 4> carries = {true, true, true, true};
  explicit Puppet(const GaitParameters& parameters) : p(parameters) {
    for (int i = 0; i < 4; ++i) input.x[i] = constant_vec3<double>(p.origin[i]);
    start_feet(p, input, 1, feet);
  }
  void step_to(double t) {
    input.dt = t - input.t;
    input.t = t;
    for (int i = 0; i < 4; ++i) {
      input.x[i] = feet[i].x;
      input.force[i] = carries[i] ? 5.0 : 0.0;
    }
    plan(p, input, 1u, feet);
  }
  bool stands(int i) const { return !(feet[i].swing | feet[i].reach | feet[i].support); }
};

// A foot that touches down at the planned place and is driven by the stance velocity stands on one spot of the world
// while the base moves on its arc, and its hip's origin passes over it at mid-stance (§9.2.5).
TEST(GaitPlanner, StanceFootStandsStillInTheWorld) {
  Puppet puppet(walk_parameters());
  puppet.input.command.v = {0.2, 0.05, 0};
  puppet.input.command.w.z = -0.5;
  std::array<Vec3, 4> spot{};
  std::array<double, 4> since{};
  std::array<bool, 4> swung{};
  const auto world = [&](double t, const Vector& x) { return eigen(predict(puppet.input.command, t).transform(x)); };
  for (int k = 1; k <= 1600; ++k) {
    const double t = k * 1e-3;
    puppet.step_to(t);
    for (int i = 0; i < 4; ++i) {
      const FootPlan<double>& foot = puppet.feet[i];
      if (puppet.stands(i) && swung[i]) {
        spot[i] = world(t, foot.x);
        since[i] = t;
      }
      if (puppet.stands(i) && since[i] > 0) {
        // Explicit Euler steps of 1 ms on a circle of at most 0.3 m at 0.5 rad/s over 0.3 s err by less than
        // h/2 |x''| T = 0.5e-3 * (0.3 * 0.25 + 0.2 * 0.5) * 0.3 = 3e-5 m.
        EXPECT_LT((world(t, foot.x) - spot[i]).norm(), 5e-5) << t;
        if (std::abs(t - since[i] - 0.15) < 5e-4) {
          EXPECT_LT((eigen(foot.x) - Vec3::Map(puppet.p.origin[i])).norm(),
                    5e-4);  // 0.2 m/s times 1 ms, and the above
        }
      }
      swung[i] = foot.swing;
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
  EXPECT_TRUE(puppet.feet[2].reach);
  EXPECT_TRUE(puppet.feet[0].support);
  EXPECT_NEAR(puppet.feet[2].xd.z, -0.2, 1e-12);
  EXPECT_NEAR(puppet.feet[2].x.z, -0.15 - 0.2 * 0.020, 0.2 * 1.5e-3);
  puppet.carries[2] = true;
  puppet.step_to(t += 1e-3);
  EXPECT_TRUE(puppet.stands(2));
  EXPECT_TRUE(puppet.feet[0].swing);
  EXPECT_NEAR(puppet.feet[0].path.duration, 0.2 - t, 1e-9);  // the swing is shortened by the wait (line 28)
}

// In support, a foot beyond its reach swings although another still searches for ground (line 22).
TEST(GaitPlanner, OverreachForcesASwing) {
  Puppet puppet(walk_parameters());
  puppet.input.command.v = {0.2, 0, 0};
  puppet.carries[2] = false;
  double t = 0;
  while (t < 0.110) puppet.step_to(t += 1e-3);
  ASSERT_TRUE(puppet.feet[0].support);
  puppet.feet[0].x = lane(Vec3::Map(puppet.p.hip[0]) - 0.18 * Vec3::UnitZ());
  puppet.step_to(t += 1e-3);
  EXPECT_TRUE(puppet.feet[0].swing);
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
      const bool stance = in_stance(p.timing, i, phase_at(p.timing, t));
      EXPECT_EQ(puppet.stands(i), stance);
      EXPECT_EQ(puppet.feet[i].swing, !stance);
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
    ASSERT_TRUE(puppet.feet[2].swing);
    puppet.input.command.v = {0.2, 0, 0};
    puppet.step_to(t += 1e-3);
    const Vec3 goal = at(puppet.feet[2].path, 1.0).x;
    const double shift = 0.1 * 0.15;  // 0.1 m/s more for half a stance of 0.3 s
    const double from = puppet.p.origin[2][0] + shift;
    EXPECT_NEAR(goal.x(), redirected ? from + shift : from, 1e-12);
  }
}

// Settling: all feet stand and move the base smoothly to its commanded height; then the gait's clock begins.
TEST(GaitPlanner, SettlesToTheCommandedHeight) {
  GaitParameters p = walk_parameters();
  p.settle = 0.5;
  Puppet puppet(p);
  for (int i = 0; i < 4; ++i) puppet.input.x[i] = lane(Vec3::Map(p.origin[i]) + Vec3(0.01, 0.02, -0.02));
  start_feet(p, puppet.input, 1, puppet.feet);
  const auto to = [&](double t) {
    puppet.input.t = t;
    plan(p, puppet.input, 1u, puppet.feet);
    return Sample{eigen(puppet.feet[2].x), eigen(puppet.feet[2].xd)};
  };
  const Vec3 begin = eigen(puppet.input.x[2]);
  EXPECT_LT((to(0).x - begin).norm() + to(0).xd.norm(), 1e-12);
  EXPECT_LT((to(0.125).x - begin - Vec3(0, 0, 0.02 * 0.15625)).norm(), 1e-12);  // 3 s^2 - 2 s^3 at a quarter
  EXPECT_NEAR(to(0.25).xd.z(), 0.02 * 1.5 / 0.5, 1e-12);
  EXPECT_NEAR(to(0.499).x.z(), -0.15, 1e-6);
  EXPECT_TRUE(puppet.stands(2));
  to(0.5);
  EXPECT_TRUE(puppet.feet[2].swing);  // LH lifts at 0 % of the gait
}

// The foot lifts along the world's vertical when asked to, as sensed through the base's attitude.
TEST(GaitPlanner, GlobalUp) {
  GaitParameters p = walk_parameters();
  p.global_up = true;
  Puppet puppet(p);
  puppet.input.roll = 0.1;
  puppet.input.pitch = -0.2;
  const Vec3 up_B = rotation_from_rpy({0.1, -0.2, 1.3}).row(2).transpose();
  puppet.step_to(1e-3);
  ASSERT_TRUE(puppet.feet[2].swing);
  const SwingPath<double>& path = puppet.feet[2].path;
  EXPECT_LT((at(path, 1e-3 + path.duration / 3).x - eigen(path.knot[0]) - 0.03 * up_B).norm(), 1e-12);
}

}  // namespace
}  // namespace graze
