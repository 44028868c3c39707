// Claim: links that begin in each other are pushed apart at no more than the recovery speed, and by a motion that is
// never part of the velocity: no energy and no momentum comes of it. What cannot part stays where it is, without large
// impulses, and nothing whirls about where a contact stands badly to its joint.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

constexpr double kRecoverySpeed = 0.1;  // m/s (docs/physics.md)
constexpr double kDepth = 0.02;         // m

class Overlapping : public testing::TestWithParam<std::string> {
 protected:
  bool compliant() const { return GetParam() == "compliant"; }
  /// m: a spring takes over where it carries the world's weight twice.
  double left() const { return compliant() ? 1e-3 + 1e-5 : 2e-6; }
  /// J: what such a spring, on which the world's weight sinks in by half a millimetre, still gives.
  double gain(double mass) const { return compliant() ? 0.5 * mass * kGravity / 0.5e-3 * 1e-6 : 1e-7; }

  World empty() const {
    World world;
    world.robot.floating_base = false;
    world.robot.links.push_back(link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false));
    world.gravity = Vec3::Zero();
    world.contact.model = GetParam();
    return world;
  }
  /// Two balls of 0.2 kg on arms of 30 cm beside each other, `kDepth` in each other.
  World fingers() const {
    World world = empty();
    for (const auto& [name, y] : {std::pair("left", 0.1 - kDepth), std::pair("right", 0.0)}) {
      world.robot.links.push_back(link(name, sphere(0.05), 0.2, at(0.3, 0, 0)));
      world.robot.joints.push_back(
          joint(std::string("j_") + name, "base", name, JointType::revolute, at(0, y, 0), Vec3::UnitZ()));
    }
    return world;
  }
};
INSTANTIATE_TEST_SUITE_P(Models, Overlapping, testing::ValuesIn(lane_contact_models()),
                         [](const auto& info) { return info.param; });

double deepest(const Bench& run) {
  double out = 0;
  for (const Contact& c : run.contacts()) out = std::max(out, -c.phi);
  return out;
}

Vec3 centre_of_mass(const Bench& run) {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (int i = 0; i < static_cast<int>(run.model().bodies.size()); ++i) {
    const Body& body = run.model().bodies[i];
    sum += body.mass * (run.position(i) + run.rotation(i) * body.com);
    mass += body.mass;
  }
  return sum / mass;
}

/// Runs and watches: no energy (J) above that of the start and `gain`, no faster way out than the recovery.
void watch_out(Bench& run, double seconds, double gain) {
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const double h = 1e-3, start = physics.energy(0);
  double before = 0, highest = start;
  run.run(seconds, h, [&] {
    const double now = deepest(run);
    if (before > 2e-3) {
      EXPECT_LE(before - now, 1.01 * kRecoverySpeed * h);
    }
    before = now;
    highest = std::max(highest, physics.energy(0));
  });
  EXPECT_LE(highest, start + gain);
  EXPECT_EQ(run.fault(), "");
}

// 2 cm at 0.1 m/s and less take from 0.2 s on.
TEST_P(Overlapping, FingersPartWithoutEnergy) {
  Bench run("lanes", fingers());
  run.step(1e-3);
  EXPECT_NEAR(deepest(run), kDepth, 1e-9);
  watch_out(run, 0.15, gain(0.4));
  EXPECT_GT(deepest(run), 0.2 * kDepth);
  watch_out(run, 0.35, gain(0.4));
  EXPECT_LE(deepest(run), left());
}

// A floating robot's centre of mass stays while its fingers part, and its base does not turn on.
TEST_P(Overlapping, AFloatingRobotKeepsItsMomentum) {
  World world = fingers();
  world.robot.floating_base = true;
  Bench run("lanes", world);
  const Vec3 start = centre_of_mass(run);
  watch_out(run, 0.5, gain(1.4));
  EXPECT_LE(deepest(run), left());
  EXPECT_LT((centre_of_mass(run) - start).norm(), 1e-9);
  if (!compliant()) {
    EXPECT_LT(run.v().norm(), 1e-3);
  }
}

