// Claims: the kernels of pairs of hulls give the gap that one lane at a time gives, and prove it; every lane has the
// bits that it has alone; a hull of eight corners is a box, and one of many on a ball is nearly the ball.

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

#include "engine/contact/collide.h"
#include "engine/contact/convex_gap.h"
#include "engine/contact/hull_arrays.h"
#include "tests/engine/contact/convex_manifold.h"
#include "tests/engine/contact/support.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using testing::BodyD;
using testing::eigen;
using testing::ManifoldD;
using testing::Random;
using enum ShapeKind;

constexpr ShapeKind kOthers[] = {sphere, capsule, cylinder, box, mesh};

/// Corners on a ball, or a slab, whose faces lie flat.
Hull slab_or_ball(Random& random) {
  Hull out;
  const bool slab = random.below(2) == 0;
  const int count = 6 + random.below(40);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = random.uniform(0.07, 0.1) * eigen(random.direction());
    out.corners.push_back(slab ? Vec3(p.x(), p.y(), i % 2 ? 0.03 : -0.03) : p);
  }
  return out;
}

/// A body with what the scalar way wants of it.
struct Solid {
  BodyD body;
  Corners corners;

  Convex convex() const { return {body.kind, eigen(body.shape.size), eigen(body.X), &corners}; }
};

Solid random_solid(Random& random, ShapeKind kind, const HullView& hull) {
  Solid out;
  out.body = {kind, random.shape(kind), {random.below(2) ? random.rotation() : random.aligned_rotation(), {0, 0, 0}}};
  if (kind != mesh) return out;
  out.body.shape = {{random.uniform(0.5, 2), random.uniform(0.5, 2), random.uniform(0.5, 2)}, nullptr, &hull};
  std::vector<Vec3> corners;
  for (int k = 0; k < hull.count; ++k) corners.push_back(eigen(hull_corner(out.body.shape, k)));
  out.corners.assign(corners);
  return out;
}

/// Apart, touching or overlapping by up to `depth`.
struct Pair {
  Solid a, b;
};
Pair random_pair(Random& random, ShapeKind kind, const HullView& hull, const HullView& other, double depth) {
  Pair out{random_solid(random, kind, other), random_solid(random, mesh, hull)};
  BodyD &a = out.a.body, &b = out.b.body;
  b.X.p = {random.normal(), random.normal(), random.normal()};
  a.X.p = b.X.p;
  const Vec3 way = eigen(random.below(2) ? random.direction() : b.X.R.column(random.below(3)));
  const double gap = random.below(8) == 0 ? 0 : random.uniform(-depth, 0.02);
  const Vec3 p = eigen(b.X.p) + way * (gap - separation(out.a.convex(), out.b.convex(), way));
  a.X.p = {p.x(), p.y(), p.z()};
  return out;
}

CoreT<double> core_of(const BodyD& body) { return {body.kind, body.shape, body.X}; }

// Of the corners that lie furthest the first is found, looked at one lane at a time (few lanes ask) or all together:
// the place where it lies is exactly that of a plain search. Half of the corners lie twice, and on a grid many lie as
// far.
TEST(HullPair, finds_the_first_of_the_furthest_corners) {
  using T = Pack<8>;
  Random random(46);
  for (int trial = 0; trial < test::trials(2000); ++trial) {
    Hull grid;
    const int count = 1 + random.below(140);
    for (int k = 0; k < count; ++k) {
      const auto at = [&] { return 0.1 * (random.below(5) - 2); };
      grid.corners.push_back(k % 4 == 3 ? grid.corners[k / 2] : Vec3(at(), at(), at()));
    }
    const HullArrays arrays(grid);
    const HullView hull = arrays.view();
    double rows[6][8];
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3 n = random.below(2) ? eigen(random.direction()) : Vec3(random.below(3) - 1, random.below(3) - 1, 1);
      for (int i = 0; i < 3; ++i) rows[i][lane] = n[i], rows[3 + i][lane] = random.uniform(0.5, 2);
    }
    if (trial % 7 == 0) rows[0][trial % 8] = std::nan("");
    const Vec3T<T> n{load<T>(rows[0]), load<T>(rows[1]), load<T>(rows[2])};
    const Vec3T<T> size{load<T>(rows[3]), load<T>(rows[4]), load<T>(rows[5])};
    const unsigned lanes = trial % 3 == 0 ? 0xffu : static_cast<unsigned>(random.below(256));
    const Vec3T<T> found = furthest_corner<T>(hull, size, n, mask_from_bits<T>(lanes));
    for (int lane = 0; lane < 8; ++lane) {
      if (!(lanes >> lane & 1u)) continue;
      const Vec3 s = eigen(lane_of(size, lane)), way = eigen(lane_of(n, lane)).cwiseProduct(s);
      int best = 0;
      double most = -1e300;
      for (int k = 0; k < count; ++k) {
        const Vec3 c = arrays.corner(k);
        const double along = std::fma(c.z(), way.z(), std::fma(c.y(), way.y(), c.x() * way.x()));
        if (along > most) most = along, best = k;
      }
      ASSERT_EQ(eigen(lane_of(found, lane)), arrays.corner(best).cwiseProduct(s)) << trial << " " << lane;
    }
  }
}

