// Tails and exact tests against closed forms and complete enumeration in whole numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "analysis/number_words.h"
#include "analysis/proportions.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

/// n over k in whole numbers, by Pascal's triangle.
double pascal(unsigned n, unsigned k) {
  std::vector<double> row(n + 1, 0.0);
  row[0] = 1;
  for (unsigned i = 1; i <= n; ++i) {
    for (unsigned j = i; j > 0; --j) row[j] += row[j - 1];
  }
  return k <= n ? row[k] : 0;
}

// Claim: Student's tail with one degree of freedom is Cauchy's, 1 - (2 / pi) atan t, and with two 1 - t / sqrt(2 +
// t^2); both to rounding, relative to 1, and without a side.
TEST(Tails, StudentInClosedForm) {
  for (const double t : {0.0, 0.01, 0.5, 1.0, 2.0, 7.0, 100.0}) {
    EXPECT_NEAR(two_sided_student(t, 1), 1 - 2 / std::numbers::pi * std::atan(t), 1e-14) << t;
    EXPECT_NEAR(two_sided_student(t, 2), 1 - t / std::sqrt(2 + t * t), 1e-14) << t;
    EXPECT_EQ(two_sided_student(-t, 3), two_sided_student(t, 3));
    EXPECT_NEAR(two_sided_student(t, 1e7), two_sided_normal(t), 1e-6) << t;
  }
  EXPECT_EQ(two_sided_student(1e200, 4), 0) << "whose square is beyond the largest number";
}

// Claim: chi-square's tail with 2 m degrees of freedom is that of Poisson: e^(-x/2) sum of (x/2)^j / j!, j < m.
TEST(Tails, ChiSquareIsPoissons) {
  for (int m = 1; m <= 6; ++m) {
    for (const double x : {0.1, 1.0, 4.0, 15.0, 60.0}) {
      double term = std::exp(-x / 2), sum = 0;
      for (int j = 0; j < m; ++j) sum += term, term *= x / 2 / (j + 1);
      EXPECT_NEAR(upper_chi_square(x, 2 * m), sum, 1e-13 * sum) << m << ", " << x;
    }
  }
  EXPECT_NEAR(upper_chi_square(3.7, 1), two_sided_normal(std::sqrt(3.7)), 1e-15) << "one: a squared normal";
  EXPECT_EQ(upper_chi_square(0, 3), 1);
  EXPECT_EQ(upper_chi_square(-2, 3), 1);
  EXPECT_EQ(upper_chi_square(kInfinity, 3), 0);
}

// Claim: the far tail of the normal keeps its digits: x sqrt(pi/2) e^(x^2/2) P is within 1/x^2 below 1 (Mills' ratio).
TEST(Tails, NormalFarOut) {
  for (const double x : {6.0, 12.0, 30.0}) {
    const double scaled = x * std::sqrt(std::numbers::pi / 2) * two_sided_normal(x) / std::exp(-x * x / 2);
    EXPECT_LT(scaled, 1);
    EXPECT_GT(scaled, 1 - 1 / (x * x));
  }
}

/// Fisher's p-values of every table with the same margins, from whole numbers of ways.
struct FisherByCounting {
  double upper = 0, two_sided = 0;
  explicit FisherByCounting(const FourfoldTable& table) {
    const auto a = static_cast<unsigned>(table.both + table.only_a),
               b = static_cast<unsigned>(table.both + table.only_b);
    const auto n = a + static_cast<unsigned>(table.only_b + table.neither), both = static_cast<unsigned>(table.both);
    const double here = pascal(a, both) * pascal(n - a, b - both);
    for (unsigned k = 0; k <= std::min(a, b); ++k) {
      if (b - k > n - a) continue;
      const double ways = pascal(a, k) * pascal(n - a, b - k);  // whole numbers: equal ones are equal
      upper += k >= both ? ways : 0;
      two_sided += ways <= here ? ways : 0;
    }
    upper /= pascal(n, b);
    two_sided /= pascal(n, b);
  }
};