// The normal passes a hinge at a tenth of a millimetre: 0.1 m/s there were 1000 rad/s.
TEST_P(Overlapping, NothingWhirlsAboutItsHinge) {
  World world = empty();
  world.robot.links.push_back(link("wheel", sphere(0.05), 0.2, at(1e-4, 0, 0)));
  world.robot.joints.push_back(
      joint("axle", "base", "wheel", JointType::revolute, at(0, 0.1 - kDepth, 0), Vec3::UnitZ()));
  world.robot.links.push_back(link("arm", sphere(0.05), 0.2));
  world.robot.joints.push_back(joint("lock", "base", "arm", JointType::revolute, Pose::Identity(), Vec3::UnitZ()));
  world.robot.joints.back().lower = world.robot.joints.back().upper = 0;
  Bench run("lanes", world);
  double before = run.q(0), fastest = 0;
  run.run(1.0, 1e-3, [&] {
    fastest = std::max(fastest, std::abs(run.q(0) - before) / 1e-3);
    before = run.q(0);
  });
  EXPECT_LE(fastest, 1.01);  // rad/s
  EXPECT_LT(std::abs(run.v(0)), 1e-2);
  EXPECT_EQ(run.fault(), "");
}

// Balls at one place, each about a hinge through its own centre: no turn parts them, and what rounding leaves of their
// levers while the robot tumbles must not be pressed on.
TEST_P(Overlapping, BallsOnTheirHingesAreLeftAlone) {
  World world = empty();
  world.robot.floating_base = true;
  for (const auto& [name, axis] :
       {std::pair("thumb", Vec3(1, 2, 3)), std::pair("index", Vec3(-2, 1, 1)), std::pair("others", Vec3(1, -1, 2))}) {
    world.robot.links.push_back(link(name, sphere(0.001), 0.05));
    world.robot.joints.push_back(
        joint(std::string("j_") + name, "base", name, JointType::revolute, at(0.11, 0.07, -0.03), axis.normalized()));
  }
  world.initial.linear_velocity = {0.1, 0.2, -0.3};
  world.initial.angular_velocity = {1, 2, -3};
  Bench run("lanes", world);
  auto& physics = dynamic_cast<LanePhysics&>(run.physics());
  const double energy = physics.energy(0);
  double largest = 0;
  run.run(0.5, 1e-3, [&] { largest = std::max(largest, run.contact_impulse().norm()); });
  EXPECT_EQ(run.fault(), "");
  EXPECT_EQ(largest, 0);
  EXPECT_NEAR(physics.energy(0), energy, 1e-3 * energy);
}

// A slider between two posts that it is in both of, free and held by equal limits: it can part from neither.
TEST_P(Overlapping, WhatIsWedgedStays) {
  for (const double limit : {1.0, 0.0}) {
    World world = empty();
    for (const auto& [name, y] :
         {std::pair("left", 0.1 - kDepth), std::pair("right", kDepth - 0.1), std::pair("slider", 0.0)}) {
      world.robot.links.push_back(link(name, sphere(0.05), 0.2));
      world.robot.joints.push_back(
          joint(std::string("j_") + name, "base", name, JointType::prismatic, at(0, y, 0), Vec3::UnitY()));
      const double reach = std::string(name) == "slider" ? limit : 0;
      world.robot.joints.back().lower = -reach, world.robot.joints.back().upper = reach;
    }
    world.initial.joint_velocity["j_slider"] = limit > 0 ? 0.1 : 0;
    Bench run("lanes", world);
    double largest = 0;
    run.run(1.0, 1e-3, [&] { largest = std::max(largest, run.contact_impulse().norm()); });
    EXPECT_LT(run.q().norm(), 1e-3) << limit;
    EXPECT_LT(run.v().norm(), 1e-3) << limit;
    EXPECT_LT(largest, 0.2 * 0.1 * 1.01) << limit;  // N s: what stops the slider
    EXPECT_EQ(run.fault(), "");
  }
}

// Hinges that stand on the ground while their balls part: the push neither lifts nor sinks what rests.
TEST_P(Overlapping, WhatRestsOnTheGroundStays) {
  World world = fingers();
  world.robot.floating_base = true;
  world.robot.links[0].collisions.push_back({"base", box(0.4, 0.4, 0.1), Pose::Identity()});
  world.robot.links[0].inertia = MassMoments::of_shape(box(0.4, 0.4, 0.1), 20 / (0.4 * 0.4 * 0.1));
  for (Joint& each : world.robot.joints) each.X_PJ.translation().z() = 0.2, each.damping = 1;
  world.objects.push_back(fixed("ground", plane()));
  world.gravity = {0, 0, -kGravity};
  world.initial.position = {0, 0, 0.05};
  Bench run("lanes", world);
  run.run(1.0, 1e-3, [&] { EXPECT_NEAR(run.position(0).z(), 0.05, 1e-3); });
  EXPECT_LT(run.v().norm(), 1e-2);
  EXPECT_LT(run.position(0).head<2>().norm(), 1e-3);
  EXPECT_LE(deepest(run), compliant() ? 1.1e-3 : 1e-5);
  EXPECT_EQ(run.fault(), "");
}

}  // namespace
}  // namespace graze::test