// Apart: the gap is that of the scalar way, which tests hold against Bullet's; it and the direction prove each other.
// Overlapping: no direction that the scalar way finds, by Bullet's EPA, leads out by less.
TEST(HullPair, gap_is_exact) {
  Random random(41);
  const int trials = std::getenv("GRAZE_LONG") ? 20'000 : test::trials(3000);
  for (const ShapeKind kind : kOthers) {
    int apart = 0, overlapping = 0, worse = 0;
    const double tolerance = kind == cylinder ? 1e-6 : 1e-9;
    for (int trial = 0; trial < trials; ++trial) {
      const HullArrays arrays(slab_or_ball(random)), others(slab_or_ball(random));
      const HullView hull = arrays.view(), other = others.view();
      const Pair pair = random_pair(random, kind, hull, other, 0.02);
      const CoreGapT<double> gap = gap_of_cores(core_of(pair.a.body), core_of(pair.b.body), 1.0);
      const Convex a = pair.a.convex(), b = pair.b.convex();
      const Vec3 n = eigen(gap.n);
      ASSERT_NEAR(n.norm(), 1, 1e-9);
      ASSERT_NEAR(separation(a, b, n), gap.phi, tolerance) << int(kind) << " " << trial;
      ASSERT_LT((eigen(gap.p_a) - eigen(gap.p_b) - gap.phi * n).norm(), tolerance) << int(kind) << " " << trial;
      const Gap expected = gap_between(a, b);
      if (expected.phi > 1e-6) {
        ++apart;
        ASSERT_NEAR(gap.phi, expected.phi, tolerance) << int(kind) << " " << trial;
      } else {
        overlapping += expected.phi < -1e-6;
        worse += gap.phi < expected.phi - 1e-6;
        ASSERT_LT(gap.phi, 1e-6);
      }
    }
    if (!GRAZE_SANITIZED) {  // there so few are tried that chance decides
      EXPECT_GT(apart, trials / 10);
      EXPECT_GT(overlapping, trials / 10);
    }
    EXPECT_LE(worse, trials / 500) << int(kind);
  }
}

/// Numbers of eight bodies side by side.
template <class T>
struct LanesOf {
  ShapeT<T> shape;
  PoseT<T> X;

  template <class Body>
  explicit LanesOf(const Body& body) {
    const auto row = [&](const auto& number) {
      double out[8];
      for (int lane = 0; lane < 8; ++lane) out[lane] = number(body(lane));
      return load<T>(out);
    };
    const auto vec = [&](const auto& v) {
      return Vec3T<T>{row([&](const BodyD& of) { return v(of).x; }), row([&](const BodyD& of) { return v(of).y; }),
                      row([&](const BodyD& of) { return v(of).z; })};
    };
    shape = {vec([](const BodyD& of) { return of.shape.size; }), nullptr, body(0).shape.hull};
    for (int i = 0; i < 9; ++i) X.R.m[i] = row([i](const BodyD& of) { return of.X.R.m[i]; });
    X.p = vec([](const BodyD& of) { return of.X.p; });
  }
};