// Claim: of all 1820 tables of up to twelve both of Fisher's p-values are those counted in whole numbers.
TEST(Tails, FisherOfEveryTable) {
  std::uint64_t tables = 0;
  for (std::uint64_t both = 0; both <= 12; ++both) {
    for (std::uint64_t only_a = 0; both + only_a <= 12; ++only_a) {
      for (std::uint64_t only_b = 0; both + only_a + only_b <= 12; ++only_b) {
        for (std::uint64_t neither = 0; both + only_a + only_b + neither <= 12; ++neither) {
          const FourfoldTable table{both, only_a, only_b, neither};
          const FisherByCounting wanted(table);
          ASSERT_NEAR(fisher_upper(table), wanted.upper, 1e-11) << both << only_a << only_b << neither;
          ASSERT_NEAR(fisher_two_sided(table), wanted.two_sided, 1e-11) << both << only_a << only_b << neither;
          ++tables;
        }
      }
    }
  }
  EXPECT_EQ(tables, 1820u);
}

// Claim: Fisher's two sides do not change when a and b, or yes and no of both, change places; upper sums and the lower
// ones of the table with b negated overlap in the table itself alone.
TEST(Tails, FisherIsSymmetric) {
  std::mt19937_64 random(111);
  for (int round = 0; round < 200; ++round) {
    const FourfoldTable t{random() % 40, random() % 40, random() % 40, random() % 40};
    const double p = fisher_two_sided(t);
    EXPECT_NEAR(fisher_two_sided({t.both, t.only_b, t.only_a, t.neither}), p, 1e-9);
    EXPECT_NEAR(fisher_two_sided({t.neither, t.only_b, t.only_a, t.both}), p, 1e-9);
    EXPECT_NEAR(fisher_two_sided({t.only_a, t.both, t.neither, t.only_b}), p, 1e-9);
    const double up = fisher_upper(t), down = fisher_upper({t.only_a, t.both, t.neither, t.only_b});
    EXPECT_GE(up + down, 1 - 1e-9);
    EXPECT_GE(p, std::min(up, down) - 1e-9) << "one whole side is never more likely than this table";
  }
}

// Claim: weights in equal pairs make a sum of exponentials, whose tail is sum of c_k e^(-x / (2 w_k)) with c_k =
// prod over j != k of w_k / (w_k - w_j). The saddle point is within 4 % of it down to 1e-10.
TEST(Tails, WeightedChiSquareOfPairs) {
  const std::vector<double> each = {1.0, 0.6, 0.3, 0.1};
  std::vector<double> weights;
  for (const double w : each) weights.insert(weights.end(), {w, w});
  for (const double x : {0.7, 2.0, 3.5, 4.6, 8.0, 20.0, 44.0}) {
    double exact = 0;
    for (const double w : each) {
      double c = 1;
      for (const double other : each) c *= other == w ? 1 : w / (w - other);
      exact += c * std::exp(-x / (2 * w));
    }
    ASSERT_GT(exact, 1e-10);
    EXPECT_NEAR(upper_weighted_chi_square(x, weights), exact, 0.04 * exact) << x;
  }
}

