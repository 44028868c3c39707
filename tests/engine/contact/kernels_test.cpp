// Claims: the kernels' gap is the bodies' exact signed distance, their points lie on both surfaces, and neither the
// order of the bodies, nor the lane, nor degenerate poses matter.

#include <gtest/gtest.h>

#include <cstring>

#include "tests/engine/contact/support.h"

namespace graze::testing {
namespace {

constexpr double kMargin = 0.5;  // m, beyond all gaps here

class Kernels : public ::testing::TestWithParam<KindPair> {};
class BoundedKernels : public Kernels {};

std::vector<KindPair> bounded_pairs() {
  std::vector<KindPair> out = kernel_pairs();
  std::erase_if(out, [](const KindPair& pair) { return pair.b == ShapeKind::plane; });
  return out;
}
std::string test_name(const ::testing::TestParamInfo<KindPair>& info) {
  std::string name = name_of(info.param);
  name[name.find('-')] = '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(All, Kernels, ::testing::ValuesIn(kernel_pairs()), test_name);
INSTANTIATE_TEST_SUITE_P(All, BoundedKernels, ::testing::ValuesIn(bounded_pairs()), test_name);

/// The cores of these overlap, so that the kernel's gap is a bound only (capsule.h).
bool core_inside(const BodyD& a, const BodyD& b, double phi) {
  return a.kind == ShapeKind::capsule && b.kind == ShapeKind::cylinder && phi <= -a.shape.size.x;
}

/// How exact a gap is, m: closed forms to `closed`, rims of cylinders, which take iterations, to 1e-6 (cylinder_gap.h).
double accuracy(ShapeKind a, ShapeKind b, double closed) {
  return a == ShapeKind::cylinder && (b == ShapeKind::cylinder || b == ShapeKind::box) ? 1e-6 : closed;
}

/// Separation near n, improved by a random walk whose steps shrink.
double improved_separation(Random& random, const BodyD& a, const BodyD& b, Point n, double step, int steps) {
  double s = separation(a, b, n);
  for (int i = 0; i < steps; ++i) {
    const Point next = unit(n + step * random.direction());
    const double value = separation(a, b, next);
    if (value > s) {
      n = next;
      s = value;
    } else {
      step *= 0.85;
    }
  }
  return s;
}

/// Greatest separation that is found from many directions.
double searched_separation(Random& random, const BodyD& a, const BodyD& b, const Point& start) {
  double best = separation(a, b, start);
  for (int trial = 0; trial < 40; ++trial) {
    best = std::max(best, improved_separation(random, a, b, trial < 2 ? start : random.direction(), 0.3, 60));
  }
  return best;
}

// The deepest point's normal separates the bodies by phi (so the gap is at least phi), and its two surface points
// belong to the bodies (so a positive gap is at most phi), to 3e-9 m: tolerance kSameGap, used up to three times. Where
// the normal is a face's to kFaceCosine (0.045 rad) the points are those of that face: off the normal's foot by 0.045
// phi; and clipping counts 1e-6 of a face's size outside as inside.
TEST_P(Kernels, gap_is_exact) {
  Random random(1);
  const auto [a_kind, b_kind] = GetParam();
  for (int trial = 0; trial < 4000; ++trial) {
    const auto [a, b] = random_pair(random, a_kind, b_kind, trial % 2 == 0);
    const ManifoldD manifold = touch(a, b, kMargin);
    const auto* point = deepest(manifold);
    ASSERT_TRUE(point) << trial;
    if (core_inside(a, b, point->phi)) continue;
    ASSERT_NEAR(norm2(point->n), 1, 1e-12) << trial;
    ASSERT_NEAR(separation(a, b, point->n), point->phi, 3e-9) << trial;
    const double slack = 1e-6 + 0.045 * std::abs(point->phi);
    ASSERT_LT(outside(a, axpy(0.5 * point->phi, point->n, point->p)), slack) << trial;
    ASSERT_LT(outside(b, axpy(-0.5 * point->phi, point->n, point->p)), slack) << trial;
  }
}

// Overlapping bodies: no direction parts them by less. (A half space is left in one direction only.)
TEST_P(BoundedKernels, overlap_is_least) {
  Random random(2);
  const auto [a_kind, b_kind] = GetParam();
  int overlapping = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    const auto [a, b] = random_pair(random, a_kind, b_kind, trial % 2 == 0);
    const ManifoldD manifold = touch(a, b, kMargin);
    const auto* point = deepest(manifold);
    ASSERT_TRUE(point);
    if (point->phi >= 0 || core_inside(a, b, point->phi)) continue;
    ++overlapping;
    ASSERT_LT(searched_separation(random, a, b, point->n), point->phi + accuracy(a_kind, b_kind, 1e-8)) << trial;
  }
  EXPECT_GT(overlapping, 100);
}

// Every valid point, not only the deepest, has its ends on (or in) both bodies, its gap is what lies between them, and
// no two valid points are the same. Points that span a nearly parallel face are projected: their ends may miss the
// other face by the tilt that still counts as parallel (kFaceCosine, kParallelSine2: about 3 degrees) times the gap
// there.
TEST_P(Kernels, all_points_lie_on_both_bodies) {
  Random random(3);
  const auto [a_kind, b_kind] = GetParam();
  const double margin = 0.01;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto [a, b] = random_pair(random, a_kind, b_kind, trial % 2 == 0);
    const ManifoldD manifold = touch(a, b, margin);
    for (int k = 0; k < manifold.count; ++k) {
      const auto& point = manifold.point[k];
      if (!point.valid) continue;
      ASSERT_LT(point.phi, margin);
      if (core_inside(a, b, point.phi)) continue;
      const double slack = 1e-6 + 0.06 * std::abs(point.phi);
      ASSERT_LT(outside(a, axpy(0.5 * point.phi, point.n, point.p)), slack) << trial << " slot " << k;
      ASSERT_LT(outside(b, axpy(-0.5 * point.phi, point.n, point.p)), slack) << trial << " slot " << k;
      for (int other = 0; other < k; ++other) {
        if (!manifold.point[other].valid) continue;
        ASSERT_GT(norm2(point.p - manifold.point[other].p), 1e-14) << trial << " slots " << k << " and " << other;
      }
    }
  }
}

// Moving a body by d changes the gap by at most d: along random straight ways through contact, through faces, edges
// and corners alike. 1e-8 m: the tolerances of the two gaps.
TEST_P(Kernels, gap_is_continuous) {
  Random random(4);
  const auto [a_kind, b_kind] = GetParam();
  for (int trial = 0; trial < 150; ++trial) {
    auto [a, b] = random_pair(random, a_kind, b_kind, trial % 2 == 0);
    const Point step = 1e-3 * random.direction();
    a.X.p = axpy(-30.0, step, a.X.p);
    double last = NAN;
    for (int i = 0; i < 60; ++i) {
      a.X.p += step;
      const ManifoldD manifold = touch(a, b, kMargin);
      const auto* point = deepest(manifold);
      ASSERT_TRUE(point);
      if (core_inside(a, b, point->phi + 1e-3)) break;
      if (i > 0) {
        ASSERT_LE(std::abs(point->phi - last), 1e-3 + accuracy(a_kind, b_kind, 1e-8)) << trial << " step " << i;
      }
      last = point->phi;
    }
  }
}

TEST_P(Kernels, exchange_mirrors_the_deepest_point) {
  Random random(5);
  const auto [a_kind, b_kind] = GetParam();
  for (int trial = 0; trial < 1000; ++trial) {
    const auto [a, b] = random_pair(random, a_kind, b_kind, trial % 2 == 0);
    const ManifoldD there = touch(a, b, kMargin), back = touch(b, a, kMargin);
    const auto *first = deepest(there), *second = deepest(back);
    ASSERT_TRUE(first && second);
    if (core_inside(a, b, first->phi)) continue;
    ASSERT_NEAR(first->phi, second->phi, accuracy(a_kind, b_kind, 3e-9)) << trial;
    // Different kinds run the same kernel: then everything is the same but the sign and the features' order.
    if (a_kind == b_kind) continue;
    for (int k = 0; k < there.count; ++k) {
      ASSERT_EQ(there.point[k].valid, back.point[k].valid);
      if (!there.point[k].valid) continue;
      ASSERT_EQ(there.point[k].phi, back.point[k].phi);
      ASSERT_EQ(norm2(there.point[k].n + back.point[k].n), 0);
      ASSERT_EQ(there.point[k].feature_a, back.point[k].feature_b);
    }
  }
}

using Wide = Pack<8>;

/// Eight of one number each, as packs.
template <class Get>
Wide gather(const std::vector<BodyD>& bodies, Get get) {
  double value[8];
  for (int lane = 0; lane < 8; ++lane) value[lane] = get(bodies[lane]);
  return load<Wide>(value);
}
PoseT<Wide> poses_of(const std::vector<BodyD>& bodies) {
  PoseT<Wide> out;
  for (int i = 0; i < 9; ++i) out.R.m[i] = gather(bodies, [i](const BodyD& body) { return body.X.R.m[i]; });
  out.p = {gather(bodies, [](const BodyD& body) { return body.X.p.x; }),
           gather(bodies, [](const BodyD& body) { return body.X.p.y; }),
           gather(bodies, [](const BodyD& body) { return body.X.p.z; })};
  return out;
}
ShapeT<Wide> shapes_of(const std::vector<BodyD>& bodies) {
  return {{gather(bodies, [](const BodyD& body) { return body.shape.size.x; }),
           gather(bodies, [](const BodyD& body) { return body.shape.size.y; }),
           gather(bodies, [](const BodyD& body) { return body.shape.size.z; })},
          bodies[0].shape.terrain};
}
bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof(double)) == 0; }
bool same_bits(const Point& a, const Point& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}

