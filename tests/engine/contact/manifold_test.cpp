// Claims: manifolds have the points that a stable stance needs, in slots that stay, with the features' names; terrain
// is the triangles that it is made of.

#include <gtest/gtest.h>

#include "engine/contact/features.h"
#include "tests/engine/contact/support.h"

namespace graze::testing {
namespace {

const BodyD kGround{ShapeKind::plane, {}, {Random::rotation_of(Quat::Identity()), {0, 0, 0}}};

PoseD pose(const Point& p, const Vec3& axis = Vec3::UnitX(), double angle = 0) {
  return {Random::rotation_of(Quat(Eigen::AngleAxisd(angle, axis))), p};
}
constexpr double kQuarter = 1.5707963267948966;

/// Valid points by feature of a, as a string of counts: "4 vertex".
std::string census(const ManifoldD& manifold) {
  std::map<std::string, int> counts;
  for (int k = 0; k < manifold.count; ++k) {
    const auto& point = manifold.point[k];
    if (!point.valid) continue;
    const auto name = [](double number) { return std::string(feature_name(static_cast<Feature>(int(number)))); };
    ++counts[name(point.feature_a) + "-" + name(point.feature_b)];
  }
  std::string out;
  for (const auto& [name, count] : counts) out += (out.empty() ? "" : " ") + std::to_string(count) + " " + name;
  return out;
}

TEST(Manifold, stances_on_a_plane) {
  const BodyD box{ShapeKind::box, {{0.2, 0.3, 0.4}}, pose({0, 0, 0.2})};
  EXPECT_EQ(census(touch(box, kGround, 0.01)), "4 vertex-surface");
  const BodyD standing{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose({0, 0, 0.2})};
  EXPECT_EQ(census(touch(standing, kGround, 0.01)), "4 rim-surface");
  const BodyD lying{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose({0, 0, 0.1}, Vec3::UnitX(), kQuarter)};
  EXPECT_EQ(census(touch(lying, kGround, 0.01)), "2 rim-surface");
  const BodyD capsule{ShapeKind::capsule, {{0.1, 0.4, 0}}, pose({0, 0, 0.1}, Vec3::UnitX(), kQuarter)};
  EXPECT_EQ(census(touch(capsule, kGround, 0.01)), "2 surface-surface");
}

// The support polygon of a standing cylinder is a square of diagonal 2 r wherever it leans, and its lowest point is one
// of the corners.
TEST(Manifold, lowest_point_of_a_leaning_cylinder_is_exact) {
  for (double angle : {1e-7, 1e-3, 0.3}) {
    for (double heading : {0.0, 0.7, 2.0}) {
      const Vec3 axis(std::cos(heading), std::sin(heading), 0);
      const BodyD body{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose({0, 0, 0.25}, axis, angle)};
      const ManifoldD manifold = touch(body, kGround, 1);
      EXPECT_NEAR(deepest(manifold)->phi, 0.25 - 0.2 * std::cos(angle) - 0.1 * std::sin(angle), 1e-15);
    }
  }
}

TEST(Manifold, box_on_box) {
  const BodyD table{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, -0.1})};
  const BodyD inside{ShapeKind::box, {{0.2, 0.3, 0.4}}, pose({0, 0, 0.2})};
  EXPECT_EQ(census(touch(inside, table, 0.01)), "4 vertex-top");
  EXPECT_EQ(census(touch(table, inside, 0.01)), "4 top-vertex");
  const BodyD overhanging{ShapeKind::box, {{0.2, 0.3, 0.4}}, pose({0.5, 0, 0.2})};
  EXPECT_EQ(census(touch(overhanging, table, 0.01)), "2 edge-edge 2 vertex-top");
  const BodyD turned{ShapeKind::box, {{1, 1, 0.4}}, pose({0, 0, 0.2}, Vec3::UnitZ(), 0.5 * kQuarter)};
  EXPECT_EQ(census(touch(turned, table, 0.01)), "8 edge-edge");
  const BodyD equal{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, 0.1})};
  EXPECT_EQ(census(touch(equal, table, 0.01)), "4 vertex-vertex");
  const BodyD roof{ShapeKind::box, {{2, 3, 0.2}}, pose({0, 0, 0.1})};
  EXPECT_EQ(census(touch(roof, table, 0.01)), "4 bottom-vertex");
  const BodyD beside{ShapeKind::box, {{1, 1, 0.2}}, pose({1.005, 0, -0.1})};
  EXPECT_EQ(census(touch(beside, table, 0.01)), "4 vertex-vertex");
}

