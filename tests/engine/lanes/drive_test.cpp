// Claim: servos and prescribed motion are solved with everything else: the torque obeys the servo's law at the step's
// end or is exactly its bound, whichever way it is computed, and what a lane does is its own affair.

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "engine/lane_physics/lane_physics.h"
#include "sampling/constants.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

/// Two light links on the world, hanging into the plane x-z, both joints about y.
World arm() {
  World world;
  world.robot.name = "arm";
  world.robot.floating_base = false;
  const Shape rod = box(0.02, 0.02, 0.2);
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false),
                       link("upper", rod, 0.05, at(0, 0, -0.1), false), link("lower", rod, 0.03, at(0, 0, -0.1))};
  for (const auto& [name, parent, child, z] :
       {std::tuple("shoulder", "base", "upper", 0.0), std::tuple("elbow", "upper", "lower", -0.2)}) {
    world.robot.joints.push_back(joint(name, parent, child, JointType::revolute, at(0, 0, z), Vec3::UnitY()));
  }
  world.gravity = {0, 0, -kGravity};
  return world;
}

/// A lane under a drive.
class Driven {
 public:
  explicit Driven(const Particle& particle, int lane = 0)
      : bench(particle, lane), drive(bench.model().na()), result(bench.model().na()), lane_(lane) {
    for (int k = 0; k < bench.model().na(); ++k) drive.lower(k, lane) = -kInfinity, drive.upper(k, lane) = kInfinity;
  }
  explicit Driven(const World& world) : Driven(particle_of(world)) {}

  void step(double h) {
    LaneMask mask;
    mask.set(lane_);
    before_q = bench.q();
    h_ = h;
    bench.physics().drive(h, mask, drive, result);
  }
  int q_of(int k) const { return bench.model().bodies[bench.model().actuated[k]].q; }
  int v_of(int k) const { return bench.model().bodies[bench.model().actuated[k]].v; }
  double torque(int k) const { return result.torque(k, lane_); }
  double demand(int k) const { return result.demand(k, lane_); }
  /// The servo's law at the end of the step, with the speed that led there.
  double law(int k) const {
    return drive.tau(k, lane_) + drive.kp(k, lane_) * (drive.q(k, lane_) - bench.q(q_of(k))) +
           drive.kd(k, lane_) * (drive.v(k, lane_) - (bench.q(q_of(k)) - before_q[q_of(k)]) / h_);
  }
  void servo(int k, double kp, double kd, double q, double bound) {
    drive.kp(k, lane_) = kp, drive.kd(k, lane_) = kd, drive.q(k, lane_) = q;
    drive.lower(k, lane_) = -bound, drive.upper(k, lane_) = bound;
  }

  struct OneLane : Bench {
    OneLane(const Particle& particle, int lane) : Bench("lanes", particle, lane) {}
  } bench;
  Drive drive;
  DriveResult result;
  Eigen::VectorXd before_q;

 private:
  int lane_;
  double h_ = 0;
};

