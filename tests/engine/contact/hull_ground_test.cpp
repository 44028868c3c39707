// Claims: a hull's kernels for planes and terrain give the points that one lane at a time gives; every lane has the
// bits that it has alone, whatever its scale and its neighbours'; of eight corners it is a box; and points are where it
// may come to lie within the step.

#include <gtest/gtest.h>

#include <cstring>

#include "engine/contact/collide.h"
#include "engine/contact/hull_arrays.h"
#include "tests/engine/contact/hull_reference.h"
#include "tests/engine/contact/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using testing::BodyD;
using testing::eigen;
using testing::Random;

/// Corners on a ball, or a slab, whose faces lie flat.
Hull random_hull(Random& random) {
  Hull out;
  const bool slab = random.below(2) == 0;
  const int count = 4 + random.below(30);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = 0.1 * eigen(random.direction());
    out.corners.push_back(slab ? Vec3(p.x(), p.y(), i % 2 ? 0.03 : -0.03) : p);
  }
  return out;
}

/// A hull of its own scale near some ground.
struct Placed {
  BodyD hull, ground;
};

std::vector<double> random_heights(Random& random) {
  std::vector<double> out;
  for (int i = 0; i < 81; ++i) out.push_back(random.uniform(-0.02, 0.02));
  return out;
}

Placed random_placed(Random& random, const HullView& hull, const HeightView* terrain) {
  const auto rotation = [&] { return random.below(2) ? random.rotation() : random.aligned_rotation(); };
  Placed out;
  out.hull = {ShapeKind::mesh,
              {{random.uniform(0.5, 2), random.uniform(0.5, 2), random.uniform(0.5, 2)}, nullptr, &hull},
              {rotation(), {}}};
  out.ground.kind = terrain ? ShapeKind::heightfield : ShapeKind::plane;
  if (terrain) out.ground.shape = {{1, 1, random.uniform(0.5, 2)}, terrain};
  out.ground.X = {rotation(), {random.normal(), random.normal(), random.normal()}};
  const Vec3T<double> n = out.ground.X.R.column(2);
  const double reach = reach_of_shape(ShapeKind::mesh, out.hull.shape, out.hull.X, -n);
  out.hull.X.p = axpy(reach + random.uniform(-0.03, 0.01), n, out.ground.X.p);
  out.hull.X.p += random.uniform(-0.5, 0.5) * out.ground.X.R.column(0);
  return out;
}

ConvexManifold reference(const Hull& hull, const Placed& placed, const HeightView* terrain, double margin) {
  std::vector<Vec3> corners;
  const Vec3 size = eigen(placed.hull.shape.size);
  for (const Vec3& corner : hull.corners) corners.push_back((corner - hull.centre).cwiseProduct(size));
  const Corners scaled(corners);
  const Convex convex{ShapeKind::mesh, size, eigen(placed.hull.X), &scaled};
  const Pose X = eigen(placed.ground.X);
  if (!terrain) return testing::touch_plane(convex, X, margin);
  return testing::touch_terrain(convex, *terrain, eigen(placed.ground.shape.size), X, margin);
}

/// What the lanes of a pack have.
template <class T>
struct Lanes {
  ShapeT<T> a, b;
  PoseT<T> Xa, Xb;
};

/// The first lane's terrain is the first of as many as there are lanes.
template <class T>
Lanes<T> on_lanes(const std::vector<Placed>& placed) {
  constexpr int W = kWidth<T>;
  double rows[30][W];  // rotation, place and size of both
  for (int lane = 0; lane < W; ++lane) {
    const auto put = [&](int row, const BodyD& body) {
      const double* R = body.X.R.m;
      for (int i = 0; i < 9; ++i) rows[row + i][lane] = R[i];
      const Vec3 p = eigen(body.X.p), size = eigen(body.shape.size);
      for (int i = 0; i < 3; ++i) rows[row + 9 + i][lane] = p[i], rows[row + 12 + i][lane] = size[i];
    };
    put(0, placed[lane].hull);
    put(15, placed[lane].ground);
  }
  return {{load_vec3<T>(rows[12]), nullptr, placed[0].hull.shape.hull},
          {load_vec3<T>(rows[27]), placed[0].ground.shape.terrain},
          load_pose<T>(rows[0]),
          load_pose<T>(rows[15])};
}