void expect_same_bits(const std::vector<BodyD>& a, const std::vector<BodyD>& b) {
  ManifoldT<Wide> wide;
  collide(a[0].kind, shapes_of(a), poses_of(a), b[0].kind, shapes_of(b), poses_of(b), Wide(0.02), wide);
  for (int lane = 0; lane < 8; ++lane) {
    const ManifoldD narrow = touch(a[lane], b[lane], 0.02);
    ASSERT_EQ(narrow.count, wide.count);
    for (int k = 0; k < narrow.count; ++k) {
      const auto& point = narrow.point[k];
      ASSERT_EQ(point.valid, (bits(wide.point[k].valid) >> lane & 1u) != 0);
      if (!point.valid) continue;
      ASSERT_TRUE(same_bits(point.phi, lane_of(wide.point[k].phi, lane)));
      ASSERT_TRUE(same_bits(point.p, lane_of(wide.point[k].p, lane)));
      ASSERT_TRUE(same_bits(point.n, lane_of(wide.point[k].n, lane)));
      ASSERT_EQ(point.feature_a, lane_of(wide.point[k].feature_a, lane));
      ASSERT_EQ(point.feature_b, lane_of(wide.point[k].feature_b, lane));
    }
  }
}

// Eight different poses side by side: each lane's valid points are those of its pose alone, bit for bit.
TEST_P(Kernels, every_lane_has_the_bits_of_a_single_call) {
  Random random(6);
  const auto [a_kind, b_kind] = GetParam();
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<BodyD> a, b;
    for (int lane = 0; lane < 8; ++lane) {
      const auto [first, second] = random_pair(random, a_kind, b_kind, (trial + lane) % 2 == 0);
      a.push_back(first), b.push_back(second);
    }
    expect_same_bits(a, b);
  }
}

