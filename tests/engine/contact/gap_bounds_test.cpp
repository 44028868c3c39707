// Claims: what a kernel says of a gap without measuring it is never more than the gap, for every pair of shapes,
// however they move; where a gap was measured, the bound is as good as the gap; bodies' ways are never underestimated.

#include <gtest/gtest.h>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/block.h"
#include "engine/lanes/isa.h"
#include "tests/engine/contact/support.h"

namespace graze::testing {
namespace {

constexpr unsigned kAllLanes = (1u << kLanes) - 1;
using Row = std::array<double, kLanes>;

Row row_of(double x) {
  Row out;
  out.fill(x);
  return out;
}

/// Eight pairs of the same two kinds, one per lane.
class Pairs {
 public:
  Pairs(Random& random, const LaneKernel& kernel, ShapeKind a, ShapeKind b) : kernel_(kernel), a_(a), b_(b) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto [first, second] = random_pair(random, a, b, lane % 2 == 0);
      put(first, lane, 0), put(second, lane, 1);
    }
    std::fill_n(axis_.row(2), kLanes, 1.0);
  }

  void put(const BodyD& body, int lane, int side) {
    bodies_[side][lane] = body;
    const Point s = body.shape.size, p = body.X.p;
    int row = 0;
    for (const double x : {s.x, s.y, s.z}) size_[side](row++, lane) = x;
    for (row = 0; row < 9; ++row) pose_[side](row, lane) = body.X.R.m[row];
    for (const double x : {p.x, p.y, p.z}) pose_[side](row++, lane) = x;
  }
  /// How far any point of the body that moved can have gone, and any of the other as seen from it, m.
  struct Way {
    double own, other;
  };
  /// Moves the first of a lane.
  Way move(Random& random, int lane, double way) {
    BodyD body = bodies_[0][lane];
    const Point axis = random.direction();
    const double angle = 5 * way * random.normal(), length = way * random.normal();
    body.X.R = random.rotation_of(Quat(Eigen::AngleAxisd(angle, Vec3(axis.x, axis.y, axis.z)))) * body.X.R;
    body.X.p = axpy(length, random.direction(), body.X.p);
    const Point from = body.X.p, to = bodies_[1][lane].X.p;
    const double apart = std::hypot(to.x - from.x, to.y - from.y, to.z - from.z);
    put(body, lane, 0);
    return {std::abs(length) + std::abs(angle) * radius(body),
            std::abs(length) + std::abs(angle) * (apart + radius(bodies_[1][lane]))};
  }

  /// Returns the lanes in which `enough` is not known to be reached.
  unsigned ask(double enough, bool exchanged = false) {
    const Row enough_row = row_of(enough), reach = row_of(1e9);
    const auto side = [&](int i) {
      return GapQuery::Side{static_cast<int>(i == 0 ? a_ : b_), size_[i].row(0), pose_[i].row(0), nullptr, nullptr};
    };
    return kernel_.measure_gap({side(exchanged ? 1 : 0), side(exchanged ? 0 : 1), kAllLanes, enough_row.data(),
                                reach.data(), axis_.row(0), bound.data(), manifold_.row(0)});
  }
  /// As measured: of the points.
  double gap(int lane) const {
    double out = 1e300;
    for (int k = 0; k < ManifoldD::kMax; ++k) {
      const int slot = k * kManifoldRows;
      if (manifold_(slot + kRowValid, lane) > 0.5) out = std::min(out, manifold_(slot + kRowPhi, lane));
    }
    return out;
  }

  Row bound{};

 private:
  const LaneKernel& kernel_;
  ShapeKind a_, b_;
  BodyD bodies_[2][kLanes];
  BlockArray size_[2] = {BlockArray(3), BlockArray(3)}, pose_[2] = {BlockArray(12), BlockArray(12)};
  BlockArray axis_{3}, manifold_{kManifoldRows * ManifoldD::kMax};
};