class HullGround : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(, HullGround, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "terrain" : "plane"; });

TEST_P(HullGround, has_the_points_of_one_lane_at_a_time) {
  Random random(31);
  const std::vector<double> heights = random_heights(random);
  const HeightView view{9, 9, heights.data()}, *terrain = GetParam() ? &view : nullptr;
  int points = 0;
  for (int trial = 0; trial < test::trials(4000); ++trial) {
    const Hull hull = random_hull(random);
    const HullArrays arrays(hull);
    const HullView view_of_hull = arrays.view();
    const Placed placed = random_placed(random, view_of_hull, terrain);
    const double margin = random.uniform(0, 0.02);
    const testing::ManifoldD found = testing::touch(placed.hull, placed.ground, margin);
    const ConvexManifold expected = reference(hull, placed, terrain, margin);
    ASSERT_EQ(found.count, 8);
    for (int k = 0; k < 8; ++k) {
      ASSERT_EQ(found.point[k].valid, expected[k].valid) << trial << " " << k;
      if (!expected[k].valid) continue;
      ++points;
      ASSERT_NEAR(found.point[k].phi, expected[k].phi, 1e-12) << trial << " " << k;
      ASSERT_LT((eigen(found.point[k].p) - expected[k].p).norm(), 1e-12) << trial << " " << k;
      ASSERT_LT((eigen(found.point[k].n) - expected[k].n).norm(), 1e-9) << trial << " " << k;
    }
  }
  EXPECT_GT(points, test::trials(4000));
}

TEST_P(HullGround, gives_each_lane_its_own_bits) {
  using T = Pack<8>;
  Random random(32);
  std::vector<std::vector<double>> heights;
  std::vector<HeightView> views;
  for (int lane = 0; lane < 8; ++lane) heights.push_back(random_heights(random));
  for (const std::vector<double>& one : heights) views.push_back({9, 9, one.data()});
  for (int trial = 0; trial < test::trials(500); ++trial) {
    const HullArrays arrays(random_hull(random));
    const HullView hull = arrays.view();
    std::vector<Placed> placed;
    for (const HeightView& view : views) placed.push_back(random_placed(random, hull, GetParam() ? &view : nullptr));
    if (trial % 5 == 0) placed[trial % 8].hull.X.p.x = std::nan("");
    const Lanes<T> lanes = on_lanes<T>(placed);
    ManifoldT<T> together;
    collide<T>(kinds::mesh, lanes.a, lanes.Xa, placed[0].ground.kind, lanes.b, lanes.Xb, T(0.005), together);
    for (int lane = 0; lane < 8; ++lane) {
      const testing::ManifoldD alone = testing::touch(placed[lane].hull, placed[lane].ground, 0.005);
      for (int k = 0; k < 8; ++k) {
        const bool valid = bits(together.point[k].valid) >> lane & 1u;
        ASSERT_EQ(valid, alone.point[k].valid) << trial << " " << lane << " " << k;
        if (!valid) continue;
        ASSERT_EQ(lane_of(together.point[k].phi, lane), alone.point[k].phi);
        ASSERT_EQ(eigen(lane_of(together.point[k].p, lane)), eigen(alone.point[k].p));
        ASSERT_EQ(eigen(lane_of(together.point[k].n, lane)), eigen(alone.point[k].n));
      }
    }
  }
}

