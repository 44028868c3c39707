// Claim: the lane engine moves bodies as mechanics says, against closed forms. Tolerances are the first-order error of
// semi-implicit Euler at the step used, or rounding where the scheme is exact.

#include <gtest/gtest.h>

#include <numbers>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Sum over bodies of linear and angular momentum about the world's origin.
Eigen::Matrix<double, 6, 1> momentum(const Bench& run) {
  Eigen::Matrix<double, 6, 1> P = Eigen::Matrix<double, 6, 1>::Zero();
  const Eigen::VectorXd v = run.v();
  const std::vector<Pose> X = reference_poses(run.model(), run.q());
  for (std::size_t i = 0; i < run.model().bodies.size(); ++i) {
    const Body& body = run.model().bodies[i];
    const Vec3 com = X[i] * body.com;
    const Eigen::Matrix3Xd J = reference_jacobian(run.model(), X, static_cast<int>(i), com);
    const Vec3 linear = J * v;
    Vec3 spin;  // w from the velocities of points beside the centre of mass
    const Vec3 vx = reference_jacobian(run.model(), X, static_cast<int>(i), com + Vec3::UnitX()) * v - linear;
    const Vec3 vy = reference_jacobian(run.model(), X, static_cast<int>(i), com + Vec3::UnitY()) * v - linear;
    spin << vy.z(), -vx.z(), vx.y();
    P.head<3>() += body.mass * linear;
    P.tail<3>() += body.mass * com.cross(linear) + X[i].linear() * body.inertia * X[i].linear().transpose() * spin;
  }
  return P;
}

// A robot that tumbles freely with swinging legs keeps linear and angular momentum to rounding.
TEST(FreeFlight, KeepsMomentum) {
  World world = busy_world();
  world.objects.clear();
  world.contact.ignore = {{"*", "*"}};
  world.gravity = Vec3::Zero();
  world.initial.angular_velocity = {3, -2, 5};
  for (const Joint& joint : world.robot.joints) world.initial.joint_velocity[joint.name] = 4;
  Bench run("lanes", world);
  const Eigen::Matrix<double, 6, 1> before = momentum(run);
  const Eigen::VectorXd q0 = run.q();
  run.run(1.0, 1e-3);
  EXPECT_GT((run.q() - q0).norm(), 1.0) << "it moved";
  // 1000 steps of rounding at 1e-16 of some 0.1 kg m^2/s.
  EXPECT_LT((momentum(run) - before).norm(), 1e-13);
}

// Without gravity and torques the same flight keeps its energy to rounding: of the momentum's part by the attitude's
// step, of the joints' part by the factor on their motion.
TEST(FreeFlight, KeepsEnergy) {
  World world = busy_world();
  world.objects.clear();
  world.contact.ignore = {{"*", "*"}};
  world.gravity = Vec3::Zero();
  for (double speed : {4.0, 15.0}) {
    world.initial.angular_velocity = speed * Vec3(0.75, -0.5, 1.25);
    for (Joint& joint : world.robot.joints) {
      world.initial.joint_velocity[joint.name] = speed;
      joint.lower = -1e9, joint.upper = 1e9;
    }
    Bench run("lanes", world);
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0);
    run.run(0.2, 1e-3, [&] { EXPECT_NEAR(physics.energy(0), start, 1e-12 * start); });
    EXPECT_EQ(run.fault(), "");
  }
}

// What no factor can correct, the spin of a single body: its energy is off by the second order of the step.
TEST(FreeFlight, ChangesTheEnergyOfASpinWithTheSecondOrderOfTheStep) {
  World world = free_body(box(0.1, 0.2, 0.4), 1.0);
  world.gravity = Vec3::Zero();
  world.initial.angular_velocity = {0.1, 5, 0.1};
  double drift[3];
  for (int k = 0; k < 3; ++k) {
    Bench run("lanes", world);
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0);
    drift[k] = 0;
    run.run(2.0, 1e-3 / (1 << k), [&] { drift[k] = std::max(drift[k], std::abs(physics.energy(0) - start) / start); });
  }
  EXPECT_LT(drift[0], 1e-5);
  EXPECT_NEAR(drift[0] / drift[1], 4, 0.4);
  EXPECT_NEAR(drift[1] / drift[2], 4, 0.4);
}

// A point pendulum of length l swings by small angles with period 2 pi sqrt(l / g).
TEST(Pendulum, HasItsPeriod) {
  World world;
  world.robot.floating_base = false;
  world.robot.links.push_back(link("base", sphere(0.01), 1, Pose::Identity(), false));
  const double l = 0.7, r = 0.01;
  world.robot.links.push_back(link("bob", sphere(r), 1, at(0, 0, -l), false));
  world.robot.joints.push_back(joint("hinge", "base", "bob", JointType::revolute, Pose::Identity(), Vec3(0, 1, 0)));
  world.initial.joint_position["hinge"] = 0.01;
  Bench run("lanes", world);
  const double h = 1e-4, length = l + 0.4 * r * r / l;  // I / (m l)
  double crossed = 0, last = run.q(0);
  int crossings = 0, steps = 0;
  run.run(5, h, [&] {
    ++steps;
    if (last > 0 && run.q(0) <= 0) {
      crossed = h * (steps - run.q(0) / (run.q(0) - last));
      ++crossings;
    }
    last = run.q(0);
  });
  ASSERT_GT(crossings, 2);
  // The first downward crossing is after a quarter period. Amplitude 0.01 rad lengthens it by 6e-6.
  EXPECT_NEAR(crossed / (crossings - 0.75), 2 * kPi * std::sqrt(length / kGravity), 1e-4);
}

