// Claim: a compliant contact is the spring and damper that its pair was given: how deep it carries, how it swings, how
// long it touches and how fast it throws back, against closed forms; each pair and each lane has its own, a saved lane
// keeps its own, and where nothing is given it is the one derived from the mass.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

/// A ball of radius 0.1 m that just touches the ground.
World on_spring(double mass, const ::graze::Spring& spring) {
  World world = free_body(sphere(0.1), mass);
  world.objects.push_back(fixed("ground", plane()));
  world.contact.model = kCompliant;
  world.contact.spring = spring;
  world.initial.position = {0, 0, 0.1};
  return world;
}

double depth(const Bench& run, int body = 0) { return 0.1 - run.position(body).z(); }

TEST(Compliance, SinksByWeightOverStiffness) {
  for (const double k : {500.0, 2e3, 1e5}) {
    Bench run("lanes", on_spring(3, {k, NAN}));  // the damper is critical for 3 kg and k
    run.run(3.0, 1e-3);
    EXPECT_NEAR(depth(run), 3 * kGravity / k, 1e-6 * 3 * kGravity / k) << k;
  }
}

// A box stands on four points, each of which carries a quarter.
TEST(Compliance, IsOfEachPoint) {
  World world = on_spring(3, {2e3, NAN});
  world.robot.links[0] = link("body", box(0.3, 0.3, 0.2), 3);
  Bench run("lanes", world);
  run.run(3.0, 1e-3);
  EXPECT_NEAR(depth(run), 3 * kGravity / (4 * 2e3), 1e-8);
}

// The step is implicit Euler's, v+ = v + h (g - (k x+ + d v+) / m) and x+ = x + h v+, to the digits of the solve. That
// swings about m g / k at the frequency and decay of a damped spring, first order in h.
TEST(Compliance, SwingsAsADampedSpring) {
  const double m = 2, k = 2e3, zeta = 0.05, h = 1e-4, d = 2 * zeta * std::sqrt(k * m), sink = m * kGravity / k;
  Bench run("lanes", on_spring(m, {k, d}));
  const double w = std::sqrt(k / m), decay = zeta * w, swing = w * std::sqrt(1 - zeta * zeta);
  double time = 0, x = 0, v = 0, from_scheme = 0, from_spring = 0;
  run.run(1.0, h, [&] {
    time += h;
    v = (v + h * (kGravity - k / m * x)) / (1 + h * d / m + h * h * k / m);
    x += h * v;
    const double exact =
        sink * (1 - std::exp(-decay * time) * (std::cos(swing * time) + decay / swing * std::sin(swing * time)));
    from_scheme = std::max(from_scheme, std::abs(depth(run) - x));
    from_spring = std::max(from_spring, std::abs(depth(run) - exact));
  });
  EXPECT_LT(from_scheme, 1e-9 * sink);
  // Decay is off by h w^2 / 2: t e^(-zeta w t) of that is largest at 1 / (zeta w), h w / (2 e zeta). Phase: half a
  // step.
  EXPECT_LT(from_spring, (h * w / (2 * std::numbers::e * zeta) + h * w) * sink);
}

// Without gravity a ball that comes at v touches for (pi - 2 asin zeta) / (w sqrt(1 - zeta^2)): then the force, which
// never pulls, has fallen to 0. It leaves at v e^(-zeta w t).
TEST(Compliance, ThrowsBackByItsDamping) {
  const double m = 2, k = 1e4, w = std::sqrt(k / m), h = 1e-5;
  for (const double zeta : {0.0, 0.05, 0.3, 0.7}) {
    World world = on_spring(m, {k, 2 * zeta * std::sqrt(k * m)});
    world.gravity.setZero();
    world.initial.linear_velocity = {0, 0, -1};
    Bench run("lanes", world);
    double touched = 0;
    run.run(0.06, h, [&] { touched += run.contact_impulse().norm() > 0 ? h : 0; });
    const double time = (std::numbers::pi - 2 * std::asin(zeta)) / (w * std::sqrt(1 - zeta * zeta));
    EXPECT_NEAR(touched, time, 2 * h * (1 + w * time)) << zeta;
    EXPECT_NEAR(run.v(5), std::exp(-zeta * w * time), h * w * (1 + w * time)) << zeta;
  }
}

