// Motion without contact, against closed forms.

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

class FreeMotion : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, FreeMotion, testing::ValuesIn(physics_names()));

/// A rod of length `length` that hangs from a hinge about y at the origin, on a fixed base.
World pendulum(double length, double mass) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false),
                       link("rod", box(0.02, 0.02, length), mass, at(0, 0, -length / 2), false)};
  world.robot.joints = {joint("hinge", "base", "rod", JointType::revolute, Pose::Identity(), Vec3::UnitY())};
  return world;
}

/// Moment of inertia of the rod about its hinge.
double hinge_inertia(double length, double mass) {
  return mass * (length * length + 0.02 * 0.02) / 12 + mass * length * length / 4;
}

// A thrown body follows the parabola of semi-implicit Euler exactly: p(n) = p0 + v0 t - g t (t + h) / 2.
TEST_P(FreeMotion, ThrownBodyFollowsTheParabola) {
  World world = free_body(box(0.1, 0.2, 0.3), 2.0);
  world.initial.position = {1, 2, 3};
  world.initial.linear_velocity = {0.5, -1, 4};
  Bench run(GetParam(), world);
  const double h = 1e-3, t = 1.0;
  run.run(t, h);
  EXPECT_NEAR(run.position(0).x(), 1.5, 1e-12);
  EXPECT_NEAR(run.position(0).y(), 1.0, 1e-12);
  EXPECT_NEAR(run.position(0).z(), 3 + 4 * t - 0.5 * kGravity * t * (t + h), 1e-10);
  EXPECT_EQ(run.fault(), "");
}

// The state speaks of the link's origin, not of the centre of mass: a body that spins about its centre of mass at rest
// carries its origin around at omega x r, and its principal axes need not be its own.
TEST_P(FreeMotion, OriginCirclesTheCentreOfMass) {
  World world;
  world.gravity.setZero();
  world.robot.links = {link("body", box(0.1, 0.2, 0.3), 1.5, at(0.4, 0, 0, turn(0.7, {1, 2, 3})))};
  const double omega = 2;
  const Vec3 axis = turn(0.7, {1, 2, 3}).col(2);  // a principal axis, so the spin is steady
  world.initial.angular_velocity = omega * axis;
  world.initial.linear_velocity = -omega * axis.cross(Vec3(0.4, 0, 0));
  Bench run(GetParam(), world);
  const Vec3 com(0.4, 0, 0);
  run.run(1.0, 1e-3, [&] {
    EXPECT_LT((run.position(0) + run.rotation(0) * com - com).norm(), 1e-10);
    const Vec3 v = run.physics().state().v.vec3(3, 0), w = run.physics().state().v.vec3(0, 0);
    EXPECT_LT((v + w.cross(run.rotation(0) * com)).norm(), 1e-10);
  });
  const Mat3 expected = turn(omega * 1.0, axis);
  EXPECT_LT((run.rotation(0) - expected).norm(), 1e-9);
}

// Torque-free tumbling about the intermediate axis keeps energy and angular momentum, to rounding or but for an error
// of first order or better: it halves with the step at least.
TEST_P(FreeMotion, TumblingKeepsEnergyAndMomentumToFirstOrder) {
  World world = free_body(box(0.1, 0.2, 0.4), 1.0);
  world.gravity.setZero();
  world.initial.angular_velocity = {0.1, 5, 0.1};
  struct Drift {
    double momentum, energy;  // relative
  };
  const auto drift = [&](double h) {
    Bench run(GetParam(), world);
    const Mat3 I = run.model().bodies[0].inertia;
    const auto spin = [&] { return run.physics().state().v.vec3(0, 0); };
    const auto momentum = [&] { return Vec3(run.rotation(0) * I * run.rotation(0).transpose() * spin()); };
    const auto energy = [&] { return 0.5 * momentum().dot(spin()); };
    const Vec3 before = momentum();
    const double start = energy();
    Drift worst{};
    run.run(2.0, h, [&] {
      worst.momentum = std::max(worst.momentum, (momentum() - before).norm() / before.norm());
      worst.energy = std::max(worst.energy, std::abs(energy() - start) / start);
    });
    EXPECT_EQ(run.fault(), "");
    return worst;
  };
  const Drift coarse = drift(1e-3), fine = drift(5e-4);
  const double rounding = 1e-12;  // 2000 steps of some 1e-16
  EXPECT_LT(coarse.momentum, 0.02);
  EXPECT_LT(fine.momentum, std::max(rounding, coarse.momentum / 1.8));
  EXPECT_LT(coarse.energy, 0.02);
  EXPECT_LT(fine.energy, std::max(rounding, coarse.energy / 1.8));
}

