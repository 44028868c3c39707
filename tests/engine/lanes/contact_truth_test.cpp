// Claim: contact, limits and dry friction of the lane engine move bodies as mechanics says, against closed forms, under
// each of its solvers. Tolerances are the first-order error of semi-implicit Euler at the step used, or rounding where
// the scheme is exact.

#include <gtest/gtest.h>

#include "tests/engine/lanes/solvers.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

class ContactTruth : public testing::TestWithParam<NamedSolver> {
 protected:
  World on_plane(const Shape& shape, double mass, double slope = 0) const {
    World world = free_body(shape, mass);
    world.objects.push_back(fixed("ground", plane()));
    world.gravity = {kGravity * std::sin(slope), 0, -kGravity * std::cos(slope)};
    world.contact.model = "complementarity";
    world.contact.solver = GetParam().solver;
    return world;
  }
};
INSTANTIATE_TEST_SUITE_P(Solvers, ContactTruth, testing::ValuesIn(contact_solvers()), name_of_solver);

// A block that slides with v stops after v^2 / (2 mu g) (exactly v (v + mu g h) / (2 mu g) for this scheme, to a step).
TEST_P(ContactTruth, StopsASlidingBlock) {
  World world = on_plane(box(0.2, 0.2, 0.05), 2);
  world.contact.friction = 0.4;
  world.initial.position = {0, 0, 0.025};
  world.initial.linear_velocity = {1.2, 0.5, 0};
  Bench run("lanes", world);
  run.run(1.0, 1e-3);
  const double v = std::hypot(1.2, 0.5), way = v * v / (2 * 0.4 * kGravity);
  EXPECT_NEAR(std::hypot(run.position(0).x(), run.position(0).y()), way, v * 1e-3);
  EXPECT_NEAR(run.position(0).y() / run.position(0).x(), 0.5 / 1.2, 1e-3) << "no direction is preferred";
  EXPECT_LT(run.v().norm(), 1e-6);
}

// A block on a slope stays below atan(mu) and accelerates with g (sin - mu cos) above.
TEST_P(ContactTruth, HoldsBelowTheAngleOfFriction) {
  for (const char* model : {"complementarity", "complementarity_free"}) {
    for (double excess : {-0.01, 0.02}) {
      const double mu = 0.5, slope = std::atan(mu) + excess;
      World world = on_plane(box(0.2, 0.2, 0.05), 2, slope);
      world.contact.model = model;
      world.contact.friction = mu;
      world.initial.position = {0, 0, 0.025};
      Bench run("lanes", world);
      run.run(0.5, 1e-3);
      const double a = kGravity * (std::sin(slope) - mu * std::cos(slope));
      // The convex model lifts a sliding contact by mu |u_t| h per step until it is apart: its known artefact.
      const double tolerance = std::string(model) == "complementarity" ? 1e-5 : 0.03 * std::abs(a);
      EXPECT_NEAR(run.v(3), excess < 0 ? 0 : 0.5 * a, tolerance) << model << " " << excess;
    }
  }
}

// A ball that is set down sliding ends rolling with 5/7 of its speed.
TEST_P(ContactTruth, TurnsSlidingIntoRolling) {
  World world = on_plane(sphere(0.1), 1);
  world.contact.friction = 0.3;
  world.initial.position = {0, 0, 0.1};
  world.initial.linear_velocity = {2, 0, 0};
  Bench run("lanes", world);
  run.run(1.0, 1e-3);
  EXPECT_NEAR(run.v(3), 2 * 5 / 7.0, 1e-6);
  EXPECT_NEAR(run.v(1), run.v(3) / 0.1, 1e-5);
}

// A ball bounces with speeds e^n: heights e^(2n).
TEST_P(ContactTruth, GivesBackItsShareAtEachBounce) {
  const double e = 0.8, height = 1.0;
  World world = on_plane(sphere(0.1), 1);
  world.contact.restitution = e;
  world.robot.links[0].restitution = e;
  world.initial.position = {0, 0, 0.1 + height};
  Bench run("lanes", world);
  const double h = 1e-4;
  double last = 0, expected = std::sqrt(2 * kGravity * height);
  int bounces = 0;
  run.run(3.0, h, [&] {
    const double v = run.v(5);
    if (last < 0 && v > 0 && bounces < 5) {
      expected *= e;
      ++bounces;
      EXPECT_NEAR(v, expected, 4 * bounces * kGravity * h) << bounces;
    }
    last = v;
  });
  EXPECT_EQ(bounces, 5);
}

