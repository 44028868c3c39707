// Claims: what makes contact solvers fail leaves the lane engine's three models sound under each solver: no state that
// is not finite, no fault, no energy out of nothing, bounded overlap.

#include <gtest/gtest.h>

#include "tests/engine/lanes/solvers.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

class Robust : public testing::TestWithParam<ContactChoice> {
 protected:
  World on_plane(const Shape& shape, double mass, double z, double friction = 0.8) const {
    World world = free_body(shape, mass);
    world.objects.push_back(fixed("ground", plane()));
    GetParam().apply_to(world.contact);
    world.contact.friction = friction;
    world.initial.position = {0, 0, z};
    return world;
  }
  bool compliant() const { return GetParam().model == "compliant"; }
  bool convex() const { return GetParam().model == "complementarity_free"; }

  /// Runs and watches: finite, no fault, energy (J) never above its start and `gain`, no overlap beyond `deep` (m).
  static void watch(Bench& run, double seconds, double h, double gain, double deep) {
    auto& physics = dynamic_cast<LanePhysics&>(run.physics());
    const double start = physics.energy(0);
    double highest = start, deepest = 0;
    run.run(seconds, h, [&] {
      highest = std::max(highest, physics.energy(0));
      for (const Contact& c : run.contacts()) deepest = std::max(deepest, -c.phi);
    });
    EXPECT_TRUE(run.q().allFinite() && run.v().allFinite());
    EXPECT_EQ(run.fault(), "");
    EXPECT_LE(highest, start + gain);
    EXPECT_LE(deepest, deep);
  }
};
INSTANTIATE_TEST_SUITE_P(Models, Robust, testing::ValuesIn(contact_choices()), name_of_choice);

// A thousand times heavier on lighter, and the reverse. (The spring of `compliant` is sized for the whole mass, so it
// yields by half a millimetre at each of four corners at most.) Sweeps end before such a stack is solved, so the heavy
// box sinks in a little and is raised again, no faster than the recovery speed of 0.1 m/s: the stated gain.
TEST_P(Robust, MassRatioOfAThousand) {
  for (bool heavy_above : {true, false}) {
    World world = on_plane(box(0.2, 0.2, 0.1), heavy_above ? 0.01 : 10, 0.05);
    world.objects.push_back(movable("load", box(0.2, 0.2, 0.1), heavy_above ? 10 : 0.01, at(0, 0, 0.15)));
    Bench run(std::string("lanes"), world);
    watch(run, 0.5, 1e-3, 0.5 * 10.01 * 0.1 * 0.1, 1e-3);
    EXPECT_NEAR(run.position(0).z(), 0.05, 1e-3) << heavy_above;
    EXPECT_NEAR(run.position(1).z(), 0.15, 2e-3) << heavy_above;
  }
}

// A tower of boxes of 1 g and of 1000 kg by turns stands: Newton's method solves it, where sweeps alone end at their
// bound in every step. Of Coulomb's law by the corrected convex one.
TEST_P(Robust, MassRatioOfAMillion) {
  if (GetParam().solver.name == "sweeps") return;
  World world = on_plane(box(0.1, 0.1, 0.1), 1e-3, 0.05);
  for (int i = 1; i < 6; ++i) {
    world.objects.push_back(
        movable("box" + std::to_string(i), box(0.1, 0.1, 0.1), i % 2 ? 1000 : 1e-3, at(0, 0, 0.05 + 0.1 * i)));
  }
  Bench run(std::string("lanes"), world);
  watch(run, 0.5, 1e-3, 0.1, 1e-3);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(run.position(i).z(), 0.05 + 0.1 * i, 2e-3) << i;
  EXPECT_LT(run.v().norm(), 1e-2);
}

// A box that starts 1 cm or 4 cm deep comes out without being thrown: rigid models lift it at 0.1 m/s at most, the
// spring gives back no more than its energy (critically damped, so the body stops at the top).
TEST_P(Robust, DeepStartsComeOut) {
  for (double deep : {0.01, 0.04}) {
    Bench run(std::string("lanes"), on_plane(box(0.1, 0.1, 0.1), 0.5, 0.05 - deep));
    double fastest = 0, highest = 0;
    run.run(1.5, 1e-3, [&] {
      fastest = std::max(fastest, run.v(5));
      highest = std::max(highest, run.position(0).z());
    });
    EXPECT_TRUE(run.q().allFinite());
    EXPECT_NEAR(run.position(0).z(), 0.05, 1e-3) << deep;
    if (!compliant()) {
      EXPECT_LE(fastest, 0.1 + 1e-6) << deep;
      EXPECT_LE(highest, 0.05 + 0.1 * 0.1 / (2 * kGravity) + 1e-4) << deep;
    }
    EXPECT_LT(run.v().norm(), 1e-3) << deep;
  }
}

// 10 cm per step onto a plane and a box: the rigid models stop at the surface, also of a box of 2 cm. The spring,
// critically damped at w = sqrt(k/m) = sqrt(g / 0.5 mm), sinks in by at most v / (e w) = 26 cm, so its box is thick,
// and lets go where its force would pull: it throws back at most v / e^2.
TEST_P(Robust, TenCentimetresPerStep) {
  const double v = 100, deepest = v / (std::exp(1) * std::sqrt(kGravity / 0.5e-3)), back = v * std::exp(-2);
  for (bool on_box : {false, true}) {
    World world = on_plane(sphere(0.05), 1, 0.33);
    const double thick = compliant() ? 1 : 0.02;
    if (on_box) world.objects[0] = fixed("ground", box(1, 1, thick), at(0, 0, -0.5 * thick));
    world.initial.linear_velocity = {0, 0, -v};
    Bench run(std::string("lanes"), world);
    watch(run, 0.2, 1e-3, 1e-6, compliant() ? deepest : 1e-6);
    if (compliant()) {
      EXPECT_GT(run.v(5), 0) << on_box;
      EXPECT_LT(run.v(5), back) << on_box;
    } else {
      EXPECT_NEAR(run.position(0).z(), 0.05, 1e-3) << on_box;
    }
  }
}