// Claim: scaling all weights and x changes nothing, order does not matter, a larger x or a smaller weight never makes
// the tail larger (also across the mean, where the formula is 0/0), and nothing is below 0 or above 1.
TEST(Tails, WeightedChiSquareIsOrdered) {
  const std::vector<double> weights = {0.2, 1.1, 0.4}, turned = {1.1, 0.4, 0.2}, less = {0.2, 0.9, 0.4};
  std::vector<double> doubled;
  for (const double w : weights) doubled.push_back(2 * w);
  double before = 1;
  for (double x = 0.05; x < 12; x += 0.05) {
    const double tail = upper_weighted_chi_square(x, weights);
    EXPECT_LE(tail, before + 1e-3) << x;  // 1e-3: the step at the mean, see significance.cpp
    EXPECT_GE(tail, 0);
    EXPECT_LE(tail, 1);
    // 1e-6: near the mean 1 / u - 1 / r loses digits, as far as the distance at which it is given up (1e-4).
    EXPECT_NEAR(upper_weighted_chi_square(x, turned), tail, 1e-6) << x;
    EXPECT_NEAR(upper_weighted_chi_square(2 * x, doubled), tail, 1e-6) << x;
    if (std::abs(x - 1.7) > 0.05 && std::abs(x - 1.5) > 0.05) {
      EXPECT_LE(upper_weighted_chi_square(x, less), tail + 1e-9) << x;
    }
    before = tail;
  }
  EXPECT_NEAR(upper_weighted_chi_square(1.7, weights), upper_weighted_chi_square(1.71, weights), 0.01) << "at the mean";
  EXPECT_EQ(upper_weighted_chi_square(3, {}), 1);
  EXPECT_EQ(upper_weighted_chi_square(0, weights), 1);
  EXPECT_LT(upper_weighted_chi_square(900, weights), 1e-100);
}

// Claim: Holm's procedure is the closed test of Bonferroni's: the adjusted p of a hypothesis is the largest over all
// sets that it is in of (size of the set) x (least p in it), at most 1. By all subsets of up to eight.
TEST(Tails, HolmIsAClosedTest) {
  std::mt19937_64 random(112);
  for (int round = 0; round < 60; ++round) {
    const std::size_t n = 1 + random() % 8;
    std::vector<double> p(n);
    for (double& one : p) one = std::pow(static_cast<double>(random() % 1000 + 1) / 1000, 3);
    if (n > 2) p[1] = p[0];
    const std::vector<double> got = holm(p);
    for (std::size_t i = 0; i < n; ++i) {
      double wanted = 0;
      for (unsigned set = 0; set < 1u << n; ++set) {
        if ((set >> i & 1u) == 0) continue;
        double least = 1;
        for (std::size_t j = 0; j < n; ++j) least = (set >> j & 1u) != 0 ? std::min(least, p[j]) : least;
        wanted = std::max(wanted, std::min(1.0, __builtin_popcount(set) * least));
      }
      EXPECT_NEAR(got[i], wanted, 1e-15);
    }
  }
  EXPECT_TRUE(holm({}).empty());
  EXPECT_TRUE(std::isnan(holm(std::vector<double>{std::nan("")})[0]));
  EXPECT_EQ(holm(std::vector<double>{0.6, 0.7}), (std::vector<double>{1, 1}));
}

// Claim: among twelve true hypotheses whose tests are dependent, any is rejected at 5 % in at most 5 % of 4000 families
// (false alarm of this test: 4 standard errors, 3e-5); without the correction in far more.
TEST(Tails, HolmKeepsTheFamilyRate) {
  std::mt19937_64 random(113);
  std::normal_distribution<double> normal;
  int corrected = 0, plain = 0;
  constexpr int kFamilies = 4000;
  for (int family = 0; family < kFamilies; ++family) {
    const double common = normal(random);
    std::vector<double> p;
    for (int i = 0; i < 12; ++i) p.push_back(two_sided_normal(0.5 * common + std::sqrt(0.75) * normal(random)));
    const std::vector<double> adjusted = holm(p);
    corrected += *std::min_element(adjusted.begin(), adjusted.end()) < 0.05;
    plain += *std::min_element(p.begin(), p.end()) < 0.05;
  }
  EXPECT_LE(corrected, (0.05 + 4 * std::sqrt(0.0475 / kFamilies)) * kFamilies);
  EXPECT_GE(corrected, 0.02 * kFamilies);
  EXPECT_GE(plain, 0.25 * kFamilies);
}

