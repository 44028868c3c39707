// Claims: a margin of no_contact is the distance of the parts, in closed form, as far as the witness asks, for every
// pair of shapes and under both back ends; over a trace it is the least distance at the steps.
#include "engine/clearance/clearance.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/contact/convex_gap.h"
#include "tests/reference_kinematics.h"
#include "tests/scenarios/judged.h"

namespace graze {
namespace {

using test::at;
using test::turn;
using testing::Judged;

Shape cube_mesh(double edge) {
  auto mesh = std::make_shared<Mesh>();
  for (int k = 0; k < 8; ++k) mesh->vertices.emplace_back(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
  mesh->triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return {ShapeKind::mesh, Vec3::Constant(0.5 * edge), mesh, nullptr};
}

/// 2 m square, 5 cm cells, a ridge of height h along y at x = 0.
Shape ridge(double h) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = grid->ny = 41;
  for (int i = 0; i < 41 * 41; ++i) grid->height.push_back(i % 41 == 20 ? h : 0.0);
  return {ShapeKind::heightfield, {2, 2, 1}, nullptr, grid};
}

/// A free body over a fixed thing, without gravity.
World over(const Shape& body, const Shape& thing) {
  World world = test::free_body(body, 1);
  world.objects.push_back(test::fixed("thing", thing));
  world.gravity = Vec3::Zero();
  return world;
}

// Claim: overlaps() tells every pair of parts that are in each other with its depth, in closed form for balls, boxes
// and meshes, and nothing of those that are apart; looking again gives the same.
TEST(Overlaps, AreTheDepthsOfEachPair) {
  World world = over({ShapeKind::sphere, {0.1, 0, 0}, nullptr, nullptr}, cube_mesh(0.2));
  world.objects.push_back(test::fixed("plate", {ShapeKind::box, {1, 1, 0.02}, nullptr, nullptr}));
  world.objects.push_back(test::fixed("far", {ShapeKind::sphere, {0.5, 0, 0}, nullptr, nullptr}));
  world.objects[1].X_WO = at(0, 0, 0.25);
  world.objects[2].X_WO = at(2, 0, 0);
  world.initial.position = {0, 0, 0.17};  // 3 cm in the mesh, 3 cm in the plate, 1.4 m from the ball
  const Model model = compile(world);
  const State initial = initial_state(world, model);
  const std::vector<Pose> X_WB = reference_poses(model, initial.q);
  BlockState state{BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv), BlockArray(12)};
  for (int i = 0; i < 9; ++i) state.X(i, 3) = X_WB[0].linear()(i / 3, i % 3);
  state.X.set_column(3, X_WB[0].translation(), 9);
  const Parts all{std::vector<unsigned>(model.colliders.size(), ~0u)};
  Clearance clearance(model, all, all, 0);
  for (int look = 0; look < 2; ++look) {
    const std::vector<Clearance::Overlap> found = clearance.overlaps(state, 3);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(model.colliders[found[0].b].name, "thing");
    EXPECT_NEAR(found[0].depth, 0.03, 1e-6);
    EXPECT_EQ(model.colliders[found[1].b].name, "plate");
    EXPECT_NEAR(found[1].depth, 0.03, 1e-9);
  }
}

const std::string kNear = "{no_contact: {between: [body, thing], within: 5 cm}}";

class Clearances : public ::testing::TestWithParam<const char*> {};

TEST_P(Clearances, AreExactForEveryPairOfShapes) {
  // Shapes with how far they reach down and up from their origins.
  struct Thing {
    const char* name;
    Shape shape;
    double down, up;
  };
  const double tilted = 0.02 * std::sqrt(3.0);  // half the diagonal of the cube that stands on a corner
  const Mat3 on_corner = Quat::FromTwoVectors(Vec3(1, 1, 1).normalized(), Vec3::UnitZ()).toRotationMatrix();
  const std::vector<Thing> bodies = {{"sphere", test::sphere(0.03), 0.03, 0},
                                     {"capsule", test::capsule(0.02, 0.1), 0.07, 0},
                                     {"box", test::box(0.04, 0.04, 0.04), tilted, 0},
                                     {"cylinder", test::cylinder(0.02, 0.08), 0.04, 0},
                                     {"mesh", cube_mesh(0.04), tilted, 0}};
  const std::vector<Thing> things = {{"plane", test::plane(), 0, 0},
                                     {"sphere", test::sphere(0.1), 0, 0.1},
                                     {"capsule", test::capsule(0.05, 0.2), 0, 0.15},
                                     {"box", test::box(0.3, 0.3, 0.1), 0, 0.05},
                                     {"cylinder", test::cylinder(0.1, 0.2), 0, 0.1},
                                     {"mesh", cube_mesh(0.2), 0, 0.1},
                                     {"terrain", ridge(0.01), 0, 0.01}};
  for (const Thing& body : bodies) {
    const bool turned = body.shape.kind == ShapeKind::box || body.shape.kind == ShapeKind::mesh;
    for (const Thing& thing : things) {
      for (const double gap : {0.9e-3, 1.1e-3, 5e-3, 15e-3, 30e-3, 80e-3}) {
        World world = over(body.shape, thing.shape);
        world.initial.position = {0, 0, thing.up + gap + body.down};
        if (turned) world.initial.rpy = on_corner.eulerAngles(2, 1, 0).reverse();
        Judged judged(GetParam(), world, kNear);
        EXPECT_NEAR(judged.margin(), std::min(gap, 0.05), 1e-9)
            << body.name << " over " << thing.name << ", gap " << gap;
      }
    }
  }
}

// Two edges that cross, where the contact kernels see nothing of terrain: a long box across the ridge.
TEST_P(Clearances, SeeEdgesOverTerrain) {
  World world = over(test::box(0.5, 0.04, 0.04), ridge(0.03));
  world.initial.rpy = {std::numbers::pi / 4, 0, 0};
  world.initial.position = {0.013, 0.02, 0.03 + 0.02 * std::sqrt(2.0) + 0.004};
  EXPECT_NEAR(Judged(GetParam(), world, kNear).margin(), 0.004, 1e-9);
}

// A capsule that tumbles past a box: at each step the value is what GJK finds, and the margin is the least of them.
TEST_P(Clearances, LeastOfATraceIsTheLeastOfItsSteps) {
  const Shape capsule = test::capsule(0.02, 0.1), box = test::box(0.2, 0.3, 0.1);
  World world = over(capsule, box);
  world.initial.position = {-0.5, 0.03, 0.125};
  world.initial.linear_velocity = {1, 0, 0};
  world.initial.angular_velocity = {0, 9, 3};
  Judged judged(GetParam(), world, kNear), watched(GetParam(), world, kNear);
  double least = 0.05;
  judged.run(1, 1e-3, [&] {
    const Convex a{capsule.kind, capsule.size, at(0, 0, 0)}, b{box.kind, box.size, Pose::Identity()};
    Convex now = a;
    now.X = judged.bench().physics().state().pose(0, 0);
    const double gap = std::min(0.05, gap_between(now, b).phi);
    least = std::min(least, gap);
  });
  watched.run(1, 1e-3, [&] { watched.present(); });
  EXPECT_GT(least, 1e-3) << "it never touches";
  EXPECT_LT(least, 0.04);
  EXPECT_NEAR(judged.margin(), least, 1e-9);
  EXPECT_EQ(judged.margin(), watched.margin()) << "being looked at changes nothing";
}

// The gap counts for the feature on which its nearest point lies.
TEST_P(Clearances, TellFeaturesApart) {
  const auto margin = [&](const Vec3& at, const std::string& part) {
    World world = over(test::sphere(0.01), test::box(0.1, 0.1, 0.1));
    world.initial.position = at;
    return Judged(GetParam(), world, "{no_contact: [body, \"" + part + "\"]}").margin();
  };
  EXPECT_NEAR(margin({0.063, 0, 0}, "thing.side"), 0.003, 1e-12);
  EXPECT_NEAR(margin({0.063, 0, 0}, "thing.{top,edge}"), 0.02, 1e-12);
  EXPECT_NEAR(margin({0, 0, 0.063}, "thing.top"), 0.003, 1e-12);
  EXPECT_NEAR(margin({0.06, 0, 0.06}, "thing.edge"), 0.01 * std::sqrt(2.0) - 0.01, 1e-12);
}

// Before the first step no back end has looked: parts that stand on each other or overlap then touch, by their gaps.
TEST_P(Clearances, PartsThatBeginInTouchTouch) {
  const std::string held = "{contact: [body, thing]}", untouched = "{no_contact: [body, thing]}";
  const auto margin = [&](const Shape& body, const Shape& thing, double z, const std::string& witness) {
    World world = over(body, thing);
    world.initial.position = {0, 0, z};
    return Judged(GetParam(), world, witness).margin();
  };
  for (const Shape& body : {test::sphere(0.05), test::box(0.1, 0.1, 0.1), test::cylinder(0.2, 0.1), cube_mesh(0.1)}) {
    for (const auto& [thing, top] : {std::pair{test::plane(), 0.0}, {test::box(1, 1, 0.2), 0.1}, {ridge(0), 0.0}}) {
      EXPECT_NEAR(margin(body, thing, top + 0.05, untouched), 0, 1e-8) << "at rest";
      EXPECT_LT(margin(body, thing, top + 0.05, untouched), 0);
      EXPECT_GT(margin(body, thing, top + 0.05, held), 0);
      EXPECT_NEAR(margin(body, thing, top + 0.04, untouched), -0.01, 1e-6) << "in each other";
      EXPECT_NEAR(margin(body, thing, top + 0.04, held), 0.01, 1e-6);
      EXPECT_NEAR(margin(body, thing, top + 0.05001, untouched), 1e-5, 1e-9) << "apart";
      EXPECT_NEAR(margin(body, thing, top + 0.05001, held), -1e-5, 1e-9);
    }
  }
}

// Beyond the 2 cm of the default the margin is the distance still, so that it tells how near a miss was.
TEST_P(Clearances, GradeAsFarAsIsAsked) {
  for (const double within : {0.1, 0.5, 2.0}) {
    const std::string asked = fmt::format("{{no_contact: {{between: [body, thing], within: {}}}}}", within);
    for (const Shape& thing : {test::box(0.1, 0.4, 0.1), ridge(0)}) {
      const double top = thing.kind == ShapeKind::box ? 0.05 : 0;
      double before = 0;
      for (const double gap : {0.021, 0.05, 0.09, 0.25, 0.45, 0.9, 1.8}) {
        World world = over(test::sphere(0.03), thing);
        world.initial.position = {-0.5, 0, top + 0.03 + gap};
        world.initial.linear_velocity = {1, 0, 0};
        Judged judged(GetParam(), world, asked);
        judged.run(1, 1e-3);  // past the thing, least above its middle
        EXPECT_NEAR(judged.margin(), std::min(gap, within), 1e-9) << "within " << within << ", gap " << gap;
        if (gap < within) {
          EXPECT_GT(judged.margin(), before);
        }
        before = judged.margin();
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BackEnds, Clearances, ::testing::Values("lanes", "bullet"));

// Beside other particles, which are measured at other times, a lane gets the same bits.
TEST(Clearance, IsTheSameInCompany) {
  const Shape capsule = test::capsule(0.02, 0.1), box = test::box(0.2, 0.3, 0.1);
  const World world = over(capsule, box);
  const Model model = compile(world);
  const Parts body{{~0u, 0u}}, thing{{0u, ~0u}};
  Clearance together(model, body, thing, 0.05);
  std::vector<Clearance> alone(kLanes, together);
  BlockState state{BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv), BlockArray(12)};
  for (int step = 0; step < 400; ++step) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const double t = 2e-3 * step * (1 + 0.1 * lane);
      const Mat3 R = turn(5 * t + lane, Vec3(1, lane, 2));
      for (int i = 0; i < 9; ++i) state.X(i, lane) = R(i / 3, i % 3);
      state.X(9, lane) = t - 0.4, state.X(10, lane) = 0.01 * lane, state.X(11, lane) = 0.13 + 0.003 * lane;
    }
    double all[kLanes];
    together.least(state, LaneMask::all(), nullptr, all);
    for (int lane = 0; lane < kLanes; ++lane) {
      double one[kLanes];
      alone[lane].least(state, LaneMask(1u << lane), nullptr, one);
      ASSERT_EQ(one[lane], all[lane]) << "lane " << lane << ", step " << step;
    }
  }
}

/// A body among things of every shape, which all move but for the plane and the terrain.
Model crowd() {
  World world = over(test::box(0.1, 0.07, 0.05), ridge(0.03));
  world.objects.push_back(
      test::fixed("wall", test::plane(), at(-0.6, 0, 0, turn(std::numbers::pi / 2, Vec3::UnitY()))));
  int k = 0;
  for (const Shape& shape : {test::sphere(0.03), test::capsule(0.02, 0.1), test::cylinder(0.03, 0.08),
                             test::cylinder(0.015, 0.12), test::box(0.05, 0.08, 0.06), cube_mesh(0.05)}) {
    ++k;
    world.objects.push_back(test::movable("thing" + std::to_string(k), shape, 1, at(0.2 * k, 0, 1)));
  }
  return compile(world);
}

/// Swings of all bodies about places near each other, other ones in each lane and run.
void swing(double t, int lane, int run, BlockState& state) {
  for (int body = 0; 12 * body < state.X.rows(); ++body) {
    const double phase = 1.7 * body + 0.9 * lane + 2.3 * run;
    const Mat3 R = turn(2 * t + phase, Vec3(1, std::sin(phase), 0.5 * body));
    for (int i = 0; i < 9; ++i) state.X(12 * body + i, lane) = R(i / 3, i % 3);
    const Vec3 p(0.16 * (body % 3) + 0.02 * std::sin(3 * t + phase), 0.16 * (body / 3) + 0.02 * std::sin(2 * t + lane),
                 0.16 + 0.03 * std::sin(5 * t + 2 * phase));
    for (int i = 0; i < 3; ++i) state.X(12 * body + 9 + i, lane) = p[i];
  }
}

// Whatever was asked before, wherever a trace began, and whoever looks at how bodies move: the least of all pairs and
// the pair that it is of are those of an object that has seen nothing yet, bit for bit.
TEST(Clearance, RemembersNothingButForSpeed) {
  const Model model = crowd();
  const Parts all{std::vector<unsigned>(model.colliders.size(), ~0u)};
  const Clearance fresh(model, all, all, 0.05);
  Clearance clearance = fresh, beside = fresh, rarely = fresh;
  BodyMoves moves(fresh.bodies());  // of the latter two
  BlockState state{BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv),
                   BlockArray(12 * static_cast<int>(model.bodies.size()))};
  std::mt19937 random(5);
  int run[kLanes] = {}, compared = 0, known = 0;
  double lowest[kLanes];
  std::fill_n(lowest, kLanes, 1.0);
  for (int step = 0; step < 1200; ++step) {
    double enough[kLanes], out[kLanes], part[kLanes], truth[kLanes], true_part[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      if (random() % 100 == 0) {
        for (Clearance* one : {&clearance, &beside, &rarely}) one->start(lane, model);
        moves.start(lane);
        ++run[lane];
        lowest[lane] = 1;
      }
      swing(2e-3 * step, lane, run[lane], state);
      // As monitors ask: for what is less than ever; now and then for something else.
      enough[lane] = random() % 10 == 0 ? 0.05 * static_cast<double>(random() % 100) / 100 : lowest[lane];
    }
    const LaneMask lanes(random() % 256);
    const bool whole = random() % 50 == 0;
    clearance.least(state, lanes, whole ? nullptr : enough, out, part);
    moves.next();
    for (Clearance* one : {&rarely, &beside}) {
      if (one == &rarely && random() % 3 != 0) continue;
      double same[kLanes], same_part[kLanes];
      one->least(state, lanes, whole ? nullptr : enough, same, same_part, &moves);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!lanes[lane] || !(out[lane] > 0)) continue;
        ASSERT_EQ(same[lane], out[lane]) << "step " << step << ", lane " << lane;
        ASSERT_EQ(same_part[lane], part[lane]) << "step " << step << ", lane " << lane;
      }
    }
    Clearance(fresh).least(state, lanes, nullptr, truth, true_part);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!lanes[lane] || truth[lane] <= 0) continue;
      const bool less = truth[lane] < (whole ? 0.05 : std::min(enough[lane], 0.05));
      ASSERT_EQ(out[lane], less ? truth[lane] : 0.05) << "step " << step << ", lane " << lane;
      ASSERT_EQ(part[lane], less ? true_part[lane] : -1) << "step " << step << ", lane " << lane;
      lowest[lane] = std::min(lowest[lane], truth[lane]);
      ++(less ? compared : known);
    }
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(known, 1000);
}

}  // namespace
}  // namespace graze