// Soft and hard ground, each with a ball on it: the object's spring, and that of `pairs` above it.
TEST(Compliance, IsOfEachPair) {
  World world = on_spring(3, {1e4, NAN});
  world.objects.push_back(fixed("soft", box(1, 1, 0.2), at(5, 0, -0.1)));
  world.objects[1].spring.stiffness = 1e3;
  world.objects.push_back(movable("ball", sphere(0.1), 3, at(5.3, 0, 0.1)));
  world.objects[0].X_WO.translation().z() = -1;  // out of reach
  world.contact.pairs.push_back({"ball", "soft", NAN, NAN, {5e3, NAN}});
  world.initial.position.x() = 4.7;
  Bench run("lanes", world);
  run.run(3.0, 1e-3);
  EXPECT_NEAR(depth(run, 0), 3 * kGravity / 1e3, 1e-6);
  EXPECT_NEAR(depth(run, 1), 3 * kGravity / 5e3, 1e-6);
}

// Of two objects the softer one gives way.
TEST(Compliance, OfTwoObjectsIsTheSofter) {
  for (const double table : {1e3, 1e5}) {
    World world = on_spring(1, {});
    world.initial.position = {-5, 0, -0.9};
    world.objects.push_back(fixed("table", box(1, 1, 0.2), at(5, 0, -0.1)));
    world.objects.push_back(movable("ball", sphere(0.1), 3, at(5, 0, 0.1)));
    world.objects[0].X_WO.translation().z() = -1;
    world.objects[1].spring.stiffness = table;
    world.objects[2].spring.stiffness = 4e3;
    Bench run("lanes", world);
    run.run(3.0, 1e-3);
    EXPECT_NEAR(depth(run, 1), 3 * kGravity / std::min(table, 4e3), 1e-6) << table;
  }
}

// What the derived numbers are is no second law: written out they give the same bits, and nothing given gives half a
// millimetre.
TEST(Compliance, WrittenOutIsTheDerivedOne) {
  const World derived = on_spring(3, {});
  Bench one("lanes", derived), other("lanes", on_spring(3, default_spring(derived.moving_mass())));
  one.run(0.3, 1e-3);
  other.run(0.3, 1e-3);
  EXPECT_EQ(one.q(), other.q());
  EXPECT_EQ(one.v(), other.v());
  EXPECT_NEAR(depth(one), 0.5e-3, 1e-6);
}

// Rigid models have no springs: no bit of theirs hangs on one.
TEST(Compliance, IsOfTheCompliantModelAlone) {
  for (const std::string& model : lane_contact_models()) {
    World plain = busy_world(model), springs = plain;
    springs.contact.spring = {300, 5};
    Bench one("lanes", plain), other("lanes", springs);
    one.run(0.2, 1e-3);
    other.run(0.2, 1e-3);
    EXPECT_EQ(one.q() == other.q(), model != kCompliant) << model;
  }
}

// The ends of what a spring may be: the hardest is a rigid contact, the softest carries nothing, no number is lost.
TEST(Compliance, HoldsAtItsLimits) {
  for (const ::graze::Spring& spring :
       {::graze::Spring{1e12, 0}, {1e12, 1e12}, {1e-6, 0}, {1e-6, 1e12}, {1e12, NAN}, {1e-6, NAN}}) {
    Bench run("lanes", on_spring(3, spring));
    run.run(0.5, 1e-3);
    EXPECT_EQ(run.fault(), "") << spring.stiffness << " " << spring.damping;
    const bool carries = spring.stiffness > 1 || spring.damping > 1;
    EXPECT_NEAR(depth(run), carries ? 0 : kGravity * 0.5 * 0.501 / 2, carries ? 1e-9 : 1e-3)
        << spring.stiffness << " " << spring.damping;
  }
}

// A lane goes on with the springs that it was saved with, in a lane that had others.
TEST(Compliance, IsSavedWithTheLane) {
  const Particle soft = particle_of(on_spring(2, {500, 3})), hard = particle_of(on_spring(2, {1e5, 30}));
  LanePhysics first(soft.model), second(hard.model);
  first.start(2, soft);
  for (int lane = 0; lane < kLanes; ++lane) second.start(lane, hard);
  LaneMask in_first, in_second = LaneMask::all();
  in_first.set(2);
  const BlockArray tau(soft.model.na());
  for (int k = 0; k < 50; ++k) first.step(1e-3, in_first, tau), second.step(1e-3, in_second, tau);
  second.restore(5, *first.save(2));
  for (int k = 0; k < 300; ++k) first.step(1e-3, in_first, tau), second.step(1e-3, in_second, tau);
  EXPECT_EQ(first.state().q.column(2), second.state().q.column(5));
  EXPECT_EQ(first.state().v.column(2), second.state().v.column(5));
  EXPECT_NE(second.state().q.column(5), second.state().q.column(6));
}

}  // namespace
}  // namespace graze::test