// The reported torque is the law's at the step's end, clipped, and the same motion comes of handing that torque to
// step(): that is the bounded implicit servo, however it was found. Random gains, targets and bounds; more than a
// quarter of the cases must be at a bound for the test to mean anything.
TEST(Servo, TorqueIsTheBoundedLawAtTheEndOfTheStep) {
  std::mt19937 draw(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  int at_bound = 0, count = 0;
  for (int run = 0; run < 100; ++run) {
    const double h = run % 2 == 0 ? 1e-3 : 1e-2;
    Particle particle = particle_of(arm());
    for (int k = 0; k < 2; ++k) particle.initial.q[k] = unit(draw), particle.initial.v[k] = 3 * unit(draw);
    Driven driven(particle);
    Bench given("lanes", particle);
    for (int k = 0; k < 2; ++k) {
      driven.servo(k, std::pow(10, 2.5 + 2.5 * unit(draw)), std::pow(10, -1 + unit(draw)), unit(draw),
                   std::pow(10, unit(draw)));
      driven.drive.tau(k, 0) = unit(draw);
      driven.drive.v(k, 0) = unit(draw);
    }
    for (int i = 0; i < 5; ++i) {
      driven.step(h);
      if (!driven.bench.fault().empty()) break;  // too fast for the step: it stands still from now on
      for (int k = 0; k < 2; ++k) {
        const double law = driven.law(k), bound = driven.drive.upper(k, 0);
        ++count;
        at_bound += std::abs(driven.torque(k)) == bound;
        EXPECT_LE(std::abs(driven.torque(k)), bound);
        // Rounding of kp (q_ref - q), and of a row's sweeps.
        EXPECT_NEAR(driven.torque(k), std::clamp(law, -bound, bound), 1e-9 * driven.drive.kp(k, 0) + 1e-9);
        given.tau(k, 0) = driven.torque(k);
      }
      given.step(h);
      EXPECT_LT((given.v() - driven.bench.v()).norm(), 1e-9 * (1 + given.v().norm()));
    }
  }
  EXPECT_GT(count, 800);
  EXPECT_GT(at_bound, count / 4);
  EXPECT_LT(at_bound, count * 3 / 4);
}

// A lane that stands still keeps its columns of the result, and its torque, whatever the width of the engine.
TEST(Servo, ResultOfALaneThatStandsStillStays) {
  const Particle particle = particle_of(arm());
  for (const int width : {1, 8}) {
    LanePhysics physics(particle.model, width);
    for (int lane = 0; lane < kLanes; ++lane) physics.start(lane, particle);
    Drive drive(2);
    DriveResult result(2);
    for (int k = 0; k < 2; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        drive.kp(k, lane) = 50, drive.q(k, lane) = 0.3, drive.lower(k, lane) = -1, drive.upper(k, lane) = 1;
        result.torque(k, lane) = 100 + lane, result.demand(k, lane) = 200 + lane;
      }
    }
    physics.drive(1e-3, LaneMask(0b0101), drive, result);
    for (int k = 0; k < 2; ++k) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const bool active = lane == 0 || lane == 2;
        EXPECT_EQ(result.torque(k, lane) == 100 + lane, !active) << "lane " << lane;
        EXPECT_EQ(result.demand(k, lane) == 200 + lane, !active) << "lane " << lane;
        if (active) {
          EXPECT_EQ(result.torque(k, lane), 1);  // at its bound, exactly
        }
      }
    }
  }
}

// A row of the sweeps and the diagonal of M are the same servo, to 1e-10.
TEST(Servo, RowAndDiagonalAgree) {
  const Particle particle = particle_of(arm());
  Eigen::VectorXd v[2];
  for (const bool row : {false, true}) {
    BlockState state{BlockArray(2), BlockArray(2), BlockArray(2), BlockArray(36)};
    LaneEngine engine(particle.model, kernel_of(chosen_isa()),
                      {state.q.row(0), state.v.row(0), state.a.row(0), state.X.row(0)});
    engine.start(0, particle.model, particle.initial);
    engine.block().settings = {.most_sweeps = 10000, .tolerance = 1e-15, .sweep_servos = row, .newton_after = 10000};
    Drive drive(2);
    for (int k = 0; k < 2; ++k) {
      drive.kp(k, 0) = 50, drive.kd(k, 0) = 0.1, drive.q(k, 0) = 0.3 - k;
      drive.lower(k, 0) = -1000, drive.upper(k, 0) = 1000;
    }
    const DriveView view{drive.tau.row(0), drive.q.row(0),     drive.v.row(0),     drive.kp.row(0),
                         drive.kd.row(0),  drive.lower.row(0), drive.upper.row(0), nullptr};
    engine.drive(1e-3, 1, view);
    EXPECT_GT(engine.sweeps(0), row ? 1 : 0);
    v[row] = state.v.column(0);
  }
  EXPECT_GT(v[0].norm(), 0.1);
  EXPECT_LT((v[0] - v[1]).norm(), 1e-10);
}

// kp = 1e5 N m/rad on 30 g at 1 ms: the explicit spring would multiply its error by 1e5 h^2 / I, a hundred, per step.
// This one is at its target after three steps and stays (the first overshoot, by Coriolis forces of the jump, is 4 %).
TEST(Servo, StiffServosDoNotOscillate) {
  for (const double h : {1e-3, 2e-2}) {
    Driven driven(arm());
    for (int k = 0; k < 2; ++k) driven.servo(k, 1e5, 0, 0.05, kInfinity);
    for (int i = 0; i < 200; ++i) {
      driven.step(h);
      if (i < 3) continue;
      for (int k = 0; k < 2; ++k) EXPECT_NEAR(driven.bench.q(k), 0.05, 1e-3) << "step " << i;
    }
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(driven.bench.q(k), 0.05, 1e-5);
    EXPECT_EQ(driven.bench.fault(), "");
  }
}

