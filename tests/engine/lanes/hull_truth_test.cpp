// Claims: a box or cylinder that is given as a mesh behaves as the shape itself: it stands, falls back or tips over
// alike under each
// solver, on a plane, on terrain and on another one; a stack of five boxes stands; and a foot with a rounded rim comes
// to rest on its sole.

#include <gtest/gtest.h>

#include <numbers>
#include <tuple>

#include "engine/model/convex_hull.h"
#include "tests/engine/lanes/solvers.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

/// Finely cut: points on its edges and faces.
Shape box_of_mesh(double x, double y, double z) {
  Mesh cut;
  for (int i = 0; i <= 4; ++i) {
    for (int j = 0; j <= 4; ++j) {
      for (int k = 0; k <= 4; ++k) cut.vertices.push_back(0.25 * Vec3((i - 2) * x, (j - 2) * y, (k - 2) * z));
    }
  }
  return {ShapeKind::mesh, Vec3::Ones(), convex_hull(cut), nullptr};
}

/// About z, its middle at the origin.
Shape cylinder_of_mesh(double radius, double length) {
  constexpr int kSides = 64;
  Mesh cut;
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSides;
    for (const double end : {-0.5, 0.5}) {
      cut.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), end * length);
    }
  }
  return {ShapeKind::mesh, Vec3::Ones(), convex_hull(cut), nullptr};
}

/// A square sole of 10 cm at z = -2.5 cm, and 0.8 mm above it a rim that reaches 3.5 cm further.
Shape foot_with_rim() {
  Mesh cut;
  for (int k = 0; k < 4; ++k) cut.vertices.emplace_back(k & 1 ? 0.05 : -0.05, k & 2 ? 0.05 : -0.05, -0.025);
  for (int k = 0; k < 16; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.37) / 16;
    for (const double z : {-0.0242, 0.025}) {
      cut.vertices.emplace_back(0.085 * std::cos(angle), 0.085 * std::sin(angle), z);
    }
  }
  return {ShapeKind::mesh, Vec3::Ones(), convex_hull(cut), nullptr};
}

Shape flat_terrain() {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = grid->ny = 9;
  grid->height.assign(81, 0.0);
  return {ShapeKind::heightfield, {2, 2, 1}, nullptr, grid};
}

World on(const Shape& shape, const Shape& ground, const Vec3& position, double tilt) {
  World world = free_body(shape, 1);
  const bool slab = ground.kind != ShapeKind::plane && ground.kind != ShapeKind::heightfield;
  world.objects.push_back(fixed("ground", ground, at(0, 0, slab ? -0.05 : 0)));
  world.contact.model = "complementarity";
  world.contact.friction = 1;
  world.initial.position = position;
  world.initial.rpy = {0, tilt, 0};
  return world;
}

/// Where a box of half edges (a, ., c), tilted by `tilt` about y, touches the ground with an edge.
double height_on_edge(double a, double c, double tilt) { return a * std::sin(tilt) + c * std::cos(tilt); }

double upright(const Bench& run) { return reference_poses(run.model(), run.q())[0].linear()(2, 2); }

class HullBox : public ::testing::TestWithParam<std::tuple<int, NamedSolver>> {
 protected:
  Shape ground() const {
    const Shape all[] = {plane(), flat_terrain(), box(1, 1, 0.1), box_of_mesh(1, 1, 0.1), cylinder(0.5, 0.1)};
    return all[std::get<0>(GetParam())];
  }
  World on(const Shape& shape, const Shape& ground, const Vec3& position, double tilt) const {
    World world = test::on(shape, ground, position, tilt);
    world.contact.solver = std::get<1>(GetParam()).solver;
    return world;
  }
};
std::string ground_name(const ::testing::TestParamInfo<std::tuple<int, NamedSolver>>& info) {
  const char* const names[] = {"plane", "terrain", "box", "mesh", "cylinder"};
  return std::string(names[std::get<0>(info.param)]) + "_" + std::get<1>(info.param).name;
}
INSTANTIATE_TEST_SUITE_P(, HullBox, ::testing::Combine(::testing::Range(0, 5), ::testing::ValuesIn(contact_solvers())),
                         ground_name);

// It neither sinks by more than the 1e-5 m that a gap's correction leaves nor creeps.
TEST_P(HullBox, Stands) {
  Bench run("lanes", on(box_of_mesh(0.2, 0.1, 0.3), ground(), {0.01, 0.02, 0.15}, 0));
  run.run(2, 1e-3);
  EXPECT_EQ(run.fault(), "");
  const Vec3 p = reference_poses(run.model(), run.q())[0].translation();
  EXPECT_NEAR(p.z(), 0.15, 1e-5);
  EXPECT_NEAR(p.x(), 0.01, 1e-6);
  EXPECT_NEAR(p.y(), 0.02, 1e-6);
  EXPECT_NEAR(upright(run), 1, 1e-9);
}