// Claim: McNemar's exact p-value of every b and c up to 30 is twice the smaller binomial tail in whole numbers.
TEST(Tails, McNemarOfEveryPair) {
  for (unsigned b = 0; b <= 15; ++b) {
    for (unsigned c = 0; c <= 15; ++c) {
      double tail = 0;
      for (unsigned k = 0; k <= std::min(b, c); ++k) tail += pascal(b + c, k);
      EXPECT_NEAR(mcnemar_exact(b, c), std::min(1.0, 2 * tail / std::pow(2, b + c)), 1e-13) << b << ", " << c;
    }
  }
  EXPECT_EQ(mcnemar_exact(0, 0), 1);
  EXPECT_NEAR(mcnemar_exact(0, 40), std::pow(2.0, -39), 1e-25);
}

/// P(X <= k), X binomial(n, p), term by term.
double binomial_below(unsigned k, unsigned n, double p) {
  double sum = 0;
  for (unsigned j = 0; j <= k; ++j) sum += pascal(n, j) * std::pow(p, j) * std::pow(1 - p, n - j);
  return sum;
}

// Claim: at the ends of Clopper and Pearson's interval the binomial tails are half of what is left, at every k of 25
// and three confidences; it is 1 - (a/2)^(1/n) wide where nothing (or all) succeeds.
TEST(Tails, ClopperPearsonIsInverted) {
  for (const double confidence : {0.5, 0.95, 0.999}) {
    const double half = (1 - confidence) / 2;
    for (unsigned k = 0; k <= 25; ++k) {
      const Interval got = clopper_pearson(k, 25, confidence);
      if (k > 0) {
        EXPECT_NEAR(1 - binomial_below(k - 1, 25, got.low), half, 1e-11) << k;
      }
      if (k < 25) {
        EXPECT_NEAR(binomial_below(k, 25, got.high), half, 1e-11) << k;
      }
    }
    EXPECT_NEAR(clopper_pearson(0, 25, confidence).high, 1 - std::pow(half, 1.0 / 25), 1e-13);
    EXPECT_NEAR(clopper_pearson(25, 25, confidence).low, std::pow(half, 1.0 / 25), 1e-13);
  }
  EXPECT_EQ(clopper_pearson(0, 0).low, 0);
  EXPECT_EQ(clopper_pearson(0, 0).high, 1);
}

// Claim: Wilson's ends are the rates whose score |k/n - p| / sqrt(p (1 - p) / n) is the normal quantile (95
// %: 1.959964, 99 %: 2.575829), inside 0 and 1, and mirrored when successes and failures change places.
TEST(Tails, WilsonSolvesItsEquation) {
  for (const auto& [confidence, z] : {std::pair{0.95, 1.959963985}, {0.99, 2.575829304}}) {
    for (const unsigned n : {1u, 2u, 7u, 50u, 400u}) {
      for (unsigned k = 0; k <= n; k += std::max(1u, n / 9)) {
        const Interval got = wilson(k, n, confidence);
        const double rate = static_cast<double>(k) / n;
        for (const double end : {got.low, got.high}) {
          if (end == 0 || end == 1) continue;
          EXPECT_NEAR(std::abs(rate - end) / std::sqrt(end * (1 - end) / n), z, 1e-6) << k << " of " << n;
        }
        EXPECT_EQ(got.low == 0, k == 0);
        EXPECT_EQ(got.high == 1, k == n);
        EXPECT_NEAR(wilson(n - k, n, confidence).low, 1 - got.high, 1e-14);
      }
    }
  }
}

