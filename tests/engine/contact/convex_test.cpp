// Claims: the gap from GJK and EPA is the exact signed distance and agrees with the lane kernels, which do not know it;
// manifolds of one lane at a time, which the lanes' are held against (hull_pair_test.cpp), carry a standing hull or
// cylinder.

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/contact/bullet_convert.h"
#include "engine/contact/collide.h"
#include "tests/engine/contact/hull_reference.h"
#include "tests/engine/contact/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using testing::BodyD;
using testing::eigen;
using testing::Random;
using testing::touch_plane;
using enum ShapeKind;

std::vector<Vec3> random_corners(Random& random) {
  std::vector<Vec3> out;
  for (int i = 0; i < 20; ++i) out.push_back(eigen(random.direction()) * random.uniform(0.05, 0.1));
  return out;
}

/// A pair near contact; meshes get random corners, held by `corners`.
std::pair<Convex, Convex> random_convex(Random& random, ShapeKind a, ShapeKind b, Corners* corners) {
  Convex out[2];
  for (int i = 0; i < 2; ++i) {
    const ShapeKind kind = i == 0 ? a : b;
    out[i].kind = kind;
    if (kind == mesh) {
      corners[i].assign(random_corners(random));
      out[i].corners = &corners[i];
    } else {
      out[i].size = eigen(random.shape(kind).size);
    }
    out[i].X = eigen(PoseT<double>{random.below(2) ? random.rotation() : random.aligned_rotation(),
                                   {random.normal(), random.normal(), random.normal()}});
  }
  const Vec3 way = random.below(2) ? eigen(random.direction()) : Vec3(out[1].X.linear().col(random.below(3)));
  out[0].X.translation() = out[1].X.translation();
  out[0].X.translation() += way * (random.uniform(-0.04, 0.04) - separation(out[0], out[1], way));
  return {out[0], out[1]};
}

/// By Bullet's GJK on hulls without margins; 0 or less where they overlap.
double bullets_distance(const Convex& a, const Convex& b, Vec3& n) {
  const auto shape_of = [](const Convex& convex) {
    auto out = std::make_unique<btConvexHullShape>();
    const Vec3 half = 0.5 * convex.size;
    for (int k = 0; convex.kind == box && k < 8; ++k) {
      out->addPoint({k & 1 ? half.x() : -half.x(), k & 2 ? half.y() : -half.y(), k & 4 ? half.z() : -half.z()}, false);
    }
    for (std::size_t k = 0; convex.corners && k < convex.corners->size(); ++k) {
      out->addPoint(to_bt((*convex.corners)[k]), false);
    }
    out->recalcLocalAabb();
    out->setMargin(0);
    return out;
  };
  const auto first = shape_of(a), second = shape_of(b);
  btGjkEpaSolver2::sResults result;
  const btVector3 guess(1, 0, 0);
  if (!btGjkEpaSolver2::Distance(first.get(), to_bt(a.X), second.get(), to_bt(b.X), guess, result)) return 0;
  n = from_bt(result.witnesses[0] - result.witnesses[1]).normalized();
  return result.distance;
}

constexpr std::pair<ShapeKind, ShapeKind> kPairs[] = {{cylinder, cylinder}, {cylinder, box},  {mesh, mesh},
                                                      {mesh, box},          {mesh, cylinder}, {mesh, sphere},
                                                      {mesh, capsule},      {box, box},       {capsule, cylinder}};

// The normal parts the shapes by phi (gap at least phi); the points lie on the shapes' supports, phi apart (a positive
// gap is at most phi). GJK ends at a relative 1e-12 of the squared distance; round shapes make it stop on the step
// size: 1e-6 m.
TEST(ConvexGap, is_proved_by_its_normal_and_points) {
  Random random(21);
  for (const auto& [kind_a, kind_b] : kPairs) {
    for (int trial = 0; trial < test::trials(800); ++trial) {
      Corners corners[2];
      const auto [a, b] = random_convex(random, kind_a, kind_b, corners);
      const Gap gap = gap_between(a, b);
      ASSERT_NEAR(gap.n.norm(), 1, 1e-9);
      ASSERT_NEAR(separation(a, b, gap.n), gap.phi, 1e-6) << int(kind_a) << int(kind_b) << " " << trial;
      ASSERT_LT((gap.p_a - gap.p_b - gap.phi * gap.n).norm(), 1e-6) << int(kind_a) << int(kind_b) << " " << trial;
    }
  }
}