// Two bars that cross: edge on edge at a right angle, gap by hand.
TEST(Manifold, crossing_edges) {
  const BodyD low{ShapeKind::box, {{0.1, 1, 0.1}}, pose({0, 0, 0}, Vec3::UnitY(), 0.5 * kQuarter)};
  const BodyD high{ShapeKind::box, {{1, 0.1, 0.1}}, pose({0, 0, 0.15}, Vec3::UnitX(), 0.5 * kQuarter)};
  const ManifoldD manifold = touch(high, low, 0.05);
  EXPECT_EQ(census(manifold), "1 edge-edge");
  EXPECT_NEAR(deepest(manifold)->phi, 0.15 - 0.1 * std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(deepest(manifold)->n.z, 1, 1e-15);
}

TEST(Manifold, foot_against_the_faces_of_a_curb) {
  const BodyD curb{ShapeKind::box, {{1, 0.01, 0.04}}, pose({0.5, -0.2, 0.01})};
  const auto foot = [](const Point& p) { return BodyD{ShapeKind::sphere, {{0.0085, 0, 0}}, pose(p)}; };
  EXPECT_EQ(census(touch(foot({0.5, -0.2, 0.038}), curb, 0.01)), "1 surface-top");
  EXPECT_EQ(census(touch(foot({0.5, -0.187, 0.01}), curb, 0.01)), "1 surface-side");
  EXPECT_EQ(census(touch(foot({0.5, -0.19, 0.035}), curb, 0.01)), "1 surface-edge");
  EXPECT_EQ(census(touch(foot({1.002, -0.19, 0.035}), curb, 0.01)), "1 surface-vertex");
}

TEST(Manifold, capsules_lie_on_two_points) {
  const BodyD table{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, -0.1})};
  for (double tilt : {0.0, 1e-9, 1e-3, 0.02}) {
    const BodyD capsule{ShapeKind::capsule, {{0.1, 0.4, 0}}, pose({0.4, 0, 0.1}, Vec3::UnitY(), kQuarter + tilt)};
    EXPECT_EQ(valid_count(touch(capsule, table, 0.01)), 2) << tilt;
    const BodyD log{ShapeKind::capsule, {{0.1, 0.6, 0}}, pose({0.4, 0, -0.1}, Vec3::UnitY(), kQuarter)};
    EXPECT_EQ(valid_count(touch(capsule, log, 0.01)), 2) << tilt;
    const BodyD trunk{ShapeKind::cylinder, {{0.1, 0.6, 0}}, pose({0.4, 0, -0.1}, Vec3::UnitY(), kQuarter)};
    EXPECT_EQ(census(touch(capsule, trunk, 0.01)), "2 surface-side") << tilt;
  }
}

TEST(Manifold, cylinders_on_boxes) {
  const BodyD table{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, -0.1})};
  const auto standing = [](const Point& p) { return BodyD{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose(p)}; };
  EXPECT_EQ(census(touch(standing({0.1, 0.2, 0.2}), table, 0.01)), "4 rim-top");
  // Beyond an edge of the table: two crossings of rim and edge, the rim's points toward the other three edges.
  EXPECT_EQ(census(touch(standing({0.45, 0, 0.2}), table, 0.01)), "2 rim-edge 3 rim-top");
  const BodyD lying{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose({0, 0, 0.1}, Vec3::UnitY(), kQuarter)};
  EXPECT_EQ(census(touch(lying, table, 0.01)), "2 rim-top");
  const BodyD curb{ShapeKind::box, {{0.1, 1, 0.1}}, pose({0, 0, -0.05})};
  EXPECT_EQ(census(touch(lying, curb, 0.01)), "2 side-edge");
  // A box on a wide cap stands on its corners, one on a narrow cap on the rim's points.
  const BodyD drum{ShapeKind::cylinder, {{0.3, 0.4, 0}}, pose({0, 0, -0.2})};
  const BodyD small{ShapeKind::box, {{0.2, 0.2, 0.2}}, pose({0, 0, 0.1})};
  EXPECT_EQ(census(touch(small, drum, 0.01)), "4 vertex-cap");
  const BodyD wide{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, 0.1})};
  EXPECT_EQ(census(touch(wide, drum, 0.01)), "4 bottom-rim");
  // A box on its edge across a cap; the side against an upright edge; a leaning rim on the table.
  const BodyD roof{
      ShapeKind::box, {{0.2, 0.2, 0.2}}, pose({0, 0, 0.1 * std::sqrt(2.0)}, Vec3::UnitX(), 0.5 * kQuarter)};
  EXPECT_EQ(census(touch(roof, drum, 0.01)), "2 vertex-cap");
  const BodyD post{
      ShapeKind::box, {{0.2, 0.2, 1}}, pose({0.1 + 0.1 * std::sqrt(2.0), 0, 0.2}, Vec3::UnitZ(), 0.5 * kQuarter)};
  EXPECT_EQ(census(touch(standing({0, 0, 0.2}), post, 0.01)), "2 rim-edge");
  const BodyD leaning{ShapeKind::cylinder,
                      {{0.1, 0.4, 0}},
                      pose({0, 0, 0.2 * std::cos(0.5) + 0.1 * std::sin(0.5)}, Vec3::UnitX(), 0.5)};
  EXPECT_EQ(census(touch(leaning, table, 0.01)), "1 rim-top");
}