// T = 2 pi sqrt(I / m g d) (1 + a^2/16 + 11 a^4/3072 + 173 a^6/737280). Semi-implicit Euler is off by (h w)^2 / 24.
TEST_P(FreeMotion, PendulumPeriodWithEllipticCorrection) {
  const double length = 0.5, mass = 0.3, a = 0.5, h = 1e-3;
  World world = pendulum(length, mass);
  world.initial.joint_position["hinge"] = a;
  Bench run(GetParam(), world);
  std::vector<double> crossings;
  double t = 0, before = a;
  run.run(14.0, h, [&] {
    t += h;
    if (before < 0 && run.q(0) >= 0) crossings.push_back(t - h * run.q(0) / (run.q(0) - before));
    before = run.q(0);
  });
  ASSERT_GE(crossings.size(), 11u);
  const double w = std::sqrt(mass * kGravity * length / 2 / hinge_inertia(length, mass));
  const double a2 = a * a;
  const double period = 2 * std::numbers::pi / w * (1 + a2 / 16 + 11 * a2 * a2 / 3072 + 173 * a2 * a2 * a2 / 737280);
  EXPECT_NEAR((crossings[10] - crossings[0]) / 10, period, period * (h * w) * (h * w));
}

// A prismatic joint under a force F falls at F/m + g along its axis; the base does not move.
TEST_P(FreeMotion, SliderAcceleratesAlongItsAxis) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false),
                       link("car", box(0.1, 0.2, 0.3), 2, at(0.1, 0.2, 0.3), false)};
  const Mat3 R = turn(0.5, Vec3::UnitX());
  world.robot.joints = {joint("rail", "base", "car", JointType::prismatic, at(0, 0, 1, R), Vec3::UnitZ())};
  Bench run(GetParam(), world);
  ASSERT_EQ(run.model().na(), 1);
  run.tau(0, 0) = 3;
  const double h = 1e-3, t = 0.5, a = 3.0 / 2 - kGravity * std::cos(0.5);
  run.run(t, h);
  EXPECT_NEAR(run.v(0), a * t, 1e-10);
  EXPECT_NEAR(run.q(0), 0.5 * a * t * (t + h), 1e-10);
  EXPECT_LT((run.position(0) - Vec3(Vec3(0, 0, 1) + R.col(2) * run.q(0))).norm(), 1e-12);
}