// Overlaps: of 3000 random directions none parts the shapes by less than the gap says.
TEST(ConvexGap, overlap_is_least) {
  Random random(22);
  for (const auto& [kind_a, kind_b] : kPairs) {
    int overlapping = 0;
    for (int trial = 0; trial < test::trials(150); ++trial) {
      Corners corners[2];
      const auto [a, b] = random_convex(random, kind_a, kind_b, corners);
      const Gap gap = gap_between(a, b);
      if (gap.phi >= 0) continue;
      ++overlapping;
      for (int i = 0; i < 3000; ++i) {
        const Vec3 n = i % 2 ? eigen(random.direction())
                             : Vec3((gap.n + 0.1 * random.uniform(0, 1) * eigen(random.direction())).normalized());
        ASSERT_LT(separation(a, b, n), gap.phi + 1e-6) << int(kind_a) << int(kind_b) << " " << trial;
      }
    }
    EXPECT_GT(overlapping, test::trials(20));
  }
}

// Two algorithms that share no line agree on every pair that both know.
TEST(ConvexGap, agrees_with_lane_kernels) {
  Random random(23);
  for (const auto& [kind_a, kind_b] : testing::kernel_pairs()) {
    if (kind_b == plane) continue;
    for (int trial = 0; trial < test::trials(500); ++trial) {
      const auto [a, b] = testing::random_pair(random, kind_a, kind_b, trial % 2 == 0);
      const auto manifold = testing::touch(a, b, 0.5);
      const auto* point = testing::deepest(manifold);
      ASSERT_TRUE(point);
      // Deep capsules in cylinders: the kernel's gap is a bound (capsule.h).
      if (kind_a == capsule && kind_b == cylinder && point->phi <= -a.shape.size.x) continue;
      const Gap gap = gap_between({kind_a, eigen(a.shape.size), eigen(a.X)}, {kind_b, eigen(b.shape.size), eigen(b.X)});
      ASSERT_NEAR(gap.phi, point->phi, 1e-6) << testing::name_of({kind_a, kind_b}) << " " << trial;
    }
  }
}

// A question for "at least so much" is answered as the gap itself answers it, by a direction that parts the shapes.
TEST(ConvexGap, bound_says_no_more_than_the_gap) {
  Random random(26);
  int bounds = 0;
  for (const auto& [kind_a, kind_b] : kPairs) {
    for (int trial = 0; trial < test::trials(800); ++trial) {
      Corners corners[2];
      const auto [a, b] = random_convex(random, kind_a, kind_b, corners);
      const double enough = random.uniform(-0.01, 0.03);
      const Gap gap = gap_between(a, b), bound = gap_between(a, b, enough);
      ASSERT_EQ(bound.phi > enough, gap.phi > enough) << int(kind_a) << int(kind_b) << " " << trial;
      if (bound.phi == gap.phi) continue;
      ++bounds;
      ASSERT_GT(bound.phi, enough);
      ASSERT_LE(bound.phi, gap.phi + 1e-12);
      ASSERT_NEAR(separation(a, b, bound.n), bound.phi, 1e-12);
    }
  }
  EXPECT_GT(bounds, test::trials(800));
}

// Pairs of hulls: the distance is that of Bullet's own GJK, which shares no line with this one, and no overlap is
// missed or made up. What Bullet answers counts where its own direction proves it; now and then, with faces aligned, it
// is wrong by centimetres.
TEST(ConvexGap, of_hulls_agrees_with_bullets) {
  Random random(27);
  const int trials = std::getenv("GRAZE_LONG") ? 100'000 : test::trials(4000);
  int apart = 0, overlapping = 0, unproved = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Corners corners[2];
    const auto [a, b] = random_convex(random, mesh, trial % 2 ? mesh : box, corners);
    const Gap gap = gap_between(a, b);
    ASSERT_LT(std::abs(separation(a, b, gap.n) - gap.phi), 1e-9) << trial;
    Vec3 n = gap.n;
    const double bullets = bullets_distance(a, b, n);
    const bool proved = bullets > 0 && separation(a, b, n) > bullets - 1e-6;
    unproved += bullets > 0 && !proved;
    if (gap.phi > 1e-6) {
      ++apart;
      ASSERT_NEAR((gap.p_a - gap.p_b).norm(), gap.phi, 1e-9);
      ASSERT_GT(bullets, gap.phi - 1e-9) << trial;  // no points are nearer than what the direction proves
      if (proved) {
        ASSERT_LT(bullets, gap.phi + 1e-6) << trial;
      }
    } else if (gap.phi < -1e-6) {
      ++overlapping;
      ASSERT_FALSE(proved) << trial << ": " << gap.phi << " against " << bullets;
    }
  }
  EXPECT_GT(apart, trials / 10);
  EXPECT_GT(overlapping, trials / 10);
  EXPECT_LT(unproved, trials / 50);
}

