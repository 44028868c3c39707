// Claim: where many contacts hang together the solver satisfies each contact model's own law (Signorini, Coulomb and
// maximum dissipation, or the cones of the convex model), measured by projection (engine/contact/residuals.h), below
// 1e-6 m/s in 99.99 % of the steps. It ends by its last change of a velocity, and a residual may be five times that
// where contacts share a body, so its tolerance of changes is 3e-7 m/s. One exception, a chain that lies limp under
// `complementarity`, is stated below.

#include <gtest/gtest.h>

#include "tests/engine/lanes/worlds.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

/// Eight particles of a world: friction 0.5 to 1.2 unless it is given, masses within 10 %, joints within `spread` rad.
class Measured {
 public:
  Measured(const World& world, double spread, double friction = NAN)
      : nominal_(particle_of(world)),
        q_(nominal_.model.nq),
        v_(nominal_.model.nv),
        a_(nominal_.model.nv),
        X_(12 * static_cast<int>(nominal_.model.bodies.size())),
        tau(nominal_.model.na()),
        engine_(nominal_.model, kernel_of(chosen_isa()), {q_.row(0), v_.row(0), a_.row(0), X_.row(0)}) {
    engine_.block().settings.measure = true;
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto draw = [&](const std::string& name) { return uniform(7, lane, name_hash(name), 0); };
      Particle particle = nominal_;
      for (Body& body : particle.model.bodies) {
        const double factor = 1 + 0.1 * (2 * draw(body.name) - 1);
        body.mass *= factor;
        body.inertia *= factor;
      }
      for (ColliderPair& pair : particle.model.pairs) {
        pair.friction = std::isnan(friction) ? 0.5 + 0.7 * draw("friction") : friction;
      }
      for (int body : particle.model.actuated) {
        particle.initial.q[particle.model.bodies[body].q] += spread * (2 * draw(particle.model.bodies[body].joint) - 1);
      }
      engine_.start(lane, particle.model, particle.initial);
    }
  }

  /// Steps for `seconds`; counts lanes' steps with contact, and those whose residual is above `bound`, m/s.
  void run(double seconds, double bound) {
    for (long k = std::lround(seconds / 1e-3); k > 0; --k) {
      engine_.step(1e-3, LaneMask::all().bits(), tau.row(0));
      for (int lane = 0; lane < kLanes; ++lane) {
        if (engine_.sweeps(lane) == 0) continue;
        const double own = engine_.block().measured[3 * kLanes + lane];
        ++steps;
        above += !(own < bound);
        worst = std::max(worst, own);
      }
    }
  }

  long steps = 0, above = 0;
  double worst = 0;

 private:
  Particle nominal_;
  BlockArray q_, v_, a_, X_;

 public:
  BlockArray tau;

 private:
  LaneEngine engine_;
};

class Residual : public testing::TestWithParam<std::string> {
 protected:
  World world(const Shape& shape, double mass) const {
    World out = free_body(shape, mass);
    out.objects.push_back(fixed("ground", plane()));
    out.contact.model = GetParam();
    return out;
  }
  /// `share` of the steps may be above the bound.
  static void expect_converged(double seconds, Measured& run, double share = 1e-4) {
    run.run(seconds, 1e-6);
    EXPECT_GT(static_cast<double>(run.steps), 0.8 * kLanes * seconds / 1e-3) << "it touches";
    EXPECT_LE(static_cast<double>(run.above), share * static_cast<double>(run.steps))
        << "worst " << run.worst << " m/s, " << run.steps << " steps";
  }
};
INSTANTIATE_TEST_SUITE_P(Models, Residual, testing::ValuesIn(lane_contact_models()),
                         [](const auto& info) { return info.param; });

// A limp chain of 60 joints that has been let go crooked, one sphere per link.
TEST_P(Residual, OfALyingChainOfSixty) {
  World chain = lying_chain(60);
  chain.contact.model = GetParam();
  Measured run(chain, 0.05);
  expect_converged(GRAZE_SANITIZED ? 0.25 : 1.25, run);  // sanitizers have seen it all by then
}

TEST_P(Residual, OfATableOn64Feet) {
  World table = world(box(0.9, 0.7, 0.02), 12);
  table.robot.links[0].collisions.clear();
  for (int i = 0; i < 64; ++i) {
    const double x = -0.4 + 0.8 / 7 * (i % 8), y = -0.3 + 0.6 / 7 * (i / 8);
    table.robot.links[0].collisions.push_back({"foot" + std::to_string(i), sphere(0.02), at(x, y, -0.03)});
  }
  table.initial.position = {0, 0, 0.055};
  table.initial.rpy = {0.01, 0.02, 0};
  table.initial.linear_velocity = {0.5, 0.2, 0};
  table.gravity = {0.3 * kGravity, 0, -kGravity};
  Measured run(table, 0);
  expect_converged(GRAZE_SANITIZED ? 0.6 : 2.5, run);
}

TEST_P(Residual, OfAStackOfTenBoxes) {
  World stack = world(box(0.2, 0.2, 0.1), 1);
  stack.initial.position = {0, 0, 0.051};
  for (int i = 1; i < 10; ++i) {
    const double aside = i % 2 ? 0.005 : -0.005;
    stack.objects.push_back(
        movable("box" + std::to_string(i), box(0.2, 0.2, 0.1), 1, at(aside, 0, 0.051 + 0.1005 * i)));
  }
  Measured run(stack, 0);
  expect_converged(GRAZE_SANITIZED ? 0.4 : 1.5, run);
}

/// Two fingers on slides of a swinging palm, a kilogram (or a gram) each, and a box of a thousandth (a thousand times)
/// of that between them.
World gripper(const World& floor, double finger, double held) {
  World world = floor;
  Robot& robot = world.robot;
  robot = {};
  robot.name = "gripper";
  robot.floating_base = false;
  robot.links = {link("base", box(0.1, 0.1, 0.02), 1, at(0, 0, 0.5), false),
                 link("palm", box(0.05, 0.1, 0.02), 10 * finger, at(0, 0, -0.1), false),
                 link("left", box(0.03, 0.01, 0.04), finger), link("right", box(0.03, 0.01, 0.04), finger)};
  robot.joints = {joint("wrist", "base", "palm", JointType::revolute, at(0, 0, 0.5), Vec3::UnitY()),
                  joint("close_left", "palm", "left", JointType::prismatic, at(0, 0.025, -0.15), -Vec3::UnitY()),
                  joint("close_right", "palm", "right", JointType::prismatic, at(0, -0.025, -0.15), Vec3::UnitY())};
  world.objects.push_back(movable("held", box(0.03, 0.04, 0.03), held, at(0, 0, 0.345)));
  return world;
}

TEST_P(Residual, OfAGripperThatSqueezesABox) {
  for (const double finger : {1.0, 1e-3}) {
    const double held = 1e-3 / finger;
    const World world = gripper(this->world(sphere(0.1), 1), finger, held);
    Measured run(world, 0, 1.0);
    for (int lane = 0; lane < kLanes; ++lane) {
      run.tau(0, lane) = 0.2 * finger;                                                       // N m: the palm swings
      run.tau(1, lane) = run.tau(2, lane) = 10 * (1 + 0.1 * lane) * std::max(finger, held);  // N
    }
    expect_converged(1.3, run);
  }
}

}  // namespace
}  // namespace graze::test