// Released on an edge, it falls back below the angle atan(a / c) at which its middle stands over that edge, and tips
// beyond.
TEST_P(HullBox, FallsBackOrTips) {
  const double critical = std::atan2(0.1, 0.15);
  for (const double share : {0.9, 1.1}) {
    const double tilt = share * critical;
    const Vec3 start(0, 0, height_on_edge(0.1, 0.15, tilt));
    Bench run("lanes", on(box_of_mesh(0.2, 0.1, 0.3), ground(), start, tilt));
    run.run(3, 1e-3);
    EXPECT_EQ(run.fault(), "");
    EXPECT_NEAR(std::abs(upright(run)), share < 1 ? 1 : 0, 1e-3) << share;
  }
}

// So does a cylinder on its rim.
TEST_P(HullBox, AsACylinderFallsBackOrTips) {
  const double critical = std::atan2(0.1, 0.15);
  for (const double share : {0.0, 0.9, 1.1}) {
    const double tilt = share * critical;
    const Vec3 start(0, 0, height_on_edge(0.1, 0.15, tilt));
    Bench run("lanes", on(cylinder_of_mesh(0.1, 0.3), ground(), start, tilt));
    run.run(3, 1e-3);
    EXPECT_EQ(run.fault(), "");
    EXPECT_NEAR(std::abs(upright(run)), share < 1 ? 1 : 0, 1e-3) << share;
  }
}

// Dropped at a tilt, it lies still on its sole in the end: the points that carry it are the sole's corners, which lie
// less far out than the rim's.
TEST_P(HullBox, FootWithARimLiesStill) {
  Bench run("lanes", on(foot_with_rim(), ground(), {0.01, 0.02, 0.05}, 0.1));
  run.run(3, 1e-3);
  EXPECT_EQ(run.fault(), "");
  EXPECT_LT(run.v().norm(), 1e-6);
  EXPECT_NEAR(reference_poses(run.model(), run.q())[0].translation().z(), 0.025, 1e-5);
  EXPECT_NEAR(upright(run), 1, 1e-9);
}

// Until it strikes, rocking on its edge, it goes the way of the box itself.
TEST_P(HullBox, RocksAsTheBox) {
  const double tilt = 0.3;
  const Vec3 start(0, 0, height_on_edge(0.1, 0.15, tilt));
  Bench hull("lanes", on(box_of_mesh(0.2, 0.1, 0.3), ground(), start, tilt));
  Bench own("lanes", on(box(0.2, 0.1, 0.3), ground(), start, tilt));
  double most = 0, least = 1;
  for (int i = 0; i < 100; ++i) {
    hull.run(1e-3, 1e-3);
    own.run(1e-3, 1e-3);
    most = std::max(most, std::abs(upright(hull) - upright(own)));
    least = std::min(least, upright(own));
  }
  EXPECT_GT(upright(own), least + 1e-3) << "it moved";
  EXPECT_LT(most, 1e-6);
}

class HullStack : public ::testing::TestWithParam<NamedSolver> {};
INSTANTIATE_TEST_SUITE_P(, HullStack, ::testing::ValuesIn(contact_solvers()), name_of_solver);

// Each carries those above; nothing sinks, slides or turns by more than the gaps' corrections in two seconds.
TEST_P(HullStack, OfFiveStands) {
  World world = on(box_of_mesh(0.2, 0.2, 0.1), plane(), {0, 0, 0.05}, 0);
  world.contact.solver = GetParam().solver;
  for (int i = 1; i < 5; ++i) {
    const double aside = i % 2 ? 0.01 : -0.01;
    world.objects.push_back(
        movable("box" + std::to_string(i), box_of_mesh(0.2, 0.2, 0.1), 1, at(aside, 0, 0.05 + 0.1 * i)));
  }
  Bench run("lanes", world);
  const std::vector<Pose> before = reference_poses(run.model(), run.q());
  run.run(2, 1e-3);
  EXPECT_EQ(run.fault(), "");
  const std::vector<Pose> after = reference_poses(run.model(), run.q());
  ASSERT_EQ(after.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT((after[i].translation() - before[i].translation()).norm(), 1e-4) << i;
    EXPECT_NEAR(after[i].linear()(2, 2), 1, 1e-6) << i;
  }
}

}  // namespace
}  // namespace graze::test
