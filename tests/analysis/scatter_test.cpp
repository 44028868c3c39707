// One mode or several: the dip against its definition, its error rates by simulation, and samples whose modes are
// known.
#include "analysis/scatter.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "analysis/freedoms.h"
#include "sampling/distribution.h"
#include "sampling/stream.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

double noise(std::uint32_t i, std::uint64_t column, std::uint32_t sample) {
  return normal_quantile(uniform(31, i, column, sample));
}

/// The dip by its definition, for small samples without ties: the least d for which a function that is convex up to
/// some point and concave from there on stays within d of the empirical one. With the mode at a data point, where the
/// function may jump, the least value that the convex part can have there follows from the lines through every pair of
/// points; the concave part is its mirror image.
class ByDefinition {
 public:
  explicit ByDefinition(std::vector<double> x) : x_(std::move(x)) {
    for (const double x : x_) mirrored_.insert(mirrored_.begin(), -x);
  }
  double dip() const {
    double low = 0, high = 0.5;
    for (int i = 0; i < 50; ++i) {
      const double d = 0.5 * (low + high);
      (possible(d) ? high : low) = d;
    }
    return high;
  }

 private:
  bool possible(double d) const {
    for (std::size_t m = 0; m < x_.size(); ++m) {
      const double left = least_at(x_, m, d), right = least_at(mirrored_, x_.size() - 1 - m, d);
      if (left <= 1 - right) return true;  // the mirror image counts from the other end
    }
    return false;
  }
  /// The least value just before point m; 2: there is no such function.
  static double least_at(const std::vector<double>& x, std::size_t m, double d) {
    const auto n = static_cast<double>(x.size());
    const auto lo = [&](std::size_t i) { return std::max(0.0, (static_cast<double>(i) + 1) / n - d); };
    const auto hi = [&](std::size_t i) { return static_cast<double>(i) / n + d; };
    double end = std::max(0.0, static_cast<double>(m) / n - d);
    for (std::size_t j = 0; j < m; ++j) {
      end = std::max(end, lo(j));
      for (std::size_t k = j; k < m; ++k) {
        if (lo(j) > hi(k)) return 2;
      }
      for (std::size_t i = 0; i < j; ++i) {
        const double slope = (lo(j) - hi(i)) / (x[j] - x[i]);
        end = std::max(end, lo(j) + slope * (x[m] - x[j]));
        for (std::size_t k = j + 1; k < m; ++k) {
          if (lo(j) + slope * (x[k] - x[j]) > hi(k)) return 2;
        }
      }
    }
    return end <= hi(m) ? end : 2;
  }
  std::vector<double> x_, mirrored_;
};

// Claim: the dip is what its definition says, on 300 random samples of 2 to 14 values with one, two and three clusters.
TEST(Dip, AgreesWithItsDefinition) {
  for (std::uint32_t sample = 0; sample < 300; ++sample) {
    std::vector<double> x;
    for (std::uint32_t i = 0; i < 2 + sample % 13; ++i) x.push_back(noise(i, 1, sample) + 3.0 * (i % (1 + sample % 3)));
    std::sort(x.begin(), x.end());
    EXPECT_NEAR(dip(x), ByDefinition(x).dip(), 1e-9) << sample;
  }
}

// Claim: evenly spaced points have the least dip, 1 / (2 n); two equal heaps the largest, 1/4; one heap none.
TEST(Dip, Extremes) {
  std::vector<double> even, heaps(40, 0.0);
  for (int i = 0; i < 40; ++i) even.push_back(i);
  std::fill(heaps.begin() + 20, heaps.end(), 1.0);
  EXPECT_NEAR(dip(even), 1.0 / 80, 1e-12);
  EXPECT_NEAR(dip(heaps), 0.25, 0.013);  // its discrete value lies within 1 / (2 n)
  EXPECT_NEAR(dip(std::vector<double>(40, 7.0)), 1.0 / 80, 1e-12);
}

