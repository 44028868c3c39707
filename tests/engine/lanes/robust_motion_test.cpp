// Claim: whatever tumbles, strikes and is torn at keeps finite and gains no energy but the work done on it.

#include <gtest/gtest.h>

#include <random>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

double mass_of(const Model& model) {
  double mass = 0;
  for (const Body& body : model.bodies) mass += body.mass;
  return mass;
}

/// Runs and expects: finite, no fault, and at no time more energy than it began with and torques put in. `recovered`:
/// what pushing overlaps apart may give. Gravity acts at the new velocity: off by h/2 m g v. `each` sets the torques.
/// `may_end`: the step may be too coarse for what happens, which ends the lane, with the reason, there.
void expect_no_gain(Bench& run, double seconds, double h, double recovered, bool may_end,
                    const std::function<void()>& each) {
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const double start = physics.energy(0), mass = mass_of(run.model()), g = run.model().gravity.norm();
  double given = 0;
  run.run(seconds, h, [&] {
    if (may_end && !run.fault().empty()) return;
    given += physics.work(0);
    // sum of m v <= sqrt(2 m K), with K <= all the energy there is above the ground
    const double lever = h * g * std::sqrt(2 * mass * std::abs(start + std::abs(given)) + mass * mass * g);
    ASSERT_LE(physics.energy(0), start + given + recovered + lever + 1e-9 * std::abs(start));
    each();
  });
  EXPECT_TRUE(may_end || run.fault().empty()) << run.fault();
  EXPECT_TRUE(run.v().allFinite());
}

/// A random branched chain on ground and curb; every third link weighs a thousandth of the others.
World random_chain(std::mt19937& draw) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto axis = [&] { return Vec3(Vec3(unit(draw), unit(draw), unit(draw)).normalized()); };
  World world;
  world.robot.links = {link("l0", box(0.1, 0.15, 0.1), 1, at(0.01, 0, 0.02))};
  for (int i = 1; i < 7; ++i) {
    const Shape shape = i % 2 ? capsule(0.03, 0.1) : sphere(0.03);
    const std::string name = "l" + std::to_string(i), parent = "l" + std::to_string(i / 2);
    world.robot.links.push_back(link(name, shape, i % 3 == 2 ? 1e-3 : 1.0, at(0, 0, -0.1)));
    world.robot.joints.push_back(joint("j" + std::to_string(i), parent, name,
                                       i == 5 ? JointType::prismatic : JointType::revolute,
                                       at(0.05 * unit(draw), 0.05 * unit(draw), -0.15), axis()));
    world.robot.joints.back().lower = i == 5 ? -0.05 : -1.2;
    world.robot.joints.back().upper = i == 5 ? 0.05 : 1.2;
  }
  world.contact.self_collision = false;
  world.objects = {fixed("ground", plane()), fixed("curb", box(1, 0.01, 0.04), at(0.1, 0, 0.02))};
  world.initial.on_ground = true;
  world.initial.clearance = 0.3;
  return world;
}

// Chains with mass ratios of 1000 tumble over a curb at 10 rad/s and more under random torques.
TEST(RobustMotion, UnequalChainsUnderRandomTorquesGainNothing) {
  std::mt19937 draw(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 8; ++trial) {
    World world = random_chain(draw);
    world.initial.angular_velocity = 10 * Vec3(unit(draw), unit(draw), unit(draw));
    SCOPED_TRACE(trial);
    Bench run("lanes", world);
    long k = 0;
    expect_no_gain(run, 1.0, 1e-3, 0.05, false, [&] {
      if (++k % 20) return;
      for (int a = 0; a < run.model().na(); ++a) run.tau(a, 0) = 2e-4 * unit(draw);
    });
  }
}

// The same chains are thrown at the ground with 100 m/s: 10 cm per step. With 30 m/s along the ground besides, some
// light link comes to turn so far in a step that the lane ends: it is named, and until then nothing was gained.
TEST(RobustMotion, ThrownAtAHundredMetresPerSecondGainNothing) {
  std::mt19937 draw(12);
  for (int trial = 0; trial < 8; ++trial) {
    World world = random_chain(draw);
    world.initial.linear_velocity = {trial % 2 ? 30.0 : 0.0, 0, -100};
    SCOPED_TRACE(trial);
    Bench run("lanes", world);
    expect_no_gain(run, 0.3, 1e-3, 0.05, trial % 2 == 1, [] {});
  }
}