// A hull of eight corners is a box: same gaps at the same corners.
TEST(HullOnPlane, of_eight_corners_is_a_box) {
  Random random(33);
  Hull cube;
  for (int k = 0; k < 8; ++k) cube.corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  const HullArrays arrays(cube);
  const HullView view = arrays.view();
  int flats = 0;
  for (int trial = 0; trial < test::trials(2000); ++trial) {
    const auto [box, plane] = testing::random_pair(random, ShapeKind::box, ShapeKind::plane, trial % 2 == 0);
    const BodyD hull{ShapeKind::mesh, {box.shape.size, nullptr, &view}, box.X};
    const auto of_box = testing::touch(box, plane, 0.01), of_hull = testing::touch(hull, plane, 0.01);
    const auto *expected = testing::deepest(of_box), *found = testing::deepest(of_hull);
    ASSERT_EQ(expected == nullptr, found == nullptr) << trial;
    if (!expected) continue;
    EXPECT_NEAR(found->phi, expected->phi, 1e-13);
    // Its points are corners, and a face has all four.
    double highest = -1e300;
    for (int k = 0; k < 8; ++k) {
      if (of_box.point[k].valid) highest = std::max(highest, of_box.point[k].phi);
    }
    const bool flat = testing::valid_count(of_box) == 4 && highest < expected->phi + 1e-9;
    EXPECT_TRUE(!flat || testing::valid_count(of_hull) == 4) << trial;
    flats += flat;
  }
  EXPECT_GT(flats, test::trials(100));
}

/// A square sole of 10 cm and 0.5 mm above it a square rim that reaches 1 cm further: a slope of 1 in 20.
Hull sole_with_rim() {
  Hull out;
  for (int k = 0; k < 4; ++k) out.corners.emplace_back(k & 1 ? 0.05 : -0.05, k & 2 ? 0.05 : -0.05, -0.03);
  for (int k = 0; k < 4; ++k) out.corners.emplace_back(k & 1 ? 0.06 : -0.06, k & 2 ? 0.06 : -0.06, -0.0295);
  for (int k = 0; k < 4; ++k) out.corners.emplace_back(k & 1 ? 0.06 : -0.06, k & 2 ? 0.06 : -0.06, 0.03);
  return out;
}

// At rest, when points may go 1 mm within the step, it lies on its sole, although its rim is as near. When they may go
// 10 mm, it may come to lie on the rim, and the sole's corners have no slot of their own; the deepest gap stays.
TEST(HullOnPlane, lies_where_it_may_come_to_lie) {
  Random random(34);
  const HullArrays arrays(sole_with_rim());
  const HullView view = arrays.view();
  for (int trial = 0; trial < 100; ++trial) {
    const double turn = random.uniform(-3, 3), c = std::cos(turn), s = std::sin(turn);
    const RotT<double> R{{c, -s, 0, s, c, 0, 0, 0, 1}};
    const BodyD hull{ShapeKind::mesh, {{1, 1, 1}, nullptr, &view}, {R, {random.normal(), random.normal(), 0.03}}};
    const BodyD plane{ShapeKind::plane, {}, {{{1, 0, 0, 0, 1, 0, 0, 0, 1}}, {0, 0, 0}}};
    const auto at_rest = testing::touch(hull, plane, 1e-3), fast = testing::touch(hull, plane, 1e-2);
    ASSERT_EQ(testing::valid_count(at_rest), 4) << trial;
    ASSERT_EQ(testing::valid_count(fast), 4) << trial;
    ASSERT_NEAR(testing::deepest(fast)->phi, 0, 1e-15);
    for (int k = 0; k < 8; ++k) {
      if (at_rest.point[k].valid) {
        EXPECT_NEAR(at_rest.point[k].phi, 0, 1e-15) << trial;
      }
      if (!fast.point[k].valid) continue;
      const double away = (eigen(fast.point[k].p) - eigen(hull.X.p)).head<2>().norm();
      EXPECT_GT(away, fast.point[k].phi > 1e-6 ? 0.0848 : 0.0707) << trial;
    }
  }
}

}  // namespace
}  // namespace graze