class GapBounds : public ::testing::TestWithParam<KindPair> {};
INSTANTIATE_TEST_SUITE_P(All, GapBounds, ::testing::ValuesIn(kernel_pairs()), [](const auto& info) {
  std::string name = name_of(info.param);
  name[name.find('-')] = '_';
  return name;
});

/// How exact gaps are, m: rims of cylinders take iterations (kernels_test.cpp).
double accuracy(const KindPair& pair) {
  const bool rims = pair.a == ShapeKind::cylinder && (pair.b == ShapeKind::cylinder || pair.b == ShapeKind::box);
  return rims ? 1e-6 : 1e-8;
}

// Shapes tumble about each other, in small steps and in leaps. The gap is what the kernels find; that this is exact is
// kernels_test.cpp's claim. Deep in each other the kernels' own gap may be a bound only, and nobody asks: 0 is less.
TEST_P(GapBounds, are_never_more_than_the_gap) {
  for (const Isa isa : available_isas()) {
    Random random(11);
    for (int trial = 0; trial < 30; ++trial) {
      Pairs pairs(random, kernel_of(isa, kLanes), GetParam().a, GetParam().b);
      for (int step = 0; step < 60; ++step) {
        for (int lane = 0; lane < kLanes; ++lane) pairs.move(random, lane, random.below(10) == 0 ? 0.1 : 2e-3);
        const bool exchanged = random.below(2) == 0;
        pairs.ask(-1e300, exchanged);
        const Row quick = pairs.bound;
        ASSERT_EQ(pairs.ask(1e300, exchanged), kAllLanes);
        for (int lane = 0; lane < kLanes; ++lane) {
          const double gap = pairs.gap(lane), most = std::max(gap, 0.0) + accuracy(GetParam());
          ASSERT_LE(quick[lane], most) << "from before, lane " << lane << ", step " << step;
          ASSERT_LE(pairs.bound[lane], most) << "improved, lane " << lane << ", step " << step;
        }
      }
    }
  }
}

// What makes bounds last: at the place where a gap was measured the bound is that gap; and away from there the gap has
// changed by the way at most, and the separation along the same axis by the other body's way in the frame of the one
// that carries the axis, which may be either.
TEST_P(GapBounds, stay_good_where_a_gap_was_measured) {
  for (const Isa isa : available_isas()) {
    Random random(12);
    for (int trial = 0; trial < 100; ++trial) {
      Pairs pairs(random, kernel_of(isa, kLanes), GetParam().a, GetParam().b);
      const bool exchanged = trial % 2 == 0;
      pairs.ask(1e300, exchanged);
      Row gap;
      for (int lane = 0; lane < kLanes; ++lane) gap[lane] = pairs.gap(lane);
      EXPECT_EQ(pairs.ask(-1e300, exchanged), 0u);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (gap[lane] <= 0) continue;
        EXPECT_NEAR(pairs.bound[lane], gap[lane], 1e-6) << "lane " << lane;
      }
      Row way;
      for (int lane = 0; lane < kLanes; ++lane) {
        const Pairs::Way moved = pairs.move(random, lane, 1e-4);
        way[lane] = moved.own + std::max(moved.own, moved.other);
      }
      pairs.ask(-1e300, exchanged);
      const Row bound = pairs.bound;
      pairs.ask(1e300, exchanged);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (gap[lane] <= 0) continue;
        EXPECT_GE(bound[lane], pairs.gap(lane) - way[lane] - 1e-6) << "lane " << lane;
      }
    }
  }
}

