// p-values against tables, complete enumeration and simulation.
#include "analysis/significance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "analysis/number_words.h"
#include "analysis/ranks.h"
#include "sampling/distribution.h"
#include "sampling/stream.h"

namespace graze {
namespace {

// Claim: tails as tabulated (Student 2.571 with 5 degrees of freedom, chi-square 9.488 with 4, normal 1.96: 5 %).
TEST(Significance, TailsAsTabulated) {
  EXPECT_NEAR(two_sided_normal(-1.959964), 0.05, 1e-7);
  EXPECT_NEAR(two_sided_student(2.570582, 5), 0.05, 1e-7);
  EXPECT_NEAR(upper_chi_square(9.487729, 4), 0.05, 1e-7);
  EXPECT_EQ(two_sided_student(std::numeric_limits<double>::infinity(), 5), 0);
}

// Claim: Fisher's test of the lady tasting tea (3 of 4 right: 17/70 and 34/70), and of a table without tails.
TEST(Significance, FishersTea) {
  EXPECT_NEAR(fisher_upper({3, 1, 1, 3}), 17.0 / 70, 1e-12);
  EXPECT_NEAR(fisher_two_sided({3, 1, 1, 3}), 34.0 / 70, 1e-12);
  EXPECT_NEAR(fisher_two_sided({0, 5, 0, 5}), 1, 1e-12);
}

// Claim: equal weights make a chi-square, whose tail the saddle point has within 4 % (one weight: 8 %) down to 1e-12:
// the error that the approximation is known for does not grow along the tail.
TEST(Significance, WeightedChiSquareHasTheTailOfChiSquare) {
  for (const std::size_t k : {1u, 2u, 5u, 20u}) {
    const std::vector<double> weights(k, 0.3);
    for (const double x : {0.5, 2.0, 10.0, 30.0, 60.0}) {
      const double exact = upper_chi_square(x, static_cast<double>(k));
      if (exact < 1e-12) continue;
      EXPECT_NEAR(upper_weighted_chi_square(0.3 * x, weights), exact, (k == 1 ? 0.08 : 0.04) * exact) << k << ", " << x;
    }
  }
}

// Claim: Holm's own procedure by hand; NaN is no test.
// Claim: a p-value that underflows is never printed as 0, nor as a number of which doubles have lost digits.
TEST(Significance, PValuesInWords) {
  EXPECT_EQ(p_text(0.00394), "0.0039");
  EXPECT_EQ(p_text(0.00394, 1), "0.004");
  EXPECT_EQ(p_text(2.61e-54, 3), "2.61e-54");
  EXPECT_EQ(p_text(0), "< 1e-300");
  EXPECT_EQ(p_text(5e-324), "< 1e-300");
  EXPECT_EQ(p_text(std::nan("")), "-");
  EXPECT_EQ(p_equation(1), "p = 1");
  EXPECT_EQ(p_equation(0, 1), "p < 1e-300");
}

TEST(Significance, Holm) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> got = holm(std::vector<double>{0.01, nan, 0.04, 0.03, 0.005});
  EXPECT_NEAR(got[4], 0.02, 1e-15);
  EXPECT_NEAR(got[0], 0.03, 1e-15);
  EXPECT_NEAR(got[3], 0.06, 1e-15);
  EXPECT_NEAR(got[2], 0.06, 1e-15);  // never below that of a smaller p-value
  EXPECT_TRUE(std::isnan(got[1]));
}

// Claim: the exact rank-sum p-value is twice the share of all groups whose sum lies at least as far out, by enumeration
// of all 4 among 11; and the normal approximation, which ties ask for, is near it in the middle.
TEST(Ranks, RankSumByEnumeration) {
  std::vector<double> sums;
  for (unsigned mask = 0; mask < 1u << 11; ++mask) {
    if (__builtin_popcount(mask) != 4) continue;
    double sum = 0;
    for (unsigned i = 0; i < 11; ++i) sum += (mask >> i & 1u) * (i + 1.0);
    sums.push_back(sum);
  }
  const RankSumTest test(4, 11), other(7, 11);
  for (double sum = 10; sum <= 38; ++sum) {
    const auto low = std::count_if(sums.begin(), sums.end(), [&](double s) { return s <= sum; });
    const auto high = std::count_if(sums.begin(), sums.end(), [&](double s) { return s >= sum; });
    const double exact = std::min(1.0, 2 * static_cast<double>(std::min(low, high)) / static_cast<double>(sums.size()));
    EXPECT_NEAR(test.p_value(sum, 0), exact, 1e-12) << sum;
    EXPECT_NEAR(other.p_value(66 - sum, 0), exact, 1e-12) << sum;
    if (exact > 0.02) {
      EXPECT_NEAR(test.p_value(sum, 1e-9), exact, 0.12) << sum;
    }
  }
}

// Claim: Spearman's p-value by permutations is that of all 7! = 5040 orders, within 5 standard errors of the 200,000
// permutations (25 places: false alarm below 2e-5).
TEST(Ranks, SpearmanByEnumeration) {
  std::vector<double> order(7);
  std::iota(order.begin(), order.end(), 1.0);
  const std::vector<double> line = order;
  std::vector<double> all;
  do all.push_back(std::abs(correlation(line, order)));
  while (std::next_permutation(order.begin(), order.end()));
  ASSERT_EQ(all.size(), 5040u);
  const SpearmanTest test(line);
  for (double r = 0; r <= 1; r += 1.0 / 14) {
    const double exact =
        static_cast<double>(std::count_if(all.begin(), all.end(), [&](double a) { return a >= r - 1e-9; })) / 5040;
    EXPECT_NEAR(test.p_value(-r), exact, 5 * std::sqrt(exact * (1 - exact) / 200'000) + 1e-5) << r;
  }
}

// Claim: equal values share the mean of their ranks, and ties are summed as t^3 - t.
TEST(Ranks, Midranks) {
  const std::vector<double> ranks = midranks(std::vector<double>{3, 1, 3, 3, -2});
  EXPECT_EQ(ranks, (std::vector<double>{4, 2, 4, 4, 1}));
  EXPECT_EQ(tie_sum(ranks), 24);
}

// Claim: Kruskal and Wallis by hand: ranks 1-3, 4-6, 7-9 give H = 7.2 and p = 0.0273.
TEST(Ranks, KruskalWallis) {
  const std::vector<double> ranks = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const GroupTest got = kruskal_wallis(ranks, std::vector<std::uint32_t>{0, 0, 0, 1, 1, 1, 2, 2, 2});
  EXPECT_NEAR(got.statistic, 7.2, 1e-12);
  EXPECT_NEAR(got.p_value, 0.02732, 1e-5);
  EXPECT_TRUE(std::isnan(kruskal_wallis(ranks, std::vector<std::uint32_t>(9)).p_value));
}

}  // namespace
}  // namespace graze
