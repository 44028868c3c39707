// Motion in contact, against closed forms, for every contact model and solver of every back end.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/bullet/worlds.h"
#include "tests/engine/lanes/solvers.h"

namespace graze::test {
namespace {

struct Choice {
  std::string physics, contact;
  NamedSolver solver = {"", ContactSolver::automatic};  // of lanes
};
/// The convex model lifts what slides and the compliant one sinks and does not bounce, by their nature: what holds for
/// them is in tests/engine/lanes.
std::vector<Choice> choices() {
  std::vector<Choice> out;
  for (const std::string& physics : physics_names()) {
    for (const std::string& contact : contact_models_of(physics)) {
      if (contact == "complementarity_free" || contact == "compliant") continue;
      if (physics != "lanes") out.push_back({physics, contact});
      for (const NamedSolver& solver : contact_solvers()) {
        if (physics == "lanes") out.push_back({physics, contact, solver});
      }
    }
  }
  return out;
}

class ContactMotion : public testing::TestWithParam<Choice> {
 protected:
  Bench bench(World world) const {
    world.contact.model = GetParam().contact;
    world.contact.solver = GetParam().solver.solver;
    return Bench(GetParam().physics, world);
  }
};
INSTANTIATE_TEST_SUITE_P(Models, ContactMotion, testing::ValuesIn(choices()), [](const auto& info) {
  const Choice& choice = info.param;
  const std::string solver = choice.solver.name.empty() ? "" : "_" + choice.solver.name;
  return choice.physics + "_" + choice.contact + solver;
});

/// A free body of one shape, `z` above a plane.
World on_plane(const Shape& shape, double mass, double z, double friction) {
  World world = free_body(shape, mass);
  world.objects.push_back(fixed("ground", plane()));
  world.contact.friction = friction;
  world.initial.position = {0, 0, z};
  return world;
}

// A sliding block stops after v^2 / (2 mu g); Euler's sum of h v is off by at most h v. Its feature is the bottom's.
TEST_P(ContactMotion, SlidingBlockStopsWhereCoulombSays) {
  const double mu = 0.3, v = 1.0, h = 1e-3;
  World world = on_plane(box(0.2, 0.2, 0.04), 1.0, 0.02, mu);
  world.initial.linear_velocity = {v, 0, 0};
  Bench run = bench(world);
  int slips = 0;
  run.run(0.2, h, [&] { slips += run.contacts().front().mode == ContactMode::slip; });
  EXPECT_EQ(slips, 200);
  run.run(0.4, h);
  EXPECT_NEAR(run.position(0).x(), v * v / (2 * mu * kGravity), h * v);
  EXPECT_LT(run.v().norm(), 1e-5);
  ASSERT_EQ(run.contacts().size(), 4u);
  for (const Contact& c : run.contacts()) {
    EXPECT_EQ(c.mode, ContactMode::stick);
    EXPECT_TRUE(c.touching());
    EXPECT_EQ(c.feature_a, Feature::vertex);
  }
  EXPECT_EQ(run.fault(), "");
}

// On a slope a little flatter than atan(mu) a block sticks; on a little steeper one it slides at g (sin - mu cos).
TEST_P(ContactMotion, SlopeSticksBelowAndSlipsAboveTheFrictionAngle) {
  const double mu = 0.5, h = 1e-3, t = 1.0;
  for (double more : {-0.02, 0.02}) {
    const double angle = std::atan(mu) + more;
    const Mat3 R = turn(angle, Vec3::UnitY());
    World world = free_body(box(0.2, 0.2, 0.04), 1.0);
    world.objects.push_back(fixed("ground", plane(), at(0, 0, 0, R)));
    world.contact.friction = mu;
    world.initial.position = R * Vec3(0, 0, 0.02);
    world.initial.rpy = {0, angle, 0};
    Bench run = bench(world);
    run.run(t, h);
    const double way = (R.transpose() * run.position(0)).x();
    const double a = kGravity * (std::sin(angle) - mu * std::cos(angle));
    EXPECT_NEAR(way, more < 0 ? 0 : 0.5 * a * t * (t + h), 1e-4) << more;
    EXPECT_EQ(run.contacts().front().mode, more < 0 ? ContactMode::stick : ContactMode::slip);
    EXPECT_EQ(run.fault(), "");
  }
}

// A sphere that starts sliding ends rolling at 5/7 of its speed, whatever mu is, and rolls on for ever.
TEST_P(ContactMotion, SlidingSphereEndsRolling) {
  const double mu = 0.2, v = 1.0, h = 1e-3, r = 0.0085;  // the radius of a LINKS foot
  World world = on_plane(sphere(r), 0.05, r, mu);
  world.initial.linear_velocity = {v, 0, 0};
  Bench run = bench(world);
  const double slide = 2 * v / (7 * mu * kGravity);
  run.run(slide - 0.01, h);
  EXPECT_EQ(run.contacts().front().mode, ContactMode::slip);
  run.run(0.02, h);
  // The step in which slip ends is cut exactly by the solver, so only rounding and its residual remain.
  EXPECT_NEAR(run.v(3), 5.0 / 7 * v, 1e-4);
  run.run(1.0, h);
  EXPECT_NEAR(run.v(3), 5.0 / 7 * v, 1e-4);
  EXPECT_NEAR(run.v(1) * r, run.v(3), 1e-4);
  EXPECT_EQ(run.contacts().front().mode, ContactMode::roll);
  EXPECT_EQ(run.fault(), "");
}

// Newton's restitution: every impact gives back e times the approach, and the heights fall as e^(2n). A ball is seen at
// most one step late, so its height is off by no more than v h per bounce.
TEST_P(ContactMotion, BouncingBall) {
  const double e = 0.8, h = 1e-3, r = 0.05, drop = 1.0;
  World world = on_plane(sphere(r), 0.3, r + drop, 0.5);
  world.contact.restitution = e;
  Bench run = bench(world);
  std::vector<double> heights;
  double before = 0, top = 0;
  int impacts = 0;
  run.run(3.0, h, [&] {
    const double v = run.v(5);
    if (before < -0.1 && v > 0) {
      ++impacts;
      // The mixed-LCP solvers yield 1e-6 m/s per N s (solver.cpp) of the impulse m (1 + e) v.
      EXPECT_NEAR(v, -e * before, 1e-7 - 1.01e-6 * 0.3 * (1 + e) * before);
    }
    if (before > 0 && v <= 0) heights.push_back(run.position(0).z() - r);
    before = v;
    top = std::max(top, run.position(0).z());
  });
  ASSERT_GE(heights.size(), 4u);
  double height = drop, allowed = 0;
  for (int n = 0; n < 4; ++n) {
    allowed = e * e * (allowed + std::sqrt(2 * kGravity * height) * h) + kGravity * h * h;
    height *= e * e;
    EXPECT_NEAR(heights[n], height, allowed) << n;
  }
  EXPECT_LE(top, r + drop);
  EXPECT_EQ(run.fault(), "");
}

// A ball that has bounced itself out lies still.
TEST_P(ContactMotion, BouncingEnds) {
  const double r = 0.05;
  World world = on_plane(sphere(r), 0.3, r + 0.1, 0.5);
  world.contact.restitution = 0.5;
  Bench run = bench(world);
  run.run(2.0, 1e-3);
  EXPECT_NEAR(run.position(0).z(), r, 1e-4);
  EXPECT_LT(run.v().norm(), 1e-3);
}

// What the contacts push in a step is what the momentum gains beyond gravity: the reported impulses are those that
// acted. A box lands on one corner, tumbles and slides.
TEST_P(ContactMotion, ImpulsesAccountForTheMomentum) {
  const double h = 1e-3, mass = 0.7;
  World world = on_plane(box(0.1, 0.15, 0.2), mass, 0.3, 0.6);
  world.initial.rpy = {0.4, 0.3, 0.2};
  world.initial.linear_velocity = {1, 0.5, 0};
  Bench run = bench(world);
  Vec3 before = run.physics().state().v.vec3(3, 0);
  double pressed = 0;
  run.run(1.5, h, [&] {
    const Vec3 now = run.physics().state().v.vec3(3, 0);
    const Vec3 gained = mass * (now - before + Vec3(0, 0, kGravity * h));
    EXPECT_LT((gained - run.contact_impulse()).norm(), 1e-10);
    pressed += run.contact_impulse().z();
    before = now;
    for (const Contact& c : run.contacts()) {
      EXPECT_GE(c.normal_impulse(), -1e-12);
      const Vec3 t = c.impulse_W - c.normal_impulse() * c.n_W;
      // The cone itself for sequential impulse, its circumscribed pyramid for the mixed-LCP solvers. Dantzig's bounds
      // come from normal impulses before friction (solver.h), so they say nothing about the final ones.
      if (GetParam().contact == "dantzig") continue;
      const double share = GetParam().contact == "sequential_impulse" ? 1.0 : std::sqrt(2.0);
      EXPECT_LE(t.norm(), 0.6 * share * c.normal_impulse() + 1e-6);
    }
  });
  EXPECT_GT(pressed, 0.5 * mass * kGravity);
  EXPECT_EQ(run.fault(), "");
}

// Shapes at rest on a plane do not sink, creep, jitter or gain energy, and carry exactly their weight.
TEST_P(ContactMotion, ShapesRestOnAPlane) {
  const double h = 1e-3, mass = 0.2;
  const Mat3 lying = turn(std::acos(0.0), Vec3::UnitY());
  struct Case {
    Shape shape;
    double z;
    Mat3 R;
  };
  for (const Case& c :
       {Case{box(0.1, 0.2, 0.3), 0.15, Mat3::Identity()}, Case{sphere(0.0085), 0.0085, Mat3::Identity()},
        Case{cylinder(0.05, 0.1), 0.05, Mat3::Identity()}, Case{cylinder(0.05, 0.1), 0.05, lying},
        Case{capsule(0.02, 0.1), 0.02, lying}}) {
    World world = free_body(c.shape, mass);
    world.robot.links[0] = link("body", c.shape, mass, at(0, 0, 0, c.R));
    world.objects.push_back(fixed("ground", plane()));
    world.initial.position = {0, 0, c.z};
    Bench run = bench(world);
    run.run(1.0, h);
    EXPECT_LT((run.position(0) - Vec3(0, 0, c.z)).norm(), 1e-6) << static_cast<int>(c.shape.kind);
    EXPECT_LT(run.v().norm(), 1e-5);
    EXPECT_NEAR(run.contact_impulse().z(), mass * kGravity * h, 1e-6 * mass);
    EXPECT_EQ(run.fault(), "");
  }
}

/// A cube of edge 1 as a mesh, with a point inside that is no corner of its hull.
std::shared_ptr<const Mesh> cube() {
  auto mesh = std::make_shared<Mesh>();
  for (int i = 0; i < 8; ++i) {
    mesh->vertices.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
  }
  mesh->vertices.emplace_back(0.1, 0.2, 0.1);
  return mesh;
}

// A mesh rests on a plane and on a box as the box that it is, scaled.
TEST_P(ContactMotion, MeshRestsLikeTheBoxThatItIs) {
  Shape mesh = box(0.1, 0.2, 0.3);
  mesh.kind = ShapeKind::mesh;
  mesh.mesh = cube();
  for (bool on_box : {false, true}) {
    World world = free_body(box(0.1, 0.2, 0.3), 0.5);
    world.robot.links[0].collisions[0].shape = mesh;
    world.objects.push_back(on_box ? fixed("table", box(1, 1, 0.2), at(0, 0, -0.1)) : fixed("ground", plane()));
    world.initial.position = {0, 0, 0.15};
    Bench run = bench(world);
    run.run(1.0, 1e-3);
    // GJK gathers its points over some steps, within which the mesh settles by no more than its depth tolerance.
    EXPECT_LT((run.position(0) - Vec3(0, 0, 0.15)).norm(), on_box ? 1e-3 : 1e-6) << on_box;
    EXPECT_LT(run.v().norm(), on_box ? 1e-2 : 1e-5);
    EXPECT_EQ(run.fault(), "");
  }
}

// Terrain is where its grid says: row along y, column along x, centred on its origin, heights times the factor. A ball
// in the corner of a tilted plane rests on the plane z = slope x when friction holds it.
TEST_P(ContactMotion, HeightfieldLiesWhereItsGridSays) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = 5;
  grid->ny = 3;
  for (int iy = 0; iy < 3; ++iy) {
    for (int ix = 0; ix < 5; ++ix) grid->height.push_back(0.5 + 1.0 * iy + 0.1 * ix);
  }
  // Extent 4 m by 1 m, factor 0.2: z = 0.2 (0.5 + (2 y + 1) + 0.1 (x + 2)).
  Shape terrain = box(4, 1, 0.2);
  terrain.kind = ShapeKind::heightfield;
  terrain.grid = grid;
  const double r = 0.05;
  const Vec3 normal = Vec3(-0.02, -0.4, 1).normalized();
  for (const Vec3& p : {Vec3(0.3, 0.1, 0), Vec3(-1.2, -0.3, 0), Vec3(1.4, 0.2, 0)}) {
    World world = free_body(sphere(r), 0.2);
    world.gravity = -kGravity * normal;  // straight into the slope, so the ball stays where it is put
    world.objects.push_back(fixed("terrain", terrain));
    const Vec3 ground(p.x(), p.y(), 0.2 * (0.5 + 2 * p.y() + 1 + 0.1 * (p.x() + 2)));
    world.initial.position = ground + (r + 0.01) * normal;
    Bench run = bench(world);
    run.run(1.0, 1e-3);
    EXPECT_LT((run.position(0) - (ground + r * normal)).norm(), 1e-4) << p.transpose();
    ASSERT_FALSE(run.contacts().empty());
    EXPECT_LT((run.contacts()[0].n_W - normal).norm(), 1e-3);
    EXPECT_EQ(run.fault(), "");
  }
}

// Movable objects stack: three boxes, one on the other, under a robot that stands on top.
TEST_P(ContactMotion, MovableObjectsStack) {
  World world = on_plane(box(0.1, 0.1, 0.1), 0.5, 0.35, 0.8);
  for (int i = 0; i < 3; ++i) {
    world.objects.push_back(movable("crate" + std::to_string(i), box(0.1, 0.1, 0.1), 0.5, at(0, 0, 0.05 + 0.1 * i)));
  }
  Bench run = bench(world);
  run.run(1.0, 1e-3);
  for (int i = 0; i < 4; ++i) {
    const double z = i == 0 ? 0.35 : 0.05 + 0.1 * (i - 1);
    EXPECT_LT((run.position(i) - Vec3(0, 0, z)).norm(), 1e-3) << i;
  }
  EXPECT_EQ(run.fault(), "");
}

// A sphere on a box edge, face and corner is seen as such, and carried by the face.
TEST_P(ContactMotion, CurbFeaturesAreNamed) {
  struct Case {
    Vec3 p;
    Feature feature;
  };
  const double r = 0.0085, s = r / std::sqrt(2.0) - 1e-4;
  for (const Case& c : {Case{{0, 0, 0.02 + r - 1e-4}, Feature::top}, Case{{0, 0.005 + r - 1e-4, 0}, Feature::side},
                        Case{{0, 0.005 + s, 0.02 + s}, Feature::edge}}) {
    World world = free_body(sphere(r), 0.05);
    world.gravity.setZero();
    world.objects.push_back(fixed("curb", box(1, 0.01, 0.04)));
    world.initial.position = c.p;
    Bench run = bench(world);
    run.step(1e-3);
    ASSERT_EQ(run.contacts().size(), 1u);
    EXPECT_EQ(run.contacts()[0].feature_b, c.feature);
    EXPECT_TRUE(run.contacts()[0].touching());
  }
}

// An overlap at the start is pushed apart without throwing the body: no faster than the recovery speed.
TEST_P(ContactMotion, OverlapIsPushedApartGently) {
  World world = on_plane(box(0.1, 0.1, 0.1), 0.5, 0.04, 0.8);  // 1 cm deep
  Bench run = bench(world);
  double highest = 0, fastest = 0;
  run.run(1.0, 1e-3, [&] {
    highest = std::max(highest, run.position(0).z());
    fastest = std::max(fastest, run.v(5));
  });
  EXPECT_LE(fastest, 0.1 + 1e-6);
  EXPECT_LE(highest, 0.05 + 0.1 * 0.1 / (2 * kGravity) + 1e-4);
  EXPECT_NEAR(run.position(0).z(), 0.05, 1e-4);
  EXPECT_EQ(run.fault(), "");
}

// Pairs that the model does not list do not touch.
TEST_P(ContactMotion, OnlyListedPairsTouch) {
  World world = on_plane(box(0.1, 0.1, 0.1), 0.5, 0.05, 0.8);
  world.contact.ignore.push_back({"body", "ground"});
  Bench run = bench(world);
  run.run(0.5, 1e-3);
  EXPECT_NEAR(run.v(5), -kGravity * 0.5, 1e-9);
}

// Links of one robot that touch each other hold each other: a leg folds up against the body and stops there.
TEST_P(ContactMotion, SelfContactHolds) {
  World world;
  world.robot.floating_base = false;
  world.robot.links = {link("base", box(0.1, 0.1, 0.1), 1, Pose::Identity(), false),
                       link("arm", box(0.04, 0.04, 0.3), 0.5, at(0, 0, -0.15)),
                       link("knee", box(0.02, 0.02, 0.02), 0.05, Pose::Identity(), false),
                       link("ball", sphere(0.03), 0.1, at(0, 0, 0.2))};
  world.robot.joints = {joint("shoulder", "base", "arm", JointType::revolute, Pose::Identity(), Vec3::UnitY()),
                        joint("bend", "arm", "knee", JointType::revolute, at(0.02, 0, -0.3), Vec3::UnitY()),
                        joint("slide", "knee", "ball", JointType::prismatic, Pose::Identity(), Vec3::UnitZ())};
  world.robot.joints[2].lower = -1e-3;
  world.robot.joints[2].upper = 1e-3;
  world.gravity.setZero();
  world.initial.joint_position = {{"bend", 1.0}};
  Bench run = bench(world);
  run.tau(1, 0) = -0.05;
  run.run(1.5, 1e-3);
  ASSERT_FALSE(run.contacts().empty());
  EXPECT_TRUE(run.contacts()[0].touching());
  EXPECT_NEAR(run.contacts()[0].phi, 0, 1e-4);
  EXPECT_EQ(run.fault(), "");
}

}  // namespace
}  // namespace graze::test
