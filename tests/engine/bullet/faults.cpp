// Which lanes end as no longer physical, and that they end alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "engine/bullet/energy.h"
#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

class Faults : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, Faults, testing::ValuesIn(physics_names()));

World wheel() {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false),
                       link("wheel", cylinder(0.1, 0.02), 0.5, Pose::Identity(), false)};
  world.robot.joints = {joint("axle", "base", "wheel", JointType::revolute, Pose::Identity(), Vec3::UnitZ())};
  return world;
}

// A torque that is not a number ends its lane with a reason; the lane then stands still and its neighbour goes on as if
// alone.
TEST_P(Faults, ABrokenLaneEndsAlone) {
  const Particle particle = particle_of(wheel());
  const auto pair = make_physics(GetParam(), particle.model), single = make_physics(GetParam(), particle.model);
  pair->start(0, particle);
  pair->start(1, particle);
  single->start(1, particle);
  BlockArray tau(1);
  tau(0, 1) = 0.1;
  for (int k = 0; k < 100; ++k) {
    tau(0, 0) = k == 50 ? std::numeric_limits<double>::quiet_NaN() : 0.1;
    pair->step(1e-3, LaneMask::first(2), tau);
    single->step(1e-3, LaneMask(2), tau);
    EXPECT_EQ(pair->fault(0).has_value(), k >= 50);
    EXPECT_EQ(pair->state().q(0, 1), single->state().q(0, 1));
  }
  EXPECT_EQ(*pair->fault(0), "state is not finite");
  EXPECT_FALSE(pair->fault(1));
  pair->start(0, particle);
  EXPECT_FALSE(pair->fault(0)) << "a fresh particle clears the fault";
}

// Work of an actuator is not unphysical, however fast it makes a wheel, until it turns more than pi/4 per step.
TEST_P(Faults, AFastWheelIsPhysicalUntilItTurnsTooFarPerStep) {
  Bench run(GetParam(), wheel());
  run.tau(0, 0) = 1;
  double fastest = 0;
  for (int k = 0; k < 10000 && run.fault().empty(); ++k) {
    fastest = run.v(0);
    run.step(1e-3);
  }
  EXPECT_GT(fastest, 780);
  EXPECT_LT(fastest, 790);
  EXPECT_THAT(run.fault(), testing::AllOf(testing::HasSubstr("body 'wheel' turns at"),
                                          testing::HasSubstr("more than an eighth of a turn per step")));
}

// No random chain that tumbles over a plane and a curb under random torques is called unphysical.
TEST_P(Faults, TumblingChainsAreNotAccused) {
  std::mt19937 draw(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto axis = [&] { return Vec3(Vec3(unit(draw), unit(draw), unit(draw)).normalized()); };
  for (int trial = 0; trial < 12; ++trial) {
    World world;
    world.robot.links = {link("l0", box(0.1, 0.15, 0.1), 1, at(0.01, 0, 0.02))};
    for (int i = 1; i < 6; ++i) {
      const Shape shape = i % 2 ? cylinder(0.03, 0.15) : sphere(0.03);
      const std::string name = "l" + std::to_string(i), parent = "l" + std::to_string(i / 2);
      world.robot.links.push_back(link(name, shape, 0.1 + 0.08 * unit(draw), at(0, 0, -0.1)));
      world.robot.joints.push_back(joint("j" + std::to_string(i), parent, name,
                                         i == 5 ? JointType::prismatic : JointType::revolute,
                                         at(0.05 * unit(draw), 0.05 * unit(draw), -0.15), axis()));
      world.robot.joints.back().lower = i == 5 ? -0.05 : -1.2;
      world.robot.joints.back().upper = i == 5 ? 0.05 : 1.2;
    }
    world.objects = {fixed("ground", plane()), fixed("curb", box(1, 0.01, 0.04), at(0.1, 0, 0.02))};
    world.contact.restitution = trial % 3 == 0 ? 0.5 : 0;
    world.initial.on_ground = true;
    world.initial.clearance = 0.3;
    world.initial.angular_velocity = 3 * axis();
    Bench run(GetParam(), world);
    long k = 0;
    run.run(1.0, 1e-3, [&] {
      ++k;
      for (int a = 0; a < run.model().na(); ++a) run.tau(a, 0) = 0.2 * std::sin(0.01 * k * (1 + a) + trial);
    });
    EXPECT_EQ(run.fault(), "") << trial;
  }
}

// What small steps create adds up: a body that creeps up by 1 mm a step is caught once it has risen by more than 1 cm.
TEST(EnergyWatch, AddsUpWhatIsCreated) {
  const World body = free_body(box(0.1, 0.1, 0.1), 1.0);
  const Model model = compile(body);
  State state = particle_of(body).initial;
  bullet::EnergyWatch watch(model, bullet::Forest(model, state));
  int steps = 0;
  while (steps < 100) {
    ++steps;
    state.q[6] += 1e-3;
    if (watch.check(bullet::Forest(model, state), {1e-3, 0, 0, 0})) break;
  }
  EXPECT_GE(steps, 10);
  EXPECT_LE(steps, 12);
}

/// The energy check of Bullet's worlds on two states that follow each other, h apart.
std::optional<std::string> judge(const World& world, const State& before, const State& after,
                                 const bullet::StepInput& input) {
  const Model model = compile(world);
  bullet::EnergyWatch watch(model, bullet::Forest(model, before));
  return watch.check(bullet::Forest(model, after), input);
}

// Energy out of nothing is seen: a body that speeds up by itself, that jumps up, or a wheel that gains more than the
// work done on it. The same steps with their cause stated pass.
TEST(EnergyWatch, SeesEnergyOutOfNothing) {
  World body = free_body(box(0.1, 0.1, 0.1), 1.0);
  const Particle start = particle_of(body);
  State moved = start.initial;
  moved.v[3] = 1;
  EXPECT_TRUE(judge(body, start.initial, moved, {1e-3, 0, 0, 0}));
  State raised = start.initial;
  raised.q[6] += 0.011;
  EXPECT_TRUE(judge(body, start.initial, raised, {1e-3, 0, 0, 0}));
  State nudged = start.initial;
  nudged.q[6] += 0.009;
  EXPECT_FALSE(judge(body, start.initial, nudged, {1e-3, 0, 0, 0})) << "less than a lift of 1 cm is tolerated";
  EXPECT_FALSE(judge(body, start.initial, start.initial, {1e-3, 0, 0, 0}));
  EXPECT_FALSE(judge(body, moved, start.initial, {1e-3, 0, 0, 0})) << "losing energy is no fault";

  const World rotor = wheel();
  const Particle still = particle_of(rotor);
  State turning = still.initial;
  turning.v[0] = 200;
  const double energy = 0.5 * still.model.bodies[0].inertia(2, 2) * 200 * 200;
  EXPECT_FALSE(judge(rotor, still.initial, turning, {1e-3, energy, 0, 0}));
  EXPECT_TRUE(judge(rotor, still.initial, turning, {1e-3, 0.3 * energy, 0, 0}));
}

}  // namespace
}  // namespace graze::test