// A point of a body that tumbles is never farther from where it was than the bounds say; only a due pair's gap may be
// less than asked for.
TEST(GapBounds, never_underestimate) {
  constexpr int kBodies = 3;
  for (const Isa isa : available_isas()) {
    const LaneKernel& kernel = kernel_of(isa, kLanes);
    Random random(13);
    BlockArray X(12 * kBodies), radius(kBodies), last(12 * kBodies), travel(1 + kBodies), first(12 * kBodies);
    BlockArray turn(kBodies), way_of(kBodies);
    const int body[kBodies] = {2, 0, 1}, row[kBodies] = {0, 1, 2};
    for (int i = 0; i < kBodies; ++i) std::fill_n(radius.row(i), kLanes, 0.1 * (i + 1));
    for (int step = 0; step < 50; ++step) {
      for (int i = 0; i < kBodies * kLanes; ++i) {
        const RotT<double> R = random.rotation();
        for (int k = 0; k < 9; ++k) X(12 * (i / kLanes) + k, i % kLanes) = R.m[k];
        for (int k = 9; k < 12; ++k) X(12 * (i / kLanes) + k, i % kLanes) = random.uniform(-0.1, 0.1);
      }
      Row most;
      kernel.add_moves({kBodies, body, X.row(0), step == 0 ? kAllLanes : 0u, last.row(0), turn.row(0), way_of.row(0)});
      kernel.add_travel({kBodies, row, turn.row(0), way_of.row(0), radius.row(0), travel.row(0), most.data()});
      if (step == 0) first = X;
      for (int i = 0; i < kBodies * kLanes; ++i) {
        const int at = i / kLanes, lane = i % kLanes;
        const Point on_body = radius(at, lane) * random.direction();
        const auto place = [&](const BlockArray& from) {
          const auto in = [&](int k) { return from(12 * body[at] + k, lane); };
          Point out{in(9), in(10), in(11)};
          out.x += in(0) * on_body.x + in(1) * on_body.y + in(2) * on_body.z;
          out.y += in(3) * on_body.x + in(4) * on_body.y + in(5) * on_body.z;
          out.z += in(6) * on_body.x + in(7) * on_body.y + in(8) * on_body.z;
          return out;
        };
        const double way = std::sqrt(norm2(place(X) - place(first)));
        ASSERT_LE(way, travel(1 + at, lane) + 1e-12);
        if (step != 1) continue;
        ASSERT_LE(way, most[lane] + 1e-12);
      }
      ASSERT_EQ(travel(0, 3), 0) << "the world stays";
    }
  }
}

TEST(GapBounds, find_what_is_due) {
  constexpr int kPairs = 5;
  for (const Isa isa : available_isas()) {
    Random random(14);
    BlockArray reserve(kPairs), travel(4);
    const int places[2 * kPairs] = {0, 1, 1, 2, 0, 3, 2, 3, 1, 3};
    for (int trial = 0; trial < 200; ++trial) {
      const unsigned lanes = static_cast<unsigned>(random.below(256));
      Row enough, lowest;
      for (int lane = 0; lane < kLanes; ++lane) {
        for (int i = 0; i < kPairs; ++i) reserve(i, lane) = random.uniform(0, 3);
        for (int i = 1; i < 4; ++i) travel(i, lane) = random.uniform(0, 1);
        enough[lane] = random.uniform(0, 1);
      }
      int due[kPairs];
      unsigned due_lanes[kPairs];
      const int count = kernel_of(isa, kLanes)
                            .find_due({kPairs, places, reserve.row(0), travel.row(0), enough.data(), lanes,
                                       lowest.data(), due, due_lanes});
      unsigned found[kPairs] = {};
      for (int i = 0; i < count; ++i) found[due[i]] = due_lanes[i];
      for (int lane = 0; lane < kLanes; ++lane) {
        double least = 1e300;
        for (int i = 0; i < kPairs; ++i) {
          const double bound = reserve(i, lane) - (travel(places[2 * i], lane) + travel(places[2 * i + 1], lane));
          const bool is_due = (lanes >> lane & 1u) != 0 && bound < enough[lane];
          ASSERT_EQ((found[i] >> lane & 1u) != 0, is_due);
          if (!is_due) least = std::min(least, bound);
        }
        ASSERT_EQ(lowest[lane], least);
      }
    }
  }
}

}  // namespace
}  // namespace graze::testing