// Claim: the test calls a uniform sample two-humped in 5 % of cases, a normal one hardly ever, and two normal humps
// five deviations apart nearly always, at 100 values (400 samples each; 4 standard errors).
TEST(Dip, ErrorRates) {
  const int samples = test::trials(400);
  DipTest test;
  int flat = 0, peak = 0, humps = 0;
  for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(samples); ++sample) {
    std::vector<double> x[3];
    for (std::uint32_t i = 0; i < 100; ++i) {
      x[0].push_back(uniform(32, i, 1, sample));
      x[1].push_back(noise(i, 2, sample));
      x[2].push_back(noise(i, 3, sample) + (i % 2 == 0 ? 5 : 0));
    }
    for (auto& one : x) std::sort(one.begin(), one.end());
    flat += test.p_value(dip(x[0]), 100) < 0.05;
    peak += test.p_value(dip(x[1]), 100) < 0.05;
    humps += test.p_value(dip(x[2]), 100) < 0.05;
  }
  EXPECT_NEAR(flat, 0.05 * samples, 4 * std::sqrt(0.05 * 0.95 * samples));
  EXPECT_LE(peak, 0.01 * samples + 1);
  EXPECT_GE(humps, 0.95 * samples);
}

// Claim: 1000 and 4000 values are judged alike: the p-value of a uniform sample's dip, scaled by the root of n.
TEST(Dip, LargeSamplesByScaling) {
  DipTest test;
  const double d = 0.0165;
  EXPECT_NEAR(test.p_value(d, 1000), test.p_value(d / 2, 4000), 1e-12);
  EXPECT_LT(test.p_value(d, 1000), 0.1);
  EXPECT_GT(test.p_value(d, 1000), 0.02);
}

// Claim: whether p is below a level is told without the p-value as with it, whichever is asked first, at levels that a
// p-value can and cannot have; a level above all and one below all are answered, too.
TEST(Dip, BelowALevelAsThePValue) {
  for (const std::size_t n : {10u, 37u, 1200u}) {
    DipTest first, second;
    const std::size_t samples = n < 1000 ? 60 : 5;
    for (std::uint32_t sample = 0; sample < samples; ++sample) {
      std::vector<double> x;
      for (std::uint32_t i = 0; i < n; ++i) x.push_back(noise(i, 4, sample) + (i % 2) * 0.1 * sample);
      std::sort(x.begin(), x.end());
      const double d = dip(x);
      for (const double level : {0.0, 2e-4, 0.05 / 18, 0.05, 0.3, 1.0, 1.1}) {
        const bool before = first.below(d, n, level);
        EXPECT_EQ(before, second.p_value(d, n) < level) << n << " " << sample << " " << level;
        EXPECT_EQ(second.below(d, n, level), before);
      }
    }
  }
}

std::vector<std::vector<double>> columns_of(std::uint32_t traces, std::size_t freedoms, std::uint32_t sample) {
  std::vector<std::vector<double>> out(freedoms);
  for (std::size_t k = 0; k < freedoms; ++k) {
    for (std::uint32_t i = 0; i < traces; ++i) out[k].push_back(0.01 * noise(i, 10 + k, sample));
  }
  return out;
}

std::vector<std::string> names(std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < count; ++k) out.push_back("f" + std::to_string(k));
  return out;
}

// Claim: Eq. 19's scattering (normal in 18 degrees of freedom) is called a bifurcation in at most 5 % of campaigns (it
// is in hardly any); bias and deviation come out.
TEST(Scatter, NormalSpreadIsNoBifurcation) {
  DipTest test;
  int found = 0;
  for (std::uint32_t sample = 0; sample < 100; ++sample) {
    found += judge_scatter(names(18), names(18), columns_of(100, 18, sample), test).bifurcates();
  }
  EXPECT_LE(found, 5);
  const Scatter one = judge_scatter(names(18), names(18), columns_of(100, 18, 1), test);
  EXPECT_NEAR(one.freedoms[3].deviation, 0.01, 4 * 0.01 / std::sqrt(200));
  EXPECT_NEAR(one.freedoms[3].mean, 0, 4 * 0.01 / std::sqrt(100));
  EXPECT_EQ(scatter_text(one), "scatters: one mode in every degree of freedom");
}