// Without friction a block keeps its speed; with mu = 10 it stops at once, tipping aside, and a box that is thrown on
// an edge does not gain energy.
TEST_P(Robust, NoFrictionAndFrictionOfTen) {
  World world = on_plane(box(0.2, 0.2, 0.02), 1, 0.01, 0);
  world.initial.linear_velocity = {1, 0.5, 0};
  Bench slides(std::string("lanes"), world);
  watch(slides, 0.5, 1e-3, 1e-6, 1e-3);
  EXPECT_NEAR(slides.v(3), 1, 1e-6);
  EXPECT_NEAR(slides.v(4), 0.5, 1e-6);
  World thrown = on_plane(box(0.1, 0.15, 0.2), 0.7, 0.3, 10);
  thrown.initial.rpy = {0.4, 0.3, 0.2};
  thrown.initial.linear_velocity = {3, 0.5, -1};
  thrown.initial.angular_velocity = {2, -5, 1};
  Bench run(std::string("lanes"), thrown);
  watch(run, 2.0, 1e-3, 1e-6, compliant() ? 0.02 : 1e-3);
}

// A joint whose limits are equal, and one pressed onto a limit, under ten times the weight of what they hold.
TEST_P(Robust, LockedJointsUnderLoad) {
  for (double lower : {0.0, -1.0}) {
    World world;
    world.robot.floating_base = false;
    world.robot.links.push_back(link("base", sphere(0.01), 1, Pose::Identity(), false));
    world.robot.links.push_back(link("arm", box(0.4, 0.02, 0.02), 0.5, at(0.2, 0, 0), false));
    world.robot.links.push_back(link("hand", box(0.2, 0.02, 0.02), 0.05, at(0.1, 0, 0), false));
    world.robot.joints.push_back(joint("hinge", "base", "arm", JointType::revolute, Pose::Identity(), Vec3(0, 1, 0)));
    world.robot.joints.push_back(joint("wrist", "arm", "hand", JointType::revolute, at(0.4, 0, 0), Vec3(0, 1, 0)));
    for (Joint& joint : world.robot.joints) joint.lower = lower, joint.upper = 0;
    GetParam().apply_to(world.contact);
    Bench run(std::string("lanes"), world);
    run.tau(0, 0) = 20;
    run.run(1.0, 1e-3);
    EXPECT_NEAR(run.q(0), 0, 1e-6) << lower;
    EXPECT_NEAR(run.q(1), 0, 1e-6) << lower;
    EXPECT_LT(run.v().norm(), 1e-6) << lower;
    EXPECT_EQ(run.fault(), "");
  }
}

/// A table top on `n` by `m` feet, all rigid: 3 rows of contact for each foot, six degrees of freedom.
World table(const World& floor, int n, int m) {
  World world = floor;
  world.robot.links[0].collisions.clear();
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < m; ++k) {
      const double x = n > 1 ? -0.4 + 0.8 * i / (n - 1) : 0, y = m > 1 ? -0.3 + 0.6 * k / (m - 1) : 0;
      world.robot.links[0].collisions.push_back({"foot" + std::to_string(i * m + k), sphere(0.02), at(x, y, -0.03)});
    }
  }
  return world;
}

// A table on 4 and on 40 feet stands, carries its weight, and does not creep when pushed less than friction holds.
TEST_P(Robust, TableOnFourAndOnFortyFeet) {
  for (const auto& [n, m] : {std::pair{2, 2}, std::pair{8, 5}}) {
    World world = table(on_plane(box(0.9, 0.7, 0.02), 12, 0.05), n, m);
    world.gravity = {0.3 * kGravity, 0, -kGravity};
    Bench run(std::string("lanes"), world);
    watch(run, 0.5, 1e-3, 1e-5, 1e-3);
    EXPECT_NEAR(run.contact_impulse().norm(), 12 * kGravity * std::hypot(1, 0.3) * 1e-3, 1e-4) << n * m;
    EXPECT_LT(std::abs(run.position(0).x()), 1e-4) << n * m;
    EXPECT_NEAR(run.position(0).z(), 0.05, 1e-3);
  }
}

// Five boxes that fall a centimetre each onto the next stand in the end.
TEST_P(Robust, FallingStackStands) {
  World world = on_plane(box(0.2, 0.2, 0.1), 1, 0.06);
  for (int i = 1; i < 5; ++i) {
    world.objects.push_back(
        movable("box" + std::to_string(i), box(0.2, 0.2, 0.1), 1, at(0.005 * i, 0, 0.06 + 0.11 * i)));
  }
  Bench run(std::string("lanes"), world);
  watch(run, 2.0, 1e-3, 1e-6, compliant() ? 5e-3 : 1e-3);
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(run.position(i).z(), 0.05 + 0.1 * i, 3e-3) << i;
    EXPECT_NEAR(run.position(i).x(), 0.005 * i, 3e-3) << i;
  }
  EXPECT_LT(run.v().norm(), 1e-2);
}

}  // namespace
}  // namespace graze::test
