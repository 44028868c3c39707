// Claim: `height: on_ground` lets a robot down on terrain until it touches it: GJK, which shares no line with it, finds
// no gap a little lower and one a little higher, for every shape.
#include "engine/model/terrain_rise.h"

#include <gtest/gtest.h>

#include "engine/clearance/terrain_gap.h"
#include "engine/model/placement.h"
#include "tests/engine/lanes/random_worlds.h"

namespace graze::test {
namespace {

Shape shape_to_let_down(ShapeKind kind, Dice& dice) {
  switch (kind) {
    case ShapeKind::sphere:
      return {kind, {dice.within(0.02, 0.2), 0, 0}, nullptr, nullptr};
    case ShapeKind::capsule:
    case ShapeKind::cylinder:
      return {kind, {dice.within(0.02, 0.15), dice.within(0.05, 0.4), 0}, nullptr, nullptr};
    case ShapeKind::mesh:
      return random_mesh(dice);
    default:
      return box(dice.within(0.05, 0.4), dice.within(0.05, 0.4), dice.within(0.05, 0.4));
  }
}

Shape ground_to_let_down_on(Dice& dice) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = 23, grid->ny = 19;
  for (int i = 0; i < grid->nx * grid->ny; ++i) grid->height.push_back(dice.within(-0.05, 0.05));
  return {ShapeKind::heightfield, {2, 1.5, 1}, nullptr, grid};
}

/// A robot of one link over ground that stands turned about z.
World let_down(const Shape& shape, const Shape& ground, Dice& dice) {
  World world;
  world.robot.links = {link("l0", shape, 1)};
  world.objects = {fixed("ground", ground, at(0.1, -0.2, dice.within(-1, 1), turn(dice.within(-3, 3), Vec3::UnitZ())))};
  world.initial.position = {dice.within(-0.2, 0.2), dice.within(-0.2, 0.2), dice.within(-1, 1)};
  world.initial.rpy = dice.once_in(4) ? Vec3(Vec3::Zero()) : dice.vector(3);
  world.initial.on_ground = true;
  return world;
}

/// The gap of the robot, moved up by `up`, above its ground; 0 where one is in the other.
double gap_when_let_down(const World& world, double up) {
  const Model model = compile(world);
  const std::vector<Pose> X_WB = place_bodies(model, initial_state(world, model).q);
  const Collider &own = model.colliders[0], &ground = model.colliders[1];
  Pose X = X_WB[0] * own.X_BG;
  X.translation().z() += up;
  std::vector<Vec3> points;
  if (own.shape.mesh) {
    for (const Vec3& vertex : own.shape.mesh->vertices) points.push_back(vertex.cwiseProduct(own.shape.size));
  }
  const Corners corners(points);
  const HeightGrid& grid = *ground.shape.grid;
  return gap_above_terrain({own.shape.kind, own.shape.size, X, &corners}, {grid.nx, grid.ny, grid.height.data()},
                           ground.shape.size, ground.X_BG, 1)
      .gap;
}

class LetDown : public ::testing::TestWithParam<ShapeKind> {};
INSTANTIATE_TEST_SUITE_P(, LetDown,
                         ::testing::Values(ShapeKind::sphere, ShapeKind::capsule, ShapeKind::cylinder, ShapeKind::box,
                                           ShapeKind::mesh));

// The prism about a round side is wider by 0.9 % of its radius, 1.3 mm at most here; the others touch to 1e-5 m.
TEST_P(LetDown, TouchesTheGround) {
  Dice dice(100 + static_cast<std::uint64_t>(GetParam()));
  const bool round = GetParam() == ShapeKind::cylinder || GetParam() == ShapeKind::capsule;
  for (int trial = 0; trial < 60; ++trial) {
    const Shape shape = shape_to_let_down(GetParam(), dice), ground = ground_to_let_down_on(dice);
    World world = let_down(shape, ground, dice);
    EXPECT_GT(gap_when_let_down(world, 1e-5), 0) << trial;
    EXPECT_EQ(gap_when_let_down(world, round ? -0.01 * shape.size.x() - 1e-4 : -1e-5), 0) << trial;
    world.initial.clearance = 0.01;
    EXPECT_GT(gap_when_let_down(world, -0.01 + 1e-5), 0) << trial << ", with a clearance";
  }
}

/// The height of the robot's lowest point, a ball of 5 cm at x, with these objects about.
double lowest_when_let_down(std::vector<Object> objects, double x) {
  World world;
  world.robot.links = {link("l0", {ShapeKind::sphere, {0.05, 0, 0}, nullptr, nullptr}, 1)};
  world.objects = std::move(objects);
  world.initial.position = {x, 0, 0.3};
  world.initial.on_ground = true;
  const Model model = compile(world);
  return lowest_point(model, place_bodies(model, initial_state(world, model).q));
}

Object field_at_height(double height, const Pose& X = at(0, 0, 0)) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = grid->ny = 5;
  grid->height.assign(25, height);
  return fixed("field", {ShapeKind::heightfield, {2, 2, 1}, nullptr, grid}, X);
}

// Beyond the rim, on fields that are tilted and where parts never touch it, the ground is z = 0; a plane bounds it from
// below.
TEST(LetDownRobot, StandsOnZeroWhereNoTerrainIs) {
  EXPECT_NEAR(lowest_when_let_down({field_at_height(-0.2)}, 0.3), -0.2, 1e-12);
  EXPECT_NEAR(lowest_when_let_down({field_at_height(0.2)}, 0.3), 0.2, 1e-12);
  EXPECT_NEAR(lowest_when_let_down({field_at_height(0.2)}, 1.2), 0, 1e-12);
  EXPECT_NEAR(lowest_when_let_down({field_at_height(-0.2), fixed("floor", plane())}, 0.3), 0, 1e-12);
  EXPECT_NEAR(lowest_when_let_down({field_at_height(0.2), fixed("floor", plane())}, 0.3), 0.2, 1e-12);
  EXPECT_NEAR(lowest_when_let_down({field_at_height(0.2, at(0, 0, 0, turn(0.2, Vec3::UnitX())))}, 0.3), 0, 1e-12);
  Object other = field_at_height(0.25);
  other.name = "other";
  EXPECT_NEAR(lowest_when_let_down({field_at_height(0.2), other}, 0.3), 0.25, 1e-12);
}

}  // namespace
}  // namespace graze::test