// A servo that is too weak to lift the arm gives its bound all the way, and falls as under that constant torque.
TEST(Servo, SaturatedServoIsAConstantTorque) {
  Driven driven(arm());
  Bench constant("lanes", arm());
  for (int k = 0; k < 2; ++k) {
    driven.servo(k, 1e4, 10, 3, 0.02);
    constant.tau(k, 0) = 0.02;
  }
  for (int i = 0; i < 100; ++i) {
    driven.step(1e-3);
    constant.step(1e-3);
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(driven.torque(k), 0.02);
      EXPECT_GT(driven.demand(k), 0.02);
    }
  }
  EXPECT_LT((driven.bench.q() - constant.q()).norm(), 1e-9);
}

// What a lane does under drives does not depend on its neighbours: eight robots that drop on their feet with servos
// between weak (often at their bounds, solved again) and strong, together and alone, give the same bits.
TEST(Servo, LanesAreAlone) {
  const auto set = [](Drive& drive, const Particle& particle, int lane) {
    for (int k = 0; k < particle.model.na(); ++k) {
      drive.kp(k, lane) = 20 * (1 + lane), drive.kd(k, lane) = 0.1;
      drive.q(k, lane) = particle.initial.q[particle.model.bodies[particle.model.actuated[k]].q] + 0.1 * (k % 3);
      drive.upper(k, lane) = 0.2 + 0.3 * lane, drive.lower(k, lane) = -drive.upper(k, lane);
    }
  };
  std::vector<Particle> particles;
  for (std::uint32_t id = 0; id < kLanes; ++id) particles.push_back(busy_particle(id));
  const Model& model = particles[0].model;
  const auto together = make_physics("lanes", model);
  Drive drive(model.na());
  DriveResult result(model.na());
  for (int lane = 0; lane < kLanes; ++lane) {
    together->start(lane, particles[lane]);
    set(drive, particles[lane], lane);
  }
  int cut = 0;
  for (int i = 0; i < 100; ++i) {
    together->drive(1e-3, LaneMask::all(), drive, result);
    for (int k = 0; k < model.na(); ++k) cut += std::abs(result.torque(k, 0)) == drive.upper(k, 0);
  }
  EXPECT_GT(cut, 50);
  for (const int lane : {0, 3, 7}) {
    const auto alone = make_physics("lanes", model);
    Drive own(model.na());
    DriveResult torque(model.na());
    LaneMask mask;
    mask.set(lane);
    alone->start(lane, particles[lane]);
    set(own, particles[lane], lane);
    for (int i = 0; i < 100; ++i) alone->drive(1e-3, mask, own, torque);
    EXPECT_EQ(alone->state().q.column(lane), together->state().q.column(lane));
    EXPECT_EQ(alone->state().v.column(lane), together->state().v.column(lane));
    EXPECT_EQ(torque.torque.column(lane), result.torque.column(lane));
  }
}

// §8.4: prescribed joints are where they must be to rounding, and the torque that is reported makes the same motion
// when it is handed to step().
TEST(PrescribedMotion, IsExactAndItsTorqueIsReported) {
  for (const int held : {1, 2, 3}) {
    Particle particle = particle_of(arm());
    Driven driven(particle);
    const double h = 1e-3;
    for (int k = 0; k < 2; ++k) driven.drive.prescribed(k, 0) = held >> k & 1;
    for (int i = 1; i <= 100; ++i) {
      for (int k = 0; k < 2; ++k) driven.drive.q(k, 0) = 0.4 * std::sin(7 * i * h * (k + 1));
      particle.initial = {driven.bench.q(), driven.bench.v()};
      Bench given("lanes", particle);
      driven.step(h);
      for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(driven.bench.q(k), (held >> k & 1) ? driven.drive.q(k, 0) : driven.bench.q(k), 1e-14);
        given.tau(k, 0) = driven.torque(k);
      }
      given.step(h);
      ASSERT_LT((given.q() - driven.bench.q()).norm(), 1e-12);
    }
  }
}

// On a free robot with feet in contact, all joints prescribed to stay: the robot is one rigid body, whatever touches.
TEST(PrescribedMotion, HoldsARobotInContact) {
  const Particle particle = busy_particle(1);
  Driven driven(particle);
  for (int k = 0; k < particle.model.na(); ++k) {
    driven.drive.prescribed(k, 0) = 1;
    driven.drive.q(k, 0) = particle.initial.q[driven.q_of(k)];
  }
  bool touched = false;
  for (int i = 0; i < 500; ++i) {
    driven.step(1e-3);
    for (const Contact& c : driven.bench.contacts()) touched = touched || c.normal_impulse() > 0;
    for (int k = 0; k < particle.model.na(); ++k) {
      ASSERT_NEAR(driven.bench.q(driven.q_of(k)), driven.drive.q(k, 0), 1e-12);
    }
  }
  EXPECT_TRUE(touched);
  EXPECT_EQ(driven.bench.fault(), "");
}