// A free robot that moves its joints by inner torques keeps its linear momentum but for gravity.
TEST_P(FreeMotion, InnerTorquesDoNotMoveTheCentreOfMass) {
  World world;
  world.robot.links = {link("body", box(0.3, 0.2, 0.1), 2, at(0.05, 0, 0)),
                       link("leg", box(0.05, 0.05, 0.3), 0.5, at(0, 0, -0.15)),
                       link("foot", sphere(0.03), 0.1, at(0.02, 0, -0.05))};
  world.robot.joints = {
      joint("hip", "body", "leg", JointType::revolute, at(0.15, 0, 0, turn(0.3, {1, 1, 0})), Vec3(0, 1, 0)),
      joint("ankle", "leg", "foot", JointType::prismatic, at(0, 0, -0.3), Vec3(0, 0, 1))};
  world.contact.self_collision = false;
  Bench run(GetParam(), world);
  const auto com = [&] {
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (int i = 0; i < 3; ++i) {
      sum += run.model().bodies[i].mass * (run.position(i) + run.rotation(i) * run.model().bodies[i].com);
      mass += run.model().bodies[i].mass;
    }
    return Vec3(sum / mass);
  };
  const Vec3 start = com();
  const double h = 1e-4, t = 0.2;
  long k = 0;
  run.run(t, h, [&] {
    run.tau(0, 0) = 0.3 * std::sin(40 * ++k * h);
    run.tau(1, 0) = 0.5 * std::cos(60 * k * h);
  });
  // The centre of mass of a chain moves with v+ only to first order in h: |error| <= t h / 2 * peak acceleration, a few
  // m/s^2 for these torques.
  EXPECT_LT((com() - start + Vec3(0, 0, 0.5 * kGravity * t * (t + h))).norm(), 0.5 * t * h * 10);
  EXPECT_EQ(run.fault(), "");
}

// Viscous damping is implicit: v(n) = v0 / (1 + h d / I)^n, also where h d / I = 50 would blow an explicit one up.
TEST_P(FreeMotion, JointDampingDecaysAndNeverOvershoots) {
  const double length = 0.5, mass = 0.3, h = 1e-3, I = hinge_inertia(length, mass);
  for (double ratio : {0.01, 50.0}) {
    World world = pendulum(length, mass);
    world.gravity.setZero();
    world.robot.joints[0].damping = ratio * I / h;
    world.initial.joint_velocity["hinge"] = 2;
    Bench run(GetParam(), world);
    for (int n = 1; n <= 20; ++n) {
      run.step(h);
      ASSERT_NEAR(run.v(0), 2 / std::pow(1 + ratio, n), 1e-11) << ratio;
    }
  }
}

// Dry friction f holds against a smaller torque and takes f off a larger one.
TEST_P(FreeMotion, DryJointFrictionHoldsAndResists) {
  const double length = 0.5, mass = 0.3, h = 1e-3, I = hinge_inertia(length, mass);
  World world = pendulum(length, mass);
  world.gravity.setZero();
  world.robot.joints[0].friction = 0.1;
  Bench run(GetParam(), world);
  run.tau(0, 0) = 0.09;
  run.run(0.5, h);
  EXPECT_NEAR(run.q(0), 0, 1e-9);
  run.tau(0, 0) = 0.15;
  run.run(0.5, h);
  EXPECT_NEAR(run.v(0), 0.05 / I * 0.5, 1e-6);
  run.tau(0, 0) = 0;
  run.run(2.0, h);
  EXPECT_NEAR(run.v(0), 0, 1e-9);
}

// A falling rod stops at its limit and stays: never more than rounding beyond it, no bounce.
TEST_P(FreeMotion, JointLimitHolds) {
  World world = pendulum(0.5, 0.3);
  world.robot.joints[0].lower = 0.4;
  world.robot.joints[0].upper = 1.5;
  world.initial.joint_position["hinge"] = 1.4;
  Bench run(GetParam(), world);
  double least = 10;
  run.run(2.0, 1e-3, [&] { least = std::min(least, run.q(0)); });
  EXPECT_GT(least, 0.4 - 1e-8);
  EXPECT_NEAR(run.q(0), 0.4, 1e-8);
  EXPECT_EQ(run.fault(), "");
}

// A joint that starts beyond its limit is brought back slowly and gains no more than the recovery speed.
TEST_P(FreeMotion, JointBeyondItsLimitReturnsSlowly) {
  World world = pendulum(0.5, 0.3);
  world.gravity.setZero();
  Particle particle = particle_of(world);
  particle.model.bodies[0].lower = 0.1;
  particle.model.bodies[0].upper = 1;
  Bench run(GetParam(), particle);
  double fastest = 0;
  run.run(2.0, 1e-3, [&] { fastest = std::max(fastest, run.v(0)); });
  EXPECT_GE(run.q(0), 0.1 - 1e-6);
  EXPECT_LE(fastest, 0.2 + 1e-9);
  EXPECT_EQ(run.fault(), "");
}