int valid_count(const ConvexManifold& manifold) {
  return static_cast<int>(std::count_if(manifold.begin(), manifold.end(), [](const auto& p) { return p.valid; }));
}

/// Whether the vertical through `p` meets the polygon spanned by the points: no half plane through it holds them all.
bool carries(const ConvexManifold& manifold, const Vec3& p) {
  for (int k = 0; k < 360; ++k) {
    const Vec3 way(std::cos(k * 0.0174533), std::sin(k * 0.0174533), 0);
    double most = -1;
    for (const ManifoldPoint& point : manifold) {
      if (point.valid) most = std::max(most, way.dot(point.p - p));
    }
    if (most <= 0) return false;
  }
  return true;
}

Pose at(const Vec3& p, double tilt = 0) {
  Pose X = Pose::Identity();
  X.linear() = Mat3(Eigen::AngleAxisd(tilt, Vec3::UnitX()));
  X.translation() = p;
  return X;
}

TEST(ConvexManifold, hulls_and_cylinders_stand) {
  std::vector<Vec3> dice;
  for (int k = 0; k < 8; ++k) dice.emplace_back(k & 1 ? 0.1 : -0.1, k & 2 ? 0.1 : -0.1, k & 4 ? 0.1 : -0.1);
  const Corners cube(dice);
  const Convex table{box, {1, 1, 0.2}, at({0, 0, -0.1})};
  for (double tilt : {0.0, 1e-9, 1e-4}) {
    const Convex die{mesh, Vec3::Ones(), at({0.05, 0.02, 0.1}, tilt), &cube},
        can{cylinder, {0.1, 0.2, 0}, at({0, 0, 0.1}, tilt)};
    const Convex stool{cylinder, {0.3, 0.2, 0}, at({0, 0, -0.1})};
    EXPECT_EQ(valid_count(touch_plane(die, Pose::Identity(), 0.01)), 4);
    EXPECT_EQ(valid_count(touch_convex(die, table, 0.01)), 4) << tilt;
    for (const ConvexManifold& manifold :
         {touch_plane(die, Pose::Identity(), 0.01), touch_convex(die, table, 0.01), touch_convex(die, stool, 0.01)}) {
      EXPECT_TRUE(carries(manifold, die.X.translation())) << tilt;
    }
    EXPECT_TRUE(carries(touch_convex(can, table, 0.01), can.X.translation())) << tilt;
    EXPECT_TRUE(carries(touch_convex(can, stool, 0.01), can.X.translation())) << tilt;
  }
  // Lying: two points at the ends of the side.
  const Convex log{cylinder, {0.1, 0.4, 0}, at({0, 0, 0.1}, 1.5707963267948966)};
  const ConvexManifold lying = touch_convex(log, table, 0.01);
  EXPECT_EQ(valid_count(lying), 2);
}

// A manifold's least gap is the pair's gap.
TEST(ConvexManifold, deepest_point_has_the_gap) {
  Random random(24);
  for (const auto& [kind_a, kind_b] : kPairs) {
    for (int trial = 0; trial < test::trials(400); ++trial) {
      Corners corners[2];
      const auto [a, b] = random_convex(random, kind_a, kind_b, corners);
      const Gap gap = gap_between(a, b);
      double least = 1e300;
      for (const ManifoldPoint& point : touch_convex(a, b, 1)) {
        if (point.valid) least = std::min(least, point.phi);
      }
      // Clipping one of two faces that are parallel but for 3 degrees can reach below the gap of overlapping shapes.
      ASSERT_LE(least, gap.phi + 1e-12);
      if (gap.phi > 0) {
        ASSERT_GT(least, gap.phi - 2e-3) << int(kind_a) << int(kind_b) << " " << trial;
      }
    }
  }
}

}  // namespace
}  // namespace graze