// Legs that spin at hundreds of rad/s keep their energy as slow ones do.
TEST(RobustMotion, FastLegsKeepTheirEnergy) {
  World world = busy_world();
  world.objects.clear();
  world.contact.ignore = {{"*", "*"}};
  world.gravity = Vec3::Zero();
  for (Joint& joint : world.robot.joints) {
    world.initial.joint_velocity[joint.name] = 200;  // shins: 400 rad/s
    joint.lower = -1e9, joint.upper = 1e9;
  }
  Bench run("lanes", world);
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const double start = physics.energy(0);
  run.run(0.2, 1e-3, [&] {
    if (run.fault().empty()) {
      EXPECT_NEAR(physics.energy(0), start, 1e-3 * start);
    }
  });
  EXPECT_TRUE(run.v().allFinite());
  EXPECT_TRUE(run.fault().empty() || run.fault().find("eighth of a turn") != std::string::npos) << run.fault();
}

// Torques turn fast legs back within one step against dampers that are stiff for their inertia. The mean speed has the
// torques take more than there is, and the dampers, whose torque is that of the end, give it: nothing came out of it.
TEST(RobustMotion, DampersThatTorquesTurnBackAreNoFault) {
  World world = busy_world();
  world.objects.clear();
  for (Joint& joint : world.robot.joints) {
    joint.lower = -1e9, joint.upper = 1e9, joint.damping = 0.5;
    const double sign = world.initial.joint_position[joint.name] > 0 ? 1 : -1;
    world.initial.joint_velocity[joint.name] = sign * (joint.name.ends_with("Y_3") ? -100 : 65);
    if (joint.name.ends_with("X_1")) world.initial.joint_velocity[joint.name] = 0;
  }
  Bench run("lanes", world);
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const auto driven = [&](int a) { return run.model().bodies[static_cast<std::size_t>(run.model().actuated[a])].v; };
  std::vector<double> speed;
  for (int a = 0; a < run.model().na(); ++a) {
    speed.push_back(run.v(driven(a)));
    run.tau(a, 0) = speed.back() == 0 ? 0 : std::copysign(7.3, -speed.back());
  }
  const double start = physics.energy(0);
  run.step(1e-3);
  EXPECT_EQ(run.fault(), "");
  EXPECT_LT(physics.energy(0), start - 0.5);
  int turned = 0;
  for (int a = 0; a < run.model().na(); ++a) turned += run.v(driven(a)) * speed[static_cast<std::size_t>(a)] < 0;
  EXPECT_GE(turned, 4);
}

// A chain of alternately 1 kg and 1 g links falls from the horizontal and keeps its energy to the first order of
// gravity.
TEST(RobustMotion, AnUnequalPendulumKeepsItsEnergy) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false)};
  for (int i = 0; i < 6; ++i) {
    const std::string name = "link" + std::to_string(i), parent = i ? "link" + std::to_string(i - 1) : "base";
    world.robot.links.push_back(link(name, box(0.02, 0.03, 0.2), i % 2 ? 1.0 : 1e-3, at(0, 0, -0.1), false));
    world.robot.joints.push_back(joint("j" + std::to_string(i), parent, name, JointType::revolute,
                                       at(0, 0, i ? -0.2 : 0), i % 2 ? Vec3::UnitX() : Vec3::UnitY()));
  }
  world.initial.joint_position = {{"j0", 1.5}, {"j1", 0.4}, {"j3", -0.5}};
  double drift[2];
  for (int k = 0; k < 2; ++k) {
    Bench run("lanes", world);
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0), scale = 3 * kGravity * 1.2;
    drift[k] = 0;
    run.run(0.5, 1e-3 / (1 << k), [&] { drift[k] = std::max(drift[k], std::abs(physics.energy(0) - start) / scale); });
    EXPECT_EQ(run.fault(), "");
  }
  EXPECT_LT(drift[0], 0.02);
  EXPECT_NEAR(drift[0] / drift[1], 2, 0.3);
}

}  // namespace
}  // namespace graze::test