// Torques that balance gravity hold an arm of two links still: m g times horizontal lever.
TEST_P(FreeMotion, GravityTorqueIsStaticEquilibrium) {
  World world = pendulum(0.4, 0.3);
  world.robot.links.push_back(link("fore", box(0.02, 0.02, 0.3), 0.2, at(0, 0, -0.15), false));
  world.robot.joints.push_back(joint("elbow", "rod", "fore", JointType::revolute, at(0, 0, -0.4), Vec3::UnitY()));
  const double a = 0.8, b = 0.5;
  world.initial.joint_position = {{"hinge", a}, {"elbow", b}};
  Bench run(GetParam(), world);
  // A link at angle s from the vertical reaches -x sin(s): torque about +y that carries it is m g lever sin(s).
  const double fore = 0.2 * kGravity * 0.15 * std::sin(a + b);
  run.tau(0, 0) = 0.3 * kGravity * 0.2 * std::sin(a) + 0.2 * kGravity * 0.4 * std::sin(a) + fore;
  run.tau(1, 0) = fore;
  run.run(1.0, 1e-3);
  EXPECT_NEAR(run.q(0), a, 1e-9);
  EXPECT_NEAR(run.q(1), b, 1e-9);
}

// A chain that hangs straight stays; a double pendulum that falls keeps its energy to first order in the step.
TEST_P(FreeMotion, HangingChainRestsAndFallingChainKeepsEnergy) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false)};
  for (int i = 0; i < 5; ++i) {
    const std::string name = "link" + std::to_string(i), parent = i ? "link" + std::to_string(i - 1) : "base";
    world.robot.links.push_back(link(name, box(0.02, 0.03, 0.2), 0.1, at(0, 0, -0.1), false));
    world.robot.joints.push_back(joint("j" + std::to_string(i), parent, name, JointType::revolute,
                                       at(0, 0, i ? -0.2 : 0), i % 2 ? Vec3::UnitX() : Vec3::UnitY()));
  }
  Bench still(GetParam(), world);
  still.run(1.0, 1e-3);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(still.q(i), 0);

  world.initial.joint_position = {{"j0", 1.0}, {"j1", 0.7}, {"j3", -0.5}};
  const auto drift = [&](double h) {
    Bench run(GetParam(), world);
    const auto energy = [&] {
      double sum = 0;
      Vec3 omega[5], v[5];
      for (int i = 0; i < 5; ++i) {
        const Body& body = run.model().bodies[i];
        const Mat3 R = run.rotation(i);
        const Vec3 axis = R * body.axis;
        omega[i] = axis * run.v(i);
        v[i].setZero();
        if (i > 0) {
          omega[i] += omega[i - 1];
          v[i] = v[i - 1] + omega[i - 1].cross(run.position(i) - run.position(i - 1));
        }
        const Vec3 lever = R * body.com, vc = v[i] + omega[i].cross(lever), w = R.transpose() * omega[i];
        sum += 0.5 * body.mass * vc.squaredNorm() + 0.5 * w.dot(body.inertia * w) +
               body.mass * kGravity * (run.position(i) + lever).z();
      }
      return sum;
    };
    const double before = energy();
    double worst = 0;
    run.run(0.5, h, [&] { worst = std::max(worst, std::abs(energy() - before)); });
    EXPECT_EQ(run.fault(), "");
    return worst / (5 * 0.1 * kGravity * 0.5);
  };
  const double coarse = drift(2e-4), fine = drift(1e-4);
  EXPECT_LT(coarse, 0.01);
  EXPECT_NEAR(coarse / fine, 2.0, 0.2);
}

}  // namespace
}  // namespace graze::test