TEST(Manifold, cylinders_on_cylinders) {
  const auto upright = [](double r, const Point& p) { return BodyD{ShapeKind::cylinder, {{r, 0.4, 0}}, pose(p)}; };
  const BodyD drum = upright(0.2, {0, 0, -0.2});
  EXPECT_EQ(census(touch(upright(0.1, {0.02, 0, 0.2}), drum, 0.01)), "4 rim-cap");
  EXPECT_EQ(census(touch(upright(0.3, {0.02, 0, 0.2}), drum, 0.01)), "4 cap-rim");
  EXPECT_EQ(census(touch(upright(0.2, {0, 0, 0.2}), drum, 0.01)), "4 rim-rim");
  EXPECT_EQ(census(touch(upright(0.2, {0.2, 0, 0.2}), drum, 0.01)), "1 cap-rim 1 rim-cap 2 rim-rim");
  EXPECT_EQ(census(touch(upright(0.1, {0.3, 0, -0.1}), drum, 0.01)), "1 rim-side 1 side-rim");
  const BodyD lying{ShapeKind::cylinder, {{0.1, 0.2, 0}}, pose({0, 0, 0.1}, Vec3::UnitX(), kQuarter)};
  EXPECT_EQ(census(touch(lying, drum, 0.01)), "2 rim-cap");
  const BodyD crossed{ShapeKind::cylinder, {{0.1, 0.4, 0}}, pose({0, 0, 0.3}, Vec3::UnitY(), kQuarter)};
  EXPECT_EQ(census(touch(crossed, lying, 0.01)), "1 side-side");
}

// A foot that is swept over the upper edge of a curb, touching: its gap changes by no more than its way, its normal by
// no more than the way over its radius (the normal turns about the edge), and no normal leads down or to the far side.
TEST(Manifold, foot_over_the_edge_of_a_curb) {
  const BodyD curb{ShapeKind::box, {{1, 0.01, 0.04}}, pose({0, 0, 0.02})};
  const double r = 0.008, step = 1e-5;
  for (double depth : {0.0, 1e-4, 1e-3, 3e-3}) {
    Point last{0, 1, 0};
    double gap = NAN;
    for (int i = 0; i < 2000; ++i) {
      // Along the side, around the edge and along the top, `depth` deep.
      const double reach = r - depth, arc = reach * kQuarter, s = step * i - 5e-3;
      const double angle = s < 0 ? 0 : s < arc ? s / reach : kQuarter;
      const double up = s < 0 ? s : 0, in = s > arc ? s - arc : 0;
      if (in > 4e-3) break;
      const Point p{0.1, 0.005 + reach * std::cos(angle) - in, 0.04 + reach * std::sin(angle) + up};
      const BodyD foot{ShapeKind::sphere, {{r, 0, 0}}, pose(p)};
      const ManifoldD manifold = touch(foot, curb, 0.01);
      ASSERT_EQ(valid_count(manifold), 1);
      const auto& point = manifold.point[0];
      ASSERT_NEAR(point.phi, -depth, 1e-12) << depth << " " << i;
      ASSERT_LE(std::sqrt(norm2(point.n - last)), 1.01 * step / reach) << depth << " " << i;
      ASSERT_TRUE(point.n.z > -1e-12 && point.n.y > -1e-12);
      if (i > 0) {
        ASSERT_LE(std::abs(point.phi - gap), step + 1e-12);
      }
      last = point.n;
      gap = point.phi;
    }
  }
}