// Coincident centres, zero gaps, a core on an edge, a capsule without length: finite points with unit normals.
TEST_P(Kernels, degenerate_poses_give_finite_points) {
  Random random(7);
  const auto [a_kind, b_kind] = GetParam();
  for (int trial = 0; trial < 500; ++trial) {
    BodyD a{a_kind, random.shape(a_kind), {random.aligned_rotation(), {0, 0, 0}}};
    BodyD b{b_kind, random.shape(b_kind), {random.aligned_rotation(), {0, 0, 0}}};
    if (trial % 3 == 1) a.X.p = 0.5 * b.shape.size.x * b.X.R.column(0);
    if (trial % 3 == 2) a.X.p = 0.5 * b.shape.size.x * b.X.R.column(0) + 0.5 * b.shape.size.y * b.X.R.column(1);
    if (trial % 5 == 0 && a_kind == ShapeKind::capsule) a.shape.size.y = 0;
    const ManifoldD manifold = touch(a, b, kMargin);
    ASSERT_GT(valid_count(manifold), 0);
    for (int k = 0; k < manifold.count; ++k) {
      const auto& point = manifold.point[k];
      if (!point.valid) continue;
      ASSERT_TRUE(std::isfinite(point.phi) && std::isfinite(norm2(point.p)));
      ASSERT_NEAR(norm2(point.n), 1, 1e-9);
    }
  }
}

}  // namespace
}  // namespace graze::testing
