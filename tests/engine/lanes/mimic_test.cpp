// Claim: a joint that follows another moves with it as in the mechanism of one degree of freedom less, in both back
// ends; what stops the one stops the other; an error of position is taken back at the recovery speed; and none of it
// makes energy.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

constexpr double kRod = 0.4, kMass = 1.2;  // m, kg

void mimic(World& world, const std::string& follower, const std::string& other, double multiplier, double offset) {
  for (Joint& one : world.robot.joints) {
    if (one.name == follower) one.mimic = {other, multiplier, offset};
  }
}

/// A robot on the world with rods that hang from hinges about y, each from the base or from the one before it.
World rods(int count, bool chain, double mass_of_last = kMass) {
  World world;
  world.robot.floating_base = false;
  world.robot.links.push_back(link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false));
  for (int i = 1; i <= count; ++i) {
    const std::string name = "rod" + std::to_string(i);
    const bool on = chain && i > 1;
    world.robot.links.push_back(
        link(name, capsule(0.01, kRod), i == count ? mass_of_last : kMass, at(0, 0, -kRod / 2), false));
    world.robot.joints.push_back(joint("j" + std::to_string(i), on ? "rod" + std::to_string(i - 1) : "base", name,
                                       JointType::revolute, on ? at(0, 0, -kRod) : at(0, 0.2 * i, 0), Vec3::UnitY()));
  }
  return world;
}

/// Inertia of body `i` about its centre, about y.
double about_com(const Model& model, int i) { return model.bodies[i].inertia(1, 1); }