// Claim: exact coverage of Wilson's interval over all outcomes of 40 trials stays above 92 % for rates from 0.05 to
// 0.95 (Brown, Cai and DasGupta 2001 draw the same curve), and its mean over rates is within 1 % of 95 %.
TEST(Tails, WilsonCoversOnAverage) {
  double sum = 0;
  int rates = 0;
  for (double p = 0.05; p < 0.951; p += 0.01, ++rates) {
    double covered = 0;
    for (unsigned k = 0; k <= 40; ++k) {
      const Interval interval = wilson(k, 40);
      if (interval.low > p || p > interval.high) continue;
      covered += pascal(40, k) * std::pow(p, k) * std::pow(1 - p, 40 - k);
    }
    EXPECT_GT(covered, 0.92) << p;
    sum += covered;
  }
  EXPECT_NEAR(sum / rates, 0.95, 0.01);
}

// Claim: Newcombe's interval of independent rates turns over when both change places, holds the difference, stays
// within -1 and 1, and narrows about as 1 / sqrt(n).
TEST(Tails, NewcombeOfIndependentRatesTurnsOver) {
  std::mt19937_64 random(114);
  for (int round = 0; round < 200; ++round) {
    const std::uint64_t n_a = 1 + random() % 60, n_b = 1 + random() % 60;
    const std::uint64_t a = random() % (n_a + 1), b = random() % (n_b + 1);
    const Interval there = newcombe_independent(a, n_a, b, n_b), back = newcombe_independent(b, n_b, a, n_a);
    const double difference =
        static_cast<double>(b) / static_cast<double>(n_b) - static_cast<double>(a) / static_cast<double>(n_a);
    EXPECT_NEAR(there.low, -back.high, 1e-13);
    EXPECT_LE(there.low, difference);
    EXPECT_GE(there.high, difference);
    EXPECT_GE(there.low, -1 - 1e-13);
    EXPECT_LE(there.high, 1 + 1e-13);
    const Interval more = newcombe_independent(100 * a, 100 * n_a, 100 * b, 100 * n_b);
    EXPECT_LT(more.high - more.low, there.high - there.low);
  }
  const Interval few = newcombe_independent(30, 100, 50, 100), many = newcombe_independent(3000, 10000, 5000, 10000);
  EXPECT_NEAR((few.high - few.low) / (many.high - many.low), 10, 0.3);
  EXPECT_EQ(newcombe_independent(0, 0, 5, 9).low, -1);
  EXPECT_EQ(newcombe_independent(5, 9, 0, 0).high, 1);
}

// Claim: exact coverage of the independent interval over all outcomes of 20 and 30 trials is above 93 % at rates
// between 0.1 and 0.9 (Newcombe's table II: mean 0.9602, minimum 0.867 over a much wider range of sizes and rates).
TEST(Tails, NewcombeOfIndependentRatesCovers) {
  for (const auto& [p, q] : {std::pair{0.1, 0.2}, {0.3, 0.3}, {0.5, 0.8}, {0.9, 0.4}}) {
    double covered = 0;
    for (unsigned a = 0; a <= 20; ++a) {
      for (unsigned b = 0; b <= 30; ++b) {
        const Interval got = newcombe_independent(a, 20, b, 30);
        if (got.low > q - p || q - p > got.high) continue;
        covered += pascal(20, a) * std::pow(p, a) * std::pow(1 - p, 20 - a) * pascal(30, b) * std::pow(q, b) *
                   std::pow(1 - q, 30 - b);
      }
    }
    EXPECT_GT(covered, 0.93) << p << ", " << q;
    EXPECT_LT(covered, 0.985) << p << ", " << q;
  }
}

// Claim: numbers in words: one is one, none and many are several; the digits of a p-value are as many as were asked
// for.
TEST(Tails, InWords) {
  EXPECT_EQ(counted(0, "trace", "traces"), "0 traces");
  EXPECT_EQ(counted(1, "trace", "traces"), "1 trace");
  EXPECT_EQ(counted(21, "trace", "traces"), "21 traces");
  EXPECT_EQ(p_text(0.0123456, 4), "0.01235");
  EXPECT_EQ(p_text(1e-300), "1e-300");
  EXPECT_EQ(p_equation(std::nan("")), "p = -");
}

}  // namespace
}  // namespace graze
