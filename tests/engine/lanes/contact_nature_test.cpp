// Claims: each contact model of the lane engine has the nature that docs/physics.md states, in numbers, under each
// solver, and all three agree on what Coulomb says of sliding and rolling, to first order in the step.

#include <gtest/gtest.h>

#include "tests/engine/lanes/solvers.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

constexpr double kSink = 0.5e-3;  // m, of all mass on one point's spring (lane_engine.cpp)

class Nature : public testing::TestWithParam<ContactChoice> {
 protected:
  /// On a plane, `low` above (m) where the rigid models touch it.
  World on_plane(const Shape& shape, double z, double mu, double low) const {
    World world = free_body(shape, 1);
    world.objects.push_back(fixed("ground", plane()));
    GetParam().apply_to(world.contact);
    world.contact.friction = mu;
    world.initial.position = {0, 0, z + low};
    return world;
  }
  /// Gap (m) at which a body with `points` contacts slides at v without rising or falling.
  double steady(double h, double mu, double v, int points) const {
    if (GetParam().model == "complementarity_free") return h * mu * v;
    return GetParam().model == "compliant" ? -kSink / points : 0;
  }
  World sliding_block(double h, double mu, double v) const {
    World world = on_plane(box(0.2, 0.2, 0.04), 0.02, mu, steady(h, mu, v, 4));
    world.initial.linear_velocity = {v, 0, 0};
    return world;
  }
};
INSTANTIATE_TEST_SUITE_P(Models, Nature, testing::ValuesIn(contact_choices()), name_of_choice);

// The gap of what slides: zero; h mu |v_t| for the convex model; -m g / k for the spring. At rest: zero, zero, -m g /
// k.
TEST_P(Nature, GapWhileSlidingAndAtRest) {
  const double h = 1e-3, mu = 0.3, v = 1;
  Bench run(std::string("lanes"), sliding_block(h, mu, v));
  run.run(0.2, h);
  // The convex model's gap closes as the block slows, at h mu (mu g), which relieves it once of mu times that.
  const double relief = GetParam().model == "complementarity_free" ? mu * h * mu * mu * kGravity : 0;
  const double now = v - mu * kGravity * 0.2 + relief;
  EXPECT_NEAR(run.v(3), now, 1e-6);
  for (const Contact& c : run.contacts()) EXPECT_EQ(c.mode, ContactMode::slip);
  // The spring's front corners carry more by the moment of friction; the middle stays.
  EXPECT_NEAR(run.position(0).z() - 0.02, steady(h, mu, now, 4), 2e-6);
  run.run(0.8, h);
  EXPECT_NEAR(run.position(0).z() - 0.02, steady(h, mu, 0, 4), 1e-6);
  EXPECT_LT(run.v().norm(), 1e-6);
  Bench ball(std::string("lanes"), on_plane(sphere(0.05), 0.05, mu, 0));
  ball.run(0.5, h);
  EXPECT_NEAR(ball.position(0).z() - 0.05, steady(h, mu, 0, 1), 1e-8);
  EXPECT_LT(ball.v().norm(), 1e-8);
}

// A sliding block stops after v^2 / (2 mu g); Euler's sum of h v is off by at most h v.
TEST_P(Nature, SlidingBlockStopsWhereCoulombSays) {
  const double h = 1e-3, mu = 0.3, v = 1;
  Bench run(std::string("lanes"), sliding_block(h, mu, v));
  run.run(0.6, h);
  EXPECT_NEAR(run.position(0).x(), v * v / (2 * mu * kGravity), h * v);
  EXPECT_LT(run.v().norm(), 1e-5);
  EXPECT_EQ(run.fault(), "");
}

// A sliding sphere ends rolling at 5/7 of its speed: angular momentum about the ground is kept whatever friction does,
// but for the lever arm, which is off by the gap.
TEST_P(Nature, SlidingSphereEndsRolling) {
  const double h = 1e-3, mu = 0.2, v = 1, r = 0.05, gap = steady(h, mu, v, 1);
  World world = on_plane(sphere(r), r, mu, gap);
  world.initial.linear_velocity = {v, 0, 0};
  Bench run(std::string("lanes"), world);
  run.run(1.0, h);
  const double off = 1e-4 + v * std::abs(gap) / r;
  EXPECT_NEAR(run.v(3), 5.0 / 7 * v, off);
  EXPECT_NEAR(run.v(1) * r, run.v(3), off);
  EXPECT_EQ(run.fault(), "");
}

// Halving the step halves the error, of a block that slides and of a sphere that rolls down a slope.
TEST_P(Nature, HalvingTheStepHalvesTheError) {
  const double mu = 0.3, v = 1, t = 0.2;
  std::vector<double> slid, rolled;
  for (double h : {2e-3, 1e-3, 0.5e-3}) {
    Bench block(std::string("lanes"), sliding_block(h, mu, v));
    block.run(t, h);
    slid.push_back(block.position(0).x());
    World world = on_plane(sphere(0.05), 0.05, mu, steady(h, mu, 0, 1));
    world.gravity = {0.3 * kGravity, 0, -kGravity};
    Bench ball(std::string("lanes"), world);
    ball.run(t, h);
    rolled.push_back(ball.position(0).x());
  }
  EXPECT_NEAR((slid[0] - slid[1]) / (slid[1] - slid[2]), 2, 0.1);
  EXPECT_NEAR((rolled[0] - rolled[1]) / (rolled[1] - rolled[2]), 2, 0.1);
  EXPECT_NEAR(rolled[2], 0.5 * 5 / 7 * 0.3 * kGravity * t * (t + 0.5e-3), 0.02 * rolled[2]);
}

}  // namespace
}  // namespace graze::test