// Claim: 15 of 100 traces that end up 0.3 m further are found, counted, and told apart trace by trace, in a degree of
// freedom among 18; three heaps are three modes.
TEST(Scatter, FindsTheModesAndWhoIsInThem) {
  DipTest test;
  auto columns = columns_of(100, 18, 1);
  for (std::size_t i = 0; i < 15; ++i) columns[0][i * 6] += 0.3;
  const Scatter got = judge_scatter(names(18), std::vector<std::string>(18, "m"), columns, test);
  ASSERT_EQ(got.clearest, 0);
  ASSERT_EQ(got.freedoms[0].modes.size(), 2u);
  EXPECT_EQ(got.freedoms[0].modes[0].traces, 85u);
  EXPECT_EQ(got.freedoms[0].modes[1].traces, 15u);
  EXPECT_NEAR(got.freedoms[0].modes[1].mean, 0.3, 0.01);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(got.side[i], i % 6 == 0 && i < 90 ? 1 : 0) << i;
  EXPECT_THAT(scatter_text(got), ::testing::HasSubstr("bifurcates: f0 has 2 modes, 85 at "));
  for (std::size_t i = 0; i < 100; ++i) columns[5][i] += 0.2 * static_cast<double>(i % 3);
  const Scatter three = judge_scatter(names(18), names(18), columns, test);
  EXPECT_EQ(three.freedoms[5].modes.size(), 3u);
  EXPECT_THAT(scatter_text(three), ::testing::EndsWith("; so does 1 other degree of freedom"));
}

// Claim: a quaternion becomes roll, pitch and yaw; headings about half a turn lie together; nine equal digits are no
// spread; few traces are refused with a word.
TEST(Scatter, States) {
  const Freedoms freedoms({"base.qw", "base.qx", "base.qy", "base.qz", "base.x", "LF_X_1"});
  EXPECT_EQ(freedoms.names(), (std::vector<std::string>{"base.roll", "base.pitch", "base.yaw", "base.x", "LF_X_1"}));
  EXPECT_EQ(freedoms.units()[3], "m");
  std::vector<double> out(5);
  freedoms.read(std::vector<double>{std::cos(0.35), 0, 0, std::sin(0.35), 1.5, -2}, out);
  EXPECT_NEAR(out[2], 0.7, 1e-12);
  EXPECT_NEAR(out[0], 0, 1e-12);
  EXPECT_EQ(out[3], 1.5);
  EXPECT_EQ(out[4], -2);
  freedoms.read(std::vector<double>{std::cos(0.1), 0, std::sin(0.1), 0, 0, 0}, out);
  EXPECT_NEAR(out[1], 0.2, 1e-12);
  std::vector<std::vector<double>> columns(5);
  columns[2] = {3.1, -3.1, 3.0};
  freedoms.unwrap(columns);
  EXPECT_NEAR(std::abs(columns[2][0] - columns[2][1]), 2 * std::acos(-1.0) - 6.2, 1e-9);
  DipTest test;
  std::vector<double> same(50, 0.5);
  for (std::size_t i = 0; i < 25; ++i) same[i] += 1e-13;
  EXPECT_FALSE(judge_scatter({"z"}, {"m"}, {same}, test).bifurcates());
  EXPECT_EQ(scatter_text(judge_scatter({"z"}, {"m"}, {{1, 2, 3}}, test)), "not tested: 3 traces, and it takes 10");
}

}  // namespace
}  // namespace graze