/// q1 of the reduced system at t: M(q) q'' + M'(q) q'^2 / 2 + V'(q) = 0, by RK4 with 1e-4 s; V' and M' by differences.
template <class Mass, class Potential>
double reduced(const Mass& M, const Potential& V, double q, double v, double end) {
  const auto slope = [](const auto& f, double x) { return (f(x + 1e-4) - f(x - 1e-4)) / 2e-4; };
  const auto rate = [&](double x, double u) { return -(0.5 * slope(M, x) * u * u + slope(V, x)) / M(x); };
  const double h = 1e-4;
  for (long i = std::lround(end / h); i > 0; --i) {
    const double a1 = rate(q, v), v2 = v + h / 2 * a1, a2 = rate(q + h / 2 * v, v2);
    const double v3 = v + h / 2 * a2, a3 = rate(q + h / 2 * v2, v3), v4 = v + h * a3, a4 = rate(q + h * v3, v4);
    q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return q;
}

class Mimics : public testing::TestWithParam<const char*> {
 protected:
  bool lanes() const { return std::string(GetParam()) == "lanes"; }

  /// Error of q1 after a second, in steps of h; the follower must be on its line all the time.
  double error_of(const World& world, double h, double truth, int follower, double multiplier, double offset) {
    Bench bench(GetParam(), world);
    double off = 0;
    bench.run(1, h, [&] { off = std::max(off, std::abs(bench.q(follower) - multiplier * bench.q(0) - offset)); });
    EXPECT_EQ(bench.fault(), "");
    EXPECT_LT(off, lanes() ? 1e-12 : 1e-6);
    return bench.q(0) - truth;
  }

  /// First order in the step, or better.
  void expect_converges(const World& world, double truth, int follower, double multiplier, double offset) {
    const double coarse = std::abs(error_of(world, 1e-3, truth, follower, multiplier, offset));
    const double fine = std::abs(error_of(world, 2.5e-4, truth, follower, multiplier, offset));
    EXPECT_LT(coarse, 0.01);
    EXPECT_LT(fine, 0.3 * coarse + 1e-5);
  }
};
INSTANTIATE_TEST_SUITE_P(BothBackEnds, Mimics, testing::Values("lanes", "bullet"));

// Side by side on two branches: inertia I1 + m^2 I2.
TEST_P(Mimics, TwoPendulumsAreOne) {
  const double m = -0.7, o = 0.3;
  World world = rods(2, false, 2.5);
  mimic(world, "j2", "j1", m, o);
  world.initial.joint_position["j1"] = 0.9;
  world.initial.joint_velocity["j1"] = 1.5;
  const Model model = compile(world);
  const double lever = kRod / 2, I1 = about_com(model, 0) + kMass * lever * lever;
  const double I2 = about_com(model, 1) + 2.5 * lever * lever;
  const auto M = [&](double) { return I1 + m * m * I2; };
  const auto V = [&](double q) { return -kGravity * lever * (kMass * std::cos(q) + 2.5 * std::cos(m * q + o)); };
  expect_converges(world, reduced(M, V, 0.9, 1.5, 1), 1, m, o);
}

// One on the other, on one path to the base; and the follower may be the one above.
TEST_P(Mimics, ADoublePendulumIsOne) {
  const double m = 1.6, o = -0.2, lever = kRod / 2;
  World world = rods(2, true);
  const double C = about_com(compile(world), 1), c2 = kMass * lever * lever;
  // Of the angles a of the first rod and b between them.
  const auto mass = [&](double b, double da, double db) {
    const double w = da + db, cross = kMass * kRod * lever * std::cos(b);
    return (C + c2) * da * da + kMass * kRod * kRod * da * da + 2 * cross * da * w + (C + c2) * w * w;
  };
  const auto height = [&](double a, double b) {
    return -kGravity * kMass * (lever * std::cos(a) + kRod * std::cos(a) + lever * std::cos(a + b));
  };
  {
    mimic(world, "j2", "j1", m, o);
    world.initial.joint_position["j1"] = 0.6;
    const auto M = [&](double q) { return mass(m * q + o, 1, m); };
    const auto V = [&](double q) { return height(q, m * q + o); };
    expect_converges(world, reduced(M, V, 0.6, 0, 1), 1, m, o);
  }
  {
    // a = m b + o, so b = (a - o) / m: the line as the lower rod's, in terms of the upper.
    World turned = rods(2, true);
    mimic(turned, "j1", "j2", m, o);
    turned.initial.joint_position["j2"] = 0.6;
    const auto M = [&](double q) { return mass(q, m, 1); };
    const auto V = [&](double q) { return height(m * q + o, q); };
    const double truth = m * reduced(M, V, 0.6, 0, 1) + o;  // of the first rod
    expect_converges(turned, truth, 1, 1 / m, -o / m);
  }
}

/// A palm on the world with two fingers that slide along x, and a box between them.
World gripper(double mass_of_follower) {
  World world;
  world.gravity = Vec3::Zero();
  world.robot.floating_base = false;
  world.robot.links.push_back(link("palm", box(0.2, 0.1, 0.02), 1, Pose::Identity(), false));
  world.robot.links.push_back(link("left", box(0.02, 0.06, 0.06), 0.2, at(-0.06, 0, 0.1)));
  world.robot.links.push_back(link("right", box(0.02, 0.06, 0.06), mass_of_follower, at(0.06, 0, 0.1)));
  for (const char* side : {"left", "right"}) {
    world.robot.joints.push_back(joint(side, "palm", side, JointType::prismatic, Pose::Identity(), Vec3::UnitX()));
  }
  mimic(world, "right", "left", -1, 0);
  world.objects.push_back(movable("load", box(0.06, 0.04, 0.04), 0.1, at(0.01, 0, 0.1)));
  world.contact.friction = 0.8;
  return world;
}

// Two fingers squeeze a box evenly, wherever it begins, and be the follower as light as it may: the force of the one
// drive is shared.
TEST_P(Mimics, AGripperSqueezesEvenly) {
  for (const double light : {0.2, 1e-3}) {
    Bench bench(GetParam(), gripper(light));
    bench.tau(0, 0) = 10;
    bench.run(0.5, 1e-3);
    EXPECT_EQ(bench.fault(), "");
    std::array<double, 2> force{};
    for (const Contact& c : bench.contacts())
      force[bench.model().colliders[c.a].name == "left" ? 0 : 1] += c.normal_impulse() / 1e-3;
    for (const double one : force) EXPECT_NEAR(one, 5, lanes() ? 1e-4 : 0.1) << light;
    EXPECT_NEAR(bench.q(1), -bench.q(0), lanes() ? 1e-12 : 1e-4);
    EXPECT_LT(bench.v().cwiseAbs().maxCoeff(), 1e-3);
    EXPECT_NEAR(bench.position(2).x(), 0, 1e-3);  // carried to the middle
  }
}

// A limit of the follower holds the other, and with it what drives that.
TEST_P(Mimics, ALimitStopsBoth) {
  World world = rods(2, false, 0.01);
  world.gravity = Vec3::Zero();
  mimic(world, "j2", "j1", 2, 0.1);
  world.robot.joints[1].upper = 0.5;
  Bench bench(GetParam(), world);
  bench.tau(0, 0) = 1;
  bench.run(1, 1e-3);
  EXPECT_EQ(bench.fault(), "");
  EXPECT_NEAR(bench.q(1), 0.5, 1e-3);
  EXPECT_NEAR(bench.q(0), 0.2, 1e-3);
  EXPECT_LT(std::abs(bench.v(0)), 1e-3);
}

// Off its line at rest, the follower returns at no more than the recovery speed, and all is at rest again.
TEST_P(Mimics, AnErrorIsTakenBack) {
  World world = rods(2, false);
  world.gravity = Vec3::Zero();
  mimic(world, "j2", "j1", 1.5, 0.2);
  for (const double wrong : {0.1, -0.1}) {
    Particle particle = particle_of(world);
    particle.initial.q[1] += wrong;
    Bench bench(GetParam(), particle);
    double before = std::abs(wrong), fastest = 0;
    bench.run(1.2, 1e-3, [&] {
      const double now = std::abs(bench.q(1) - 1.5 * bench.q(0) - 0.2);
      EXPECT_LE(now, before + 1e-12);
      fastest = std::max(fastest, (before - now) / 1e-3);
      before = now;
    });
    EXPECT_EQ(bench.fault(), "");
    EXPECT_LT(before, 1e-6);
    EXPECT_LT(fastest, 0.2001);
    EXPECT_LT(bench.v().cwiseAbs().maxCoeff(), 1e-5);
  }
}

/// J
double kinetic(const Bench& bench, BlockPhysics& physics) {
  double sum = 0;
  for (std::size_t i = 0; i < bench.model().bodies.size(); ++i) {
    const Body& body = bench.model().bodies[i];
    const Mat3 R = physics.state().rotation(static_cast<int>(i), 0);
    Vec3 w = Vec3::Zero(), u = Vec3::Zero();
    for (int j = static_cast<int>(i); j >= 0; j = bench.model().bodies[j].parent) {
      const Body& by = bench.model().bodies[j];
      const Vec3 arm = physics.state().position(static_cast<int>(i), 0) + R * body.com - physics.state().position(j, 0);
      Vec3 turn = Vec3::Zero(), slide = Vec3::Zero();
      if (by.type == JointType::floating) {
        turn = {bench.v(by.v), bench.v(by.v + 1), bench.v(by.v + 2)};
        slide = {bench.v(by.v + 3), bench.v(by.v + 4), bench.v(by.v + 5)};
      } else {
        (by.type == JointType::prismatic ? slide : turn) = physics.state().rotation(j, 0) * by.axis * bench.v(by.v);
      }
      w += turn;
      u += slide + turn.cross(arm);
    }
    sum += 0.5 * (body.mass * u.squaredNorm() + (R.transpose() * w).dot(body.inertia * (R.transpose() * w)));
  }
  return sum;
}

// A free robot that tumbles keeps its energy, on one path and on branches: what the rows do is no work. Where all
// joints stand still for a moment, lanes lose a little that the next steps cannot return, of second order, with mimics
// or not.
TEST_P(Mimics, EnergyDoesNotGrow) {
  for (const bool chain : {false, true}) {
    World world = rods(3, chain);
    world.robot.floating_base = true;
    world.gravity = Vec3::Zero();
    mimic(world, "j2", "j1", -1.3, 0.4);
    mimic(world, "j3", "j1", 0.6, 0);
    world.initial.joint_velocity["j1"] = 4;
    world.initial.angular_velocity = {1, 2, -1};
    std::array<double, 2> lost{};
    for (const int finer : {0, 1}) {
      Bench bench(GetParam(), world);
      const double begin = kinetic(bench, bench.physics());
      bench.run(2, finer ? 2.5e-4 : 1e-3);
      EXPECT_EQ(bench.fault(), "");
      lost[finer] = 1 - kinetic(bench, bench.physics()) / begin;
    }
    if (lanes()) {
      EXPECT_GE(std::min(lost[0], lost[1]), -1e-9) << chain;
      EXPECT_LT(lost[0], 1e-4) << chain;
      EXPECT_LT(lost[1], 0.1 * lost[0] + 1e-9) << chain;
    } else {
      EXPECT_LT(std::abs(lost[0]), 0.02) << chain;
      EXPECT_LT(std::abs(lost[1]), 0.3 * std::abs(lost[0]) + 1e-9) << chain;
    }
  }
}

/// One step of lanes under a drive; returns the torque of its one joint.
double driven(Bench& bench, const Drive& drive, double h) {
  DriveResult result(1);
  LaneMask mask;
  mask.set(0);
  bench.physics().drive(h, mask, drive, result);
  return result.torque(0, 0);
}

// The torque that holds a joint on a prescribed motion moves what follows it as well.
TEST(MimicsOnLanes, APrescribedJointCarriesItsFollower) {
  const double m = -0.7, o = 0.3, lever = kRod / 2, h = 1e-4;
  World world = rods(2, false, 2.5);
  mimic(world, "j2", "j1", m, o);
  world.initial.joint_velocity["j1"] = 1.2;
  Bench bench("lanes", world);
  const double inertia =
      about_com(bench.model(), 0) + kMass * lever * lever + m * m * (about_com(bench.model(), 1) + 2.5 * lever * lever);
  Drive drive(1);
  drive.prescribed(0, 0) = 1;
  drive.lower(0, 0) = -1e3, drive.upper(0, 0) = 1e3;
  for (int i = 1; i <= 10000; ++i) {
    const double t = i * h, q = 0.4 * std::sin(3 * t);
    drive.q(0, 0) = q;
    const double torque = driven(bench, drive, h);
    const double weight = kGravity * lever * (kMass * std::sin(q) + m * 2.5 * std::sin(m * q + o));
    ASSERT_NEAR(torque, weight - inertia * 3.6 * std::sin(3 * t), 0.01) << t;
    ASSERT_NEAR(bench.q(0), q, 1e-12);
    ASSERT_NEAR(bench.q(1), m * q + o, 1e-12);
  }
}

// A stiff servo closes a gripper up to its bound, whose force both fingers share, also where the follower weighs next
// to nothing beside the drive's stiffness, 1e5 N/m.
TEST(MimicsOnLanes, AStiffServoIsShared) {
  for (const double light : {0.2, 1e-3}) {
    Bench bench("lanes", gripper(light));
    Drive drive(1);
    drive.kp(0, 0) = 1e5, drive.kd(0, 0) = 100;
    drive.lower(0, 0) = -8, drive.upper(0, 0) = 8;
    double torque = 0;
    for (int i = 0; i < 500; ++i) {
      drive.q(0, 0) = 0.04;  // within the box
      torque = driven(bench, drive, 1e-3);
      ASSERT_NEAR(bench.q(1), -bench.q(0), 1e-12);
    }
    EXPECT_EQ(bench.fault(), "");
    EXPECT_EQ(torque, 8);
    std::array<double, 2> force{};
    for (const Contact& c : bench.contacts()) {
      force[bench.model().colliders[c.a].name == "left" ? 0 : 1] += c.normal_impulse() / 1e-3;
    }
    for (const double one : force) EXPECT_NEAR(one, 4, 1e-3) << light;
  }
}

}  // namespace
}  // namespace graze::test
