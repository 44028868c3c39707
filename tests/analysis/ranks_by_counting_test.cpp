// Rank statistics against counting: every number that ranks.h returns is counted again by a rule that does not sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "analysis/ranks.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

/// Values from 0 to `kinds` - 1, so that ties come as often as is wanted; now and then an infinite one.
std::vector<double> tied_values(std::mt19937_64& random, std::size_t n, unsigned kinds) {
  std::vector<double> out(n);
  for (double& x : out) {
    x = static_cast<double>(random() % kinds);
    if (random() % 23 == 0) x = random() % 2 == 0 ? kInfinity : -kInfinity;
  }
  return out;
}

/// One more than how many are less, plus half of the others that are equal.
double counted_rank(const std::vector<double>& values, std::size_t at) {
  double rank = 1;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < values[at]) rank += 1;
    if (i != at && values[i] == values[at]) rank += 0.5;
  }
  return rank;
}

// Claim: a midrank is what counting says, with ties and infinities; ranks sum to n (n + 1) / 2, exactly.
TEST(RanksByCounting, MidranksAreCounts) {
  std::mt19937_64 random(101);
  for (int round = 0; round < 60; ++round) {
    const std::size_t n = 1 + random() % 30;
    const std::vector<double> values = tied_values(random, n, 1 + random() % 12);
    const std::vector<double> ranks = midranks(values);
    ASSERT_EQ(ranks.size(), n);
    for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(ranks[i], counted_rank(values, i));
    EXPECT_EQ(std::accumulate(ranks.begin(), ranks.end(), 0.0), 0.5 * static_cast<double>(n * (n + 1)));
  }
  EXPECT_TRUE(midranks({}).empty());
}

// Claim: the order is a permutation in which no pair stands the wrong way round, equal values by their indices.
TEST(RanksByCounting, OrderIsStable) {
  std::mt19937_64 random(102);
  for (int round = 0; round < 40; ++round) {
    const std::vector<double> values = tied_values(random, 1 + random() % 40, 5);
    const std::vector<std::uint32_t> order = order_of(values);
    ASSERT_EQ(order.size(), values.size());
    for (std::size_t i = 1; i < order.size(); ++i) {
      const bool rises = values[order[i - 1]] < values[order[i]];
      const bool tied_in_order = values[order[i - 1]] == values[order[i]] && order[i - 1] < order[i];
      EXPECT_TRUE(rises || tied_in_order) << i;
    }
  }
}

// Claim: ranks of a part of the values touch no other place, and are those of the part alone.
TEST(RanksByCounting, OfAPartLeaveTheOthers) {
  const std::vector<double> values = {5, 1, 5, 2, 9};
  const std::vector<std::uint32_t> part = {3, 0, 2};  // 2, 5, 5
  std::vector<double> ranks(5, -7.0);
  midranks_in_order(values, part, ranks);
  EXPECT_EQ(ranks, (std::vector<double>{2.5, -7, 2.5, 1, -7}));
}

// Claim: the tie sum is that of the counts of equal values; n^3 - n where all are equal, and 0 where none are.
TEST(RanksByCounting, TieSums) {
  std::mt19937_64 random(103);
  for (int round = 0; round < 40; ++round) {
    const std::vector<double> values = tied_values(random, 1 + random() % 25, 6);
    // Each value adds (t^2 - 1), t being how many are equal to it: a group of t adds t (t^2 - 1).
    double wanted = 0;
    for (const double x : values) {
      const auto t = static_cast<double>(std::count(values.begin(), values.end(), x));
      wanted += t * t - 1;
    }
    EXPECT_DOUBLE_EQ(tie_sum(midranks(values)), wanted);
  }
  EXPECT_EQ(tie_sum(std::vector<double>(7, 4.0)), 336);
  EXPECT_EQ(tie_sum(std::vector<double>{1, 2, 3}), 0);
  EXPECT_EQ(tie_sum({}), 0);
}