/// A rod of 2 kg and 0.6 m on a hinge at its end, with a drive whose rotor doubles its inertia.
World geared_rod() {
  World world;
  world.robot.floating_base = false;
  world.robot.links.push_back(link("base", sphere(0.01), 1, Pose::Identity(), false));
  world.robot.links.push_back(link("rod", box(0.01, 0.01, 0.6), 2, at(0, 0, -0.3), false));
  world.robot.joints.push_back(joint("hinge", "base", "rod", JointType::revolute, Pose::Identity(), Vec3(0, 1, 0)));
  world.robot.joints[0].gear = 80;
  world.robot.joints[0].rotor_inertia = (2 * (0.6 * 0.6 + 0.01 * 0.01) / 12 + 2 * 0.3 * 0.3) / (80 * 80);
  return world;
}

// A rotor behind a gear swings with its joint: period 2 pi sqrt((I + n^2 J) / (m g l)). Without it the period is
// shorter by a factor of sqrt(2).
TEST(Rotor, SlowsAPendulumByItsReflectedInertia) {
  World world = geared_rod();
  world.initial.joint_position["hinge"] = 0.01;
  Bench run("lanes", world);
  const double h = 1e-4, inertia = 2 * run.model().bodies[0].armature;
  double crossed = 0, last = run.q(0);
  int crossings = 0, steps = 0;
  run.run(6, h, [&] {
    ++steps;
    if (last > 0 && run.q(0) <= 0) crossed = h * (steps - run.q(0) / (run.q(0) - last)), ++crossings;
    last = run.q(0);
  });
  ASSERT_GT(crossings, 2);
  EXPECT_NEAR(crossed / (crossings - 0.75), 2 * kPi * std::sqrt(inertia / (2 * kGravity * 0.3)), 1e-4);
}

// A constant torque turns rod and rotor alike, by a damper or not: w = tau t / (I + n^2 J) without one.
TEST(Rotor, SpinsUpWithItsJoint) {
  World world = geared_rod();
  world.gravity = Vec3::Zero();
  Bench run("lanes", world);
  const double inertia = 2 * run.model().bodies[0].armature;
  run.tau(0, 0) = 0.5;
  run.run(0.5, 1e-3, [] {});
  EXPECT_NEAR(run.v()[0], 0.5 * 0.5 / inertia, 1e-12);
}

// The audit knows the rotors' energy: LINKS with geared drives flies with its energy and its momentum, which rotors
// have no part in.
TEST(Rotor, KeepsEnergyAndMomentumOfFreeFlight) {
  World world = busy_world();
  world.objects.clear();
  world.contact.ignore = {{"*", "*"}};
  world.gravity = Vec3::Zero();
  world.initial.angular_velocity = Vec3(3, -2, 5);
  for (Joint& joint : world.robot.joints) {
    world.initial.joint_velocity[joint.name] = 10;
    joint.lower = -1e9, joint.upper = 1e9;
    joint.gear = 50, joint.rotor_inertia = 1e-7;  // 2.5e-4 kg m^2: what a leg has
  }
  Bench run("lanes", world);
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const double start = physics.energy(0);
  EXPECT_GT(start, 0.5 * 12 * 2.5e-4 * 100) << "the rotors alone";
  const Eigen::VectorXd before = momentum(run);
  run.run(0.5, 1e-3, [&] { EXPECT_NEAR(physics.energy(0), start, 1e-12 * start); });
  EXPECT_EQ(run.fault(), "");
  EXPECT_LT((momentum(run) - before).norm(), 1e-13);
}

// A geared arm that swings under gravity keeps its energy to the first order of the step, without growth.
TEST(Rotor, KeepsEnergyUnderGravity) {
  double error[2];
  for (int i = 0; i < 2; ++i) {
    const double h = i == 0 ? 1e-3 : 5e-4;
    World world = geared_rod();
    world.initial.joint_position["hinge"] = 1.5;
    Bench run("lanes", world);
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0);
    error[i] = 0;
    run.run(5, h, [&] { error[i] = std::max(error[i], std::abs(physics.energy(0) - start)); });
    EXPECT_EQ(run.fault(), "");
  }
  EXPECT_NEAR(error[0] / error[1], 2, 0.1);
  EXPECT_LT(error[0], 0.02);
}

// Bullet's multibodies have no such term: a model with rotors is refused, not simulated without them.
TEST(Rotor, IsRefusedByBullet) {
  try {
    make_physics("bullet", compile(geared_rod()));
    ADD_FAILURE() << "taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("joint hinge has one; take lanes"), std::string::npos) << error.what();
  }
}

// A state that is not finite is contained in its lane and named.
TEST(Fault, IsNamedAndStaysInItsLane) {
  const Particle good = busy_particle(1);
  Particle bad = busy_particle(2);
  bad.initial.v[0] = std::numeric_limits<double>::quiet_NaN();
  LanePhysics physics(good.model), quiet(good.model);
  physics.start(0, good);
  physics.start(1, bad);
  quiet.start(0, good);
  const BlockArray tau(good.model.na());
  for (int k = 0; k < 50; ++k) {
    physics.step(1e-3, LaneMask::first(2), tau);
    quiet.step(1e-3, LaneMask::first(1), tau);
  }
  EXPECT_FALSE(physics.fault(0));
  ASSERT_TRUE(physics.fault(1));
  EXPECT_NE(physics.fault(1)->find("finite"), std::string::npos);
  for (int i = 0; i < good.model.nq; ++i) EXPECT_EQ(physics.state().q(i, 0), quiet.state().q(i, 0));
}

}  // namespace
}  // namespace graze::test