// Slots stay: a box that slides and turns a little on a table keeps each corner in its slot.
TEST(Manifold, slots_follow_corners) {
  const BodyD table{ShapeKind::box, {{1, 1, 0.2}}, pose({0, 0, -0.1})};
  Point before[8];
  for (int i = 0; i < 200; ++i) {
    const Point p{1e-3 * i, 1e-4 * i, 0.2 + 1e-6 * std::sin(i)};
    const BodyD box{
        ShapeKind::box, {{0.2, 0.3, 0.4}}, pose(p, Vec3(0.001 * std::cos(i), 0.001, 1).normalized(), 1e-3 * i)};
    const ManifoldD manifold = touch(box, table, 0.01);
    ASSERT_EQ(valid_count(manifold), 4);
    for (int k = 0; k < 8; ++k) {
      if (!manifold.point[k].valid) continue;
      if (i > 0) {
        ASSERT_LT(norm2(manifold.point[k].p - before[k]), 3e-3 * 3e-3) << "step " << i << " slot " << k;
      }
      before[k] = manifold.point[k].p;
    }
  }
}

/// Ground with hills: heights at 9 x 7 grid points, 0.1 m cells.
struct Hills {
  std::vector<double> height;
  HeightView view;
  BodyD body;

  explicit Hills(Random& random, double steepness) : height(9 * 7) {
    for (double& h : height) h = steepness * random.uniform(-0.05, 0.05);
    view = {9, 7, height.data()};
    body = {ShapeKind::heightfield, {{0.8, 0.6, 1.0}, &view}, {random.rotation(), {0.1, 0.2, 0.3}}};
  }
  /// A point of triangle `half` of a cell, at barycentric (u, v).
  Point at(int ix, int iy, bool half, double u, double v) const {
    const auto vertex = [&](int x, int y) { return Point{0.1 * x - 0.4, 0.1 * y - 0.3, height[y * 9 + x]}; };
    const Point a = half ? vertex(ix + 1, iy + 1) : vertex(ix, iy), b = half ? vertex(ix, iy + 1) : vertex(ix + 1, iy),
                c = half ? vertex(ix + 1, iy) : vertex(ix, iy + 1);
    return axpy(u, b - a, axpy(v, c - a, a));
  }
  /// Least distance from x (terrain's frame) to a lattice of points of all triangles.
  double sampled_distance(const Point& x) const {
    constexpr int kPoints = 20;
    double least = 1e300;
    for (int cell = 0; cell < 2 * 8 * 6; ++cell) {
      for (int i = 0; i <= kPoints; ++i) {
        for (int j = 0; i + j <= kPoints; ++j) {
          const Point p = at(cell / 2 % 8, cell / 16, cell % 2, double(i) / kPoints, double(j) / kPoints);
          least = std::min(least, norm2(x - p));
        }
      }
    }
    return std::sqrt(least);
  }
};

// A ball above the hills: its gap is the distance to the nearest of 45000 points of the triangles, less at most the
// lattice's half width (cells of 0.1 m sampled at 0.1 / 20 m: any point is within 0.005 sqrt(2) (1 + slope^2) of one).
TEST(Terrain, ball_above_touches_the_nearest_triangle) {
  Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    const Hills hills(random, 1);
    const Point x{random.uniform(-0.35, 0.35), random.uniform(-0.25, 0.25), random.uniform(0.06, 0.15)};
    const BodyD ball{ShapeKind::sphere, {{0.05, 0, 0}}, {random.rotation(), hills.body.X * x}};
    const ManifoldD manifold = touch(ball, hills.body, 0.2);
    const auto* point = deepest(manifold);
    ASSERT_TRUE(point);
    const double sampled = hills.sampled_distance(x) - 0.05;
    EXPECT_LE(point->phi, sampled + 1e-12);
    EXPECT_GE(point->phi, sampled - 0.01);
    // Exactness: the surface point that the contact names is one of the terrain.
    const Point on_terrain =
        transposed_times(hills.body.X.R, axpy(-0.5 * point->phi, point->n, point->p) - hills.body.X.p);
    const BallOnTerrain there = nearest_on_terrain({&hills.view, hills.body.shape.size}, on_terrain, 0.01);
    ASSERT_GT(there.count, 0);
    EXPECT_NEAR(there.found[0].d, 0, 1e-12);
  }
}