// With limited torque the joint falls behind, gives exactly its bound meanwhile, and catches up.
TEST(PrescribedMotion, KeepsTorqueLimits) {
  Driven driven(arm());
  for (int k = 0; k < 2; ++k) driven.drive.prescribed(k, 0) = 1;
  driven.drive.lower(0, 0) = -0.3, driven.drive.upper(0, 0) = 0.3;
  bool behind = false;
  for (int i = 1; i <= 1000; ++i) {
    driven.drive.q(0, 0) = i > 100 ? 0.3 : 0;
    driven.step(1e-3);
    EXPECT_LE(std::abs(driven.torque(0)), 0.3);
    behind = behind || std::abs(driven.torque(0)) == 0.3;
    EXPECT_NEAR(driven.bench.q(1), 0, 1e-14);
  }
  EXPECT_TRUE(behind);
  EXPECT_GT(std::abs(driven.bench.q(0) - 0.3), 1e-3) << "the limit keeps it behind";
  driven.drive.lower(0, 0) = -1e4, driven.drive.upper(0, 0) = 1e4;
  for (int i = 0; i < 10; ++i) {
    driven.step(1e-3);
    EXPECT_NEAR(driven.bench.q(0), 0.3, 1e-12) << "without it the joint catches up within the step, and stays";
  }
  EXPECT_EQ(driven.bench.fault(), "");
}

// A ball that rolls without slipping is in mode roll, a box that stands in mode stick, a ball that spins about the
// normal sticks, and one pushed along on ice slips.
TEST(ContactModes, BallsRoll) {
  for (const char* physics : {"lanes", "bullet"}) {
    SCOPED_TRACE(physics);
    const auto mode = [&](const Shape& shape, double height, double friction, const Vec3& v, const Vec3& w) {
      World world = free_body(shape, 1);
      world.objects.push_back(fixed("ground", plane()));
      world.gravity = {0, 0, -kGravity};
      world.contact.model = physics == std::string("lanes") ? "complementarity" : contact_models_of("bullet").front();
      world.contact.friction = friction;
      world.initial.position = {0, 0, height};
      world.initial.linear_velocity = v;
      world.initial.angular_velocity = w;
      Bench run(physics, world);
      run.run(0.05, 1e-3);
      EXPECT_FALSE(run.contacts().empty());
      return run.contacts().empty() ? ContactMode::stick : run.contacts().front().mode;
    };
    EXPECT_EQ(mode(sphere(0.1), 0.1, 0.8, {0.5, 0, 0}, {0, 5, 0}), ContactMode::roll);
    EXPECT_EQ(mode(sphere(0.1), 0.1, 0.8, {0, 0, 0}, {0, 0, 5}), ContactMode::stick);
    EXPECT_EQ(mode(sphere(0.1), 0.1, 0.0, {0.5, 0, 0}, {0, 0, 0}), ContactMode::slip);
    EXPECT_EQ(mode(box(0.1, 0.1, 0.1), 0.05, 0.8, {0, 0, 0}, {0, 0, 0}), ContactMode::stick);
  }
}

// A ball dropped from rest touches the ground at sqrt(2 z / g); the step of 10 ms does not show, its first order does:
// the scheme's own fall is ahead of the parabola by half a step.
TEST(ContactModes, TouchIsTimedWithinTheStep) {
  const double h = 1e-2, z = 0.123;
  World world = free_body(sphere(0.1), 1);
  world.objects.push_back(fixed("ground", plane()));
  world.gravity = {0, 0, -kGravity};
  world.initial.position = {0, 0, 0.1 + z};
  for (const char* physics : {"lanes", "bullet"}) {
    Bench run(physics, world);
    double touched = -1;
    for (int i = 1; i < 30 && touched < 0; ++i) {
      run.step(h);
      for (const Contact& c : run.contacts()) {
        if (!c.touching()) continue;
        EXPECT_GE(c.age, 0);
        EXPECT_LE(c.age, h);
        touched = i * h - c.age;
      }
    }
    EXPECT_NEAR(touched, std::sqrt(2 * z / kGravity), 0.6 * h) << physics;
    EXPECT_GT(std::abs(std::remainder(touched, h)), 1e-6) << physics;
  }
}

}  // namespace
}  // namespace graze::test