// Claim: Spearman's correlation without ties is 1 - 6 sum d^2 / (n^3 - n), and Pearson's of any two columns keeps its
// value under shifts and positive scales, and its size under negative ones.
TEST(RanksByCounting, CorrelationByDifferences) {
  std::mt19937_64 random(104);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 40; ++round) {
    const std::size_t n = 3 + random() % 30;
    std::vector<double> a(n), b(n), scaled(n);
    for (std::size_t i = 0; i < n; ++i) a[i] = normal(random), b[i] = normal(random) + 0.5 * a[i];
    const std::vector<double> ranks_a = midranks(a), ranks_b = midranks(b);
    double squares = 0;
    for (std::size_t i = 0; i < n; ++i) squares += std::pow(ranks_a[i] - ranks_b[i], 2);
    const auto cube = static_cast<double>(n * n * n - n);
    EXPECT_NEAR(correlation(ranks_a, ranks_b), 1 - 6 * squares / cube, 1e-12);
    for (std::size_t i = 0; i < n; ++i) scaled[i] = 40 - 3 * b[i];
    EXPECT_NEAR(correlation(a, scaled), -correlation(a, b), 1e-12);
    EXPECT_NEAR(correlation(a, b), correlation(b, a), 1e-15);
  }
  EXPECT_TRUE(std::isnan(correlation(std::vector<double>{1, 2, 3}, std::vector<double>{4, 4, 4})));
  EXPECT_EQ(correlation(std::vector<double>{1, 2}, std::vector<double>{5, 9}), 1);
  EXPECT_EQ(correlation(std::vector<double>{1, 2}, std::vector<double>{9, 5}), -1);
}