// A cube that loses nothing along the normals of its corners tumbles on without ever gaining energy. Newton's law of
// restitution alone would give it a fifth in these 5 s under the convex law, where impacts turn the slip round.
TEST_P(ContactTruth, NeverGivesEnergyByRestitution) {
  for (const char* model : {"complementarity", "complementarity_free"}) {
    for (const double friction : {0.0, 0.5}) {
      World world = on_plane(box(0.1, 0.1, 0.1), 1);
      world.contact.model = model;
      world.contact.friction = friction;
      world.contact.restitution = world.robot.links[0].restitution = 1;
      world.initial.position = {0, 0, 1.08};
      world.initial.rpy = {0.3, 0.4, 0.1};
      Bench run("lanes", world);
      const double inertia = 0.1 * 0.1 / 6, at_first = kGravity * 1.08;
      double most = 0, least = 1e9;
      run.run(5.0, 1e-3, [&] {
        const Vec3 turn(run.v(0), run.v(1), run.v(2)), speed(run.v(3), run.v(4), run.v(5));
        const double energy =
            0.5 * (speed.squaredNorm() + inertia * turn.squaredNorm()) + kGravity * run.position(0).z();
        most = std::max(most, energy), least = std::min(least, energy);
      });
      // A step of flight is exact to g h |v| / 2.
      const double of_a_step = 0.5 * kGravity * 1e-3 * std::sqrt(2 * at_first);
      EXPECT_LT(most, at_first + 2 * of_a_step) << model << ", friction " << friction;
      if (friction == 0) {
        EXPECT_GT(least, at_first - 2 * of_a_step) << model;
      }
    }
  }
}

// A fast ball does not pass through the ground: 10 cm per step against a gap of 3 cm.
TEST_P(ContactTruth, IsNeverSteppedOver) {
  World world = on_plane(sphere(0.05), 1);
  world.initial.position = {0, 0, 0.08};
  world.initial.linear_velocity = {0, 0, -100};
  Bench run("lanes", world);
  run.run(0.01, 1e-3, [&] { EXPECT_GT(run.position(0).z(), 0.05 - 1e-6); });
  EXPECT_NEAR(run.position(0).z(), 0.05, 1e-6);
}

// Five boxes stand on each other; the bottom carries all.
TEST_P(ContactTruth, Stands) {
  World world = on_plane(box(0.2, 0.2, 0.1), 1);
  world.initial.position = {0, 0, 0.05};
  for (int i = 1; i < 5; ++i) {
    world.objects.push_back(movable("box" + std::to_string(i), box(0.2, 0.2, 0.1), 1, at(0.01 * i, 0, 0.05 + 0.1 * i)));
  }
  Bench run("lanes", world);
  run.run(0.8, 1e-3);
  double carried = 0;
  const int steps = 200;
  run.run(1e-3 * steps, 1e-3, [&] {
    for (const Contact& contact : run.contacts()) {
      const bool ground =
          run.model().colliders[contact.b].name == "ground" || run.model().colliders[contact.a].name == "ground";
      if (ground) carried += std::abs(contact.impulse_W.z()) / steps;
    }
  });
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(run.position(i).z(), 0.05 + 0.1 * i, 1e-3) << i;
    EXPECT_NEAR(run.position(i).x(), 0.01 * i, 1e-3) << i;
  }
  // The mean, because the sweeps' bound leaves speeds of some mm/s, which each step pushes back.
  EXPECT_NEAR(carried, 5 * kGravity * 1e-3, 0.02 * 5 * kGravity * 1e-3);
}

// A compliant contact sinks in by weight over stiffness: half a millimetre by construction, and comes to rest.
TEST_P(ContactTruth, CarriesTheWeightHalfAMillimetreDeep) {
  World world = on_plane(sphere(0.1), 3);
  world.contact.model = "compliant";
  world.initial.position = {0, 0, 0.1};
  Bench run("lanes", world);
  run.run(1.0, 1e-3);
  EXPECT_NEAR(run.position(0).z(), 0.1 - 0.5e-3, 1e-6);
  EXPECT_LT(run.v().norm(), 1e-6);
}

// A joint stops at its limit and dry friction holds a load below its threshold.
TEST_P(ContactTruth, KeepsItsLimitAndItsDryFriction) {
  World world;
  world.robot.floating_base = false;
  world.robot.links.push_back(link("base", sphere(0.01), 1, Pose::Identity(), false));
  world.robot.links.push_back(link("arm", box(0.4, 0.02, 0.02), 1, at(0.2, 0, 0), false));
  world.robot.joints.push_back(joint("hinge", "base", "arm", JointType::revolute, Pose::Identity(), Vec3(0, 1, 0)));
  world.robot.joints[0].upper = 0.3;
  world.robot.joints[0].lower = -1;
  Bench falls("lanes", world);
  falls.run(2.0, 1e-3, [&] { EXPECT_LT(falls.q(0), 0.3 + 1e-6); });
  EXPECT_NEAR(falls.q(0), 0.3, 1e-6);
  world.robot.joints[0].friction = 1.001 * kGravity * 0.2;  // the load's torque at q = 0
  Bench holds("lanes", world);
  holds.run(0.5, 1e-3);
  EXPECT_NEAR(holds.q(0), 0, 1e-9);
  world.robot.joints[0].friction = 0.5 * kGravity * 0.2;
  Bench slips("lanes", world);
  slips.run(0.01, 1e-3);
  // a = (load - friction) / I with I = m l^2 / 3 (a slender box).
  const double inertia = 1 * (0.4 * 0.4 + 0.02 * 0.02) / 12 + 0.04;
  EXPECT_NEAR(slips.v(0), 0.01 * 0.5 * kGravity * 0.2 / inertia, 1e-4);
}

}  // namespace
}  // namespace graze::test