// A flat grid is a plane for every shape, at and below the surface.
TEST(Terrain, flat_grid_is_a_plane) {
  Random random(12);
  std::vector<double> height(5 * 5, 0.5);
  const HeightView view{5, 5, height.data()};
  using enum ShapeKind;
  for (ShapeKind kind : {sphere, capsule, cylinder, box}) {
    for (int trial = 0; trial < 200; ++trial) {
      const PoseD X{random.rotation(), {random.normal(), random.normal(), random.normal()}};
      const BodyD grid{heightfield, {{8, 8, 0.2}, &view}, X};
      const BodyD ground{plane, {}, {X.R, X * Point{0, 0, 0.1}}};
      BodyD body{kind, random.shape(kind), {random.rotation(), {}}};
      const Point up = X.R.column(2);
      const double gap = random.uniform(-0.005, 0.005);
      body.X.p = axpy(support(body, -up) + gap, up, ground.X * Point{random.uniform(-1, 1), random.uniform(-1, 1), 0});
      const ManifoldD manifold = touch(body, grid, 0.01), expected = touch(body, ground, 0.01);
      const auto *point = deepest(manifold), *reference = deepest(expected);
      ASSERT_TRUE(point && reference) << static_cast<int>(kind) << " " << trial;
      ASSERT_NEAR(point->phi, reference->phi, 1e-12);
      ASSERT_LT(norm2(point->n - reference->n), 1e-20);
    }
  }
}

// A ball in a V-shaped valley touches both sides; on a ridge and beyond the rim it behaves.
TEST(Terrain, valley_ridge_and_rim) {
  std::vector<double> height;
  for (int iy = 0; iy < 3; ++iy) {
    for (int ix = 0; ix < 3; ++ix) height.push_back(std::abs(ix - 1.0));
  }
  const HeightView view{3, 3, height.data()};
  const BodyD valley{ShapeKind::heightfield, {{2, 2, 1}, &view}, pose({0, 0, 0})};
  // Sides at 45 degrees: a ball of radius 0.1 rests with its centre 0.1 sqrt 2 above the fold.
  const BodyD ball{ShapeKind::sphere, {{0.1, 0, 0}}, pose({0, 0.1, 0.1 * std::sqrt(2.0)})};
  const ManifoldD both = touch(ball, valley, 0.01);
  ASSERT_EQ(valid_count(both), 2);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(both.point[k].phi, 0, 1e-15);
  EXPECT_NEAR(both.point[0].n.x, -both.point[1].n.x, 1e-15);

  const BodyD ridge{ShapeKind::heightfield, {{2, 2, -1}, &view}, pose({0, 0, 0})};
  // A cylinder lying across the ridge touches it between its ends: by the grid point (0, 0).
  const BodyD log{ShapeKind::cylinder, {{0.1, 1, 0}}, pose({0, 0, 0.095}, Vec3::UnitY(), kQuarter)};
  EXPECT_NEAR(deepest(touch(log, ridge, 0.01))->phi, -0.005, 1e-15);
  const BodyD away{ShapeKind::sphere, {{0.1, 0, 0}}, pose({1.2, 0, -1})};
  EXPECT_EQ(valid_count(touch(away, ridge, 0.01)), 0);
  const BodyD sunk{ShapeKind::sphere, {{0.1, 0, 0}}, pose({0.5, 0.1, -1.5})};
  const ManifoldD below = touch(sunk, ridge, 0.01);
  EXPECT_NEAR(deepest(below)->phi, -1 / std::sqrt(2.0) - 0.1, 1e-12);
}

TEST(Cull, may_touch_never_hides_a_contact) {
  Random random(13);
  for (const KindPair& kinds : kernel_pairs()) {
    for (int trial = 0; trial < 300; ++trial) {
      const auto [a, b] = random_pair(random, kinds.a, kinds.b, trial % 2 == 0);
      if (!deepest(touch(a, b, 0.01))) continue;
      ASSERT_TRUE(may_touch(a.kind, radius(a), a.X, b.kind, radius(b), b.X, 0.01)) << name_of(kinds);
      ASSERT_TRUE(may_touch(b.kind, radius(b), b.X, a.kind, radius(a), a.X, 0.01)) << name_of(kinds);
    }
  }
}

}  // namespace
}  // namespace graze::testing