TEST(HullPair, gives_each_lane_its_own_bits) {
  using T = Pack<8>;
  Random random(42);
  for (int trial = 0; trial < test::trials(1000); ++trial) {
    const ShapeKind kind = kOthers[trial % 5];
    const HullArrays arrays(slab_or_ball(random)), others(slab_or_ball(random));
    const HullView hull = arrays.view(), other = others.view();
    std::vector<Pair> pairs;
    for (int lane = 0; lane < 8; ++lane) pairs.push_back(random_pair(random, kind, hull, other, 0.005));
    if (trial % 7 == 0) pairs[trial % 8].a.body.X.p.x = std::nan("");
    const LanesOf<T> a([&](int lane) -> const BodyD& { return pairs[lane].a.body; });
    const LanesOf<T> b([&](int lane) -> const BodyD& { return pairs[lane].b.body; });
    ManifoldT<T> together;
    collide<T>(kind, a.shape, a.X, mesh, b.shape, b.X, T(0.005), together);
    for (int lane = 0; lane < 8; ++lane) {
      const ManifoldD alone = testing::touch(pairs[lane].a.body, pairs[lane].b.body, 0.005);
      if (trial % 7 == 0 && lane == trial % 8) continue;  // NaN is not itself
      ASSERT_EQ(eigen(lane_of(together.axis, lane)), eigen(alone.axis));
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

// No contact is missed, none is nearer than the gap, the deepest has it, and a point lies on both shapes to within what
// 3 degrees of tilt leave of faces that lie along each other.
TEST(HullPair, points_have_the_gap_and_lie_between) {
  Random random(43);
  for (const ShapeKind kind : kOthers) {
    int touching = 0, points = 0;
    for (int trial = 0; trial < test::trials(2000); ++trial) {
      const HullArrays arrays(slab_or_ball(random)), others(slab_or_ball(random));
      const HullView hull = arrays.view(), other = others.view();
      const Pair pair = random_pair(random, kind, hull, other, 0.002);
      const double margin = random.uniform(0, 0.01);
      const CoreGapT<double> gap = gap_of_cores(core_of(pair.a.body), core_of(pair.b.body), margin);
      const ManifoldD found = testing::touch(pair.a.body, pair.b.body, margin);
      const auto* deepest = testing::deepest(found);
      ASSERT_EQ(deepest != nullptr, gap.phi < margin) << int(kind) << " " << trial;
      if (!deepest) continue;
      ++touching;
      points += testing::valid_count(found);
      ASSERT_NEAR(deepest->phi, gap.phi, 1e-9) << int(kind) << " " << trial;
      const Convex a = pair.a.convex(), b = pair.b.convex();
      for (int k = 0; k < 8; ++k) {
        if (!found.point[k].valid) continue;
        const Convex dot{sphere, Vec3(1e-9, 0, 0), Pose(Eigen::Translation3d(eigen(found.point[k].p)))};
        const double half = 0.5 * std::abs(found.point[k].phi), loose = 0.0055;
        ASSERT_LT(gap_between(dot, a).phi, half + loose) << int(kind) << " " << trial;
        ASSERT_LT(gap_between(dot, b).phi, half + loose) << int(kind) << " " << trial;
      }
    }
    EXPECT_GT(touching, GRAZE_SANITIZED ? 0 : test::trials(100));
    EXPECT_GE(points, touching);
  }
}

Hull cube() {
  Hull out;
  for (int k = 0; k < 8; ++k) out.corners.emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  return out;
}

// A hull of eight corners is a box: the same gap from every shape, and four points where a face lies on a face.
TEST(HullPair, of_eight_corners_is_a_box) {
  Random random(44);
  const HullArrays arrays(cube());
  const HullView view = arrays.view();
  for (const ShapeKind kind : {sphere, capsule, cylinder, box}) {
    int worse = 0, flats = 0;
    for (int trial = 0; trial < test::trials(3000); ++trial) {
      const auto [a, b] = testing::random_pair(random, kind, box, trial % 2 == 0);
      const BodyD hull{mesh, {b.shape.size, nullptr, &view}, b.X};
      const ManifoldD of_box = testing::touch(a, b, 0.01), of_hull = testing::touch(a, hull, 0.01);
      const auto *expected = testing::deepest(of_box), *found = testing::deepest(of_hull);
      ASSERT_EQ(expected == nullptr, found == nullptr) << int(kind) << " " << trial;
      if (!expected) continue;
      const double tolerance = kind == cylinder ? 1e-6 : 1e-9;
      if (expected->phi > 0) {
        ASSERT_NEAR(found->phi, expected->phi, tolerance) << int(kind) << " " << trial;
      } else {
        worse += std::abs(found->phi - expected->phi) > 1e-6;
      }
      if (kind != box || std::abs(found->phi) > 1e-3 || testing::valid_count(of_box) < 4) continue;
      ++flats;
      EXPECT_GE(testing::valid_count(of_hull), 3) << trial;
    }
    EXPECT_LE(worse, test::trials(3000) / 100) << int(kind);
  }
}

// Corners on a ball of radius r, so close that its hull reaches r (1 - 1e-3): every gap is that of the ball, within
// this.
TEST(HullPair, of_many_corners_is_nearly_a_ball) {
  Random random(45);
  Hull fine;
  constexpr int kCorners = 2000;
  for (int i = 0; i < kCorners; ++i) {  // a spiral with even spacing
    const double z = (2.0 * i + 1) / kCorners - 1, angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - z * z);
    fine.corners.emplace_back(across * std::cos(angle), across * std::sin(angle), z);
  }
  const HullArrays arrays(fine);
  const HullView view = arrays.view();
  for (const ShapeKind kind : {sphere, capsule, box}) {
    for (int trial = 0; trial < test::trials(200); ++trial) {
      const auto [a, b] = testing::random_pair(random, kind, sphere, false);
      const double r = b.shape.size.x;
      const BodyD hull{mesh, {{r, r, r}, nullptr, &view}, {random.rotation(), b.X.p}};
      const ManifoldD of_ball = testing::touch(a, b, 1), of_hull = testing::touch(a, hull, 1);
      ASSERT_TRUE(testing::deepest(of_ball) && testing::deepest(of_hull));
      const double gap = testing::deepest(of_ball)->phi, found = testing::deepest(of_hull)->phi;
      if (gap < -0.1 * r) continue;  // deep: the least way out is not unique
      EXPECT_GT(found, gap - 1e-9) << int(kind) << " " << trial;
      EXPECT_LT(found, gap + 3e-3 * r) << int(kind) << " " << trial;
    }
  }
}

}  // namespace
}  // namespace graze