// Claim: with a target that has ties the permutation p-value is that of all orders of it (7! = 5040, 5 standard errors
// of 200,000 permutations: false alarm below 1e-5 over all places).
TEST(RanksByCounting, SpearmanOfTies) {
  const std::vector<double> target = midranks(std::vector<double>{1, 1, 1, 2, 2, 3, 4});
  const std::vector<double> line = {1, 2, 3, 4, 5, 6, 7};
  std::vector<std::size_t> order(7);
  std::iota(order.begin(), order.end(), 0u);
  std::vector<double> all, permuted(7);
  do {
    for (std::size_t i = 0; i < 7; ++i) permuted[i] = target[order[i]];
    all.push_back(std::abs(correlation(line, permuted)));
  } while (std::next_permutation(order.begin(), order.end()));
  const SpearmanTest test(target);
  for (const double r : {0.0, 0.1, 0.3, 0.55, -0.7, 0.8, 0.9, -0.95, 1.0}) {
    const auto at_least = std::count_if(all.begin(), all.end(), [&](double a) { return a >= std::abs(r) - 1e-9; });
    const double exact = static_cast<double>(at_least) / 5040;
    EXPECT_NEAR(test.p_value(r), exact, 5 * std::sqrt(exact * (1 - exact) / 200'000) + 1e-5) << r;
  }
}

// Claim: 40 values are permuted, 41 are not: there the p-value is Student's. At 40 it is what another program finds by
// two million shuffles (0.06027, 0.01095 and 0.001141 at 0.3, 0.4 and 0.5; within 5 standard errors of both). It falls
// as |r| grows and has no side.
TEST(RanksByCounting, SpearmanOfManyIsStudents) {
  std::vector<double> line(41);
  std::iota(line.begin(), line.end(), 1.0);
  const SpearmanTest many(line), few(std::span<const double>(line).first(40));
  double before = 2;
  for (const double r : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5}) {
    const double student = two_sided_student(r * std::sqrt(39 / (1 - r * r)), 39);
    EXPECT_DOUBLE_EQ(many.p_value(r), student);
    EXPECT_EQ(many.p_value(-r), many.p_value(r));
    EXPECT_EQ(few.p_value(-r), few.p_value(r));
    EXPECT_LT(many.p_value(r), before);
    before = many.p_value(r);
  }
  for (const auto& [r, shuffled] : {std::pair{0.3, 0.06027}, {0.4, 0.01095}, {0.5, 0.001141}}) {
    EXPECT_NEAR(few.p_value(r), shuffled, 5 * std::sqrt(shuffled * (1 / 2e5 + 1 / 2e6))) << r;
  }
  EXPECT_EQ(many.p_value(1), 0);
  EXPECT_DOUBLE_EQ(few.p_value(1), 1.0 / 200'001) << "never less than one among all";
}

// Claim: fewer than three values, or a correlation that is none, have no p-value.
TEST(RanksByCounting, SpearmanOfNothing) {
  EXPECT_TRUE(std::isnan(SpearmanTest({}).p_value(0.5)));
  EXPECT_TRUE(std::isnan(SpearmanTest(std::vector<double>{1, 2}).p_value(1)));
  EXPECT_TRUE(std::isnan(SpearmanTest(std::vector<double>{1, 2, 3}).p_value(std::nan(""))));
  EXPECT_NEAR(SpearmanTest(std::vector<double>{1, 2, 3}).p_value(1), 1.0 / 3, 5 * std::sqrt(2.0 / 9 / 200'000));
}

// Claim: exact rank-sum p-values for every group size among nine are those of all subsets, whichever of both groups is
// the smaller; they are symmetric about the middle and never above 1.
TEST(RanksByCounting, RankSumsOfEverySize) {
  constexpr unsigned kAll = 9;
  for (unsigned k = 1; k < kAll; ++k) {
    std::vector<unsigned> sums;
    for (unsigned mask = 0; mask < 1u << kAll; ++mask) {
      if (static_cast<unsigned>(__builtin_popcount(mask)) != k) continue;
      unsigned sum = 0;
      for (unsigned i = 0; i < kAll; ++i) sum += (mask >> i & 1u) * (i + 1);
      sums.push_back(sum);
    }
    const RankSumTest test(k, kAll);
    const auto [least, most] = std::minmax_element(sums.begin(), sums.end());
    for (unsigned sum = *least; sum <= *most; ++sum) {
      const auto low = std::count_if(sums.begin(), sums.end(), [&](unsigned s) { return s <= sum; });
      const auto high = std::count_if(sums.begin(), sums.end(), [&](unsigned s) { return s >= sum; });
      const double tail = static_cast<double>(std::min(low, high)) / static_cast<double>(sums.size());
      EXPECT_NEAR(test.p_value(sum, 0), std::min(1.0, 2 * tail), 1e-13) << k << ", " << sum;
      EXPECT_EQ(test.p_value(sum, 0), test.p_value(*least + *most - sum, 0)) << k << ", " << sum;
    }
  }
  EXPECT_TRUE(std::isnan(RankSumTest(0, 9).p_value(0, 0)));
  EXPECT_TRUE(std::isnan(RankSumTest(9, 9).p_value(45, 0)));
}

// Claim: the variance that ties leave is that of the sum of k of the midranks over all subsets, so that the normal
// approximation is at the z of the enumerated mean and variance.
TEST(RanksByCounting, RankSumsWithTiesHaveTheirVariance) {
  std::mt19937_64 random(105);
  for (int round = 0; round < 12; ++round) {
    const unsigned n = 6 + static_cast<unsigned>(random() % 6), k = 1 + static_cast<unsigned>(random() % (n - 1));
    std::vector<double> values(n);
    for (double& x : values) x = static_cast<double>(random() % 4);
    const std::vector<double> ranks = midranks(values);
    const double ties = tie_sum(ranks);
    if (ties == 0 || ties == std::pow(n, 3) - n) continue;
    double count = 0, first = 0, second = 0;
    for (unsigned mask = 0; mask < 1u << n; ++mask) {
      if (static_cast<unsigned>(__builtin_popcount(mask)) != k) continue;
      double sum = 0;
      for (unsigned i = 0; i < n; ++i) sum += (mask >> i & 1u) * ranks[i];
      count += 1, first += sum, second += sum * sum;
    }
    const double mean = first / count, variance = second / count - mean * mean;
    const RankSumTest test(k, n);
    for (const double z : {-2.5, -1.0, 0.3, 2.0}) {
      EXPECT_NEAR(test.p_value(mean + z * std::sqrt(variance), ties), two_sided_normal(z), 1e-9) << n << ", " << k;
    }
  }
}

// Claim: what is too large to count exactly goes over to the normal tail. Just below that the exact tail is lighter, by
// the first term of Edgeworth's series: 2 phi(z) He3(z) kappa / 24, kappa = -6/5 (a^2 + b^2 + ab + a + b) / (ab (a + b
// + 1)) the rank sum's excess (9 % at 1e-3); what is left is within 1 %.
TEST(RanksByCounting, LargeRankSumsAreNormal) {
  const RankSumTest exact(60, 160), normal(63, 160);  // 60 * 160 <= 1e4 < 63 * 160
  const double spread = std::sqrt(60.0 * 100 * 161 / 12);
  const double kappa = -1.2 * (3600 + 10000 + 6000 + 160) / (6000.0 * 161);
  for (const double about : {0.5, 1.0, 2.0, 3.3}) {
    const double sum = std::round(60 * 80.5 + about * spread);
    const double z = (sum - 0.5 - 60 * 80.5) / spread;  // half a step: sums are whole numbers
    const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
    const double edgeworth = two_sided_normal(z) + 2 * density * (z * z * z - 3 * z) * kappa / 24;
    EXPECT_NEAR(exact.p_value(sum, 0), edgeworth, 0.01 * edgeworth) << about;
    const double beyond = 63 * 80.5 + about * std::sqrt(63.0 * 97 * 161 / 12);
    EXPECT_NEAR(normal.p_value(beyond, 0), two_sided_normal(about), 1e-12);
  }
}

// Claim: of two groups Kruskal and Wallis's test is the rank-sum test's normal approximation, squared, ties and all.
TEST(RanksByCounting, KruskalWallisOfTwoGroups) {
  std::mt19937_64 random(106);
  for (int round = 0; round < 30; ++round) {
    const std::size_t n = 8 + random() % 30;
    std::vector<double> values(n);
    std::vector<std::uint32_t> group(n);
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      values[i] = static_cast<double>(random() % 7);
      group[i] = i == 0 ? 1 : i == 1 ? 0 : static_cast<std::uint32_t>(random() % 2);
      k += group[i];
    }
    values[2] = values[3];
    const std::vector<double> ranks = midranks(values);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += group[i] * ranks[i];
    const GroupTest got = kruskal_wallis(ranks, group);
    EXPECT_NEAR(got.p_value, RankSumTest(k, n).p_value(sum, tie_sum(ranks)), 1e-10);
    EXPECT_NEAR(got.epsilon, got.statistic / static_cast<double>(n - 1), 1e-12);
  }
}

// Claim: epsilon is the share of the ranks' sum of squares that is between groups (analysis of variance by hand), and
// what the groups are called does not matter.
TEST(RanksByCounting, KruskalWallisIsAnAnalysisOfVariance) {
  std::mt19937_64 random(107);
  for (int round = 0; round < 20; ++round) {
    const std::size_t n = 12 + random() % 20;
    std::vector<double> values(n);
    std::vector<std::uint32_t> group(n), renamed(n);
    for (std::size_t i = 0; i < n; ++i) {
      group[i] = static_cast<std::uint32_t>(i % 4);
      renamed[i] = 90 - 7 * group[i];
      values[i] = static_cast<double>(random() % 9) + group[i];
    }
    const std::vector<double> ranks = midranks(values);
    const double mean = 0.5 * static_cast<double>(n + 1);
    double all = 0, between = 0;
    for (const double r : ranks) all += (r - mean) * (r - mean);
    for (std::uint32_t g = 0; g < 4; ++g) {
      double count = 0, sum = 0;
      for (std::size_t i = 0; i < n; ++i) count += group[i] == g, sum += group[i] == g ? ranks[i] : 0;
      between += count * std::pow(sum / count - mean, 2);
    }
    const GroupTest got = kruskal_wallis(ranks, group);
    EXPECT_NEAR(got.epsilon, between / all, 1e-12);
    EXPECT_NEAR(got.p_value, upper_chi_square(got.statistic, 3), 1e-15);
    EXPECT_NEAR(kruskal_wallis(ranks, renamed).statistic, got.statistic, 1e-10);
  }
  EXPECT_TRUE(std::isnan(kruskal_wallis(std::vector<double>(4, 2.5), std::vector<std::uint32_t>{0, 0, 1, 1}).p_value));
}

}  // namespace
}  // namespace graze
