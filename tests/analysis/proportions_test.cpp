// The statistics of a score against tables, brute force and simulation.
#include "analysis/proportions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sampling/stream.h"

namespace graze {
namespace {

double choose(int n, int k) {
  double c = 1;
  for (int i = 1; i <= k; ++i) c = c * (n - k + i) / i;
  return c;
}

/// P(X <= k), X binomial(n, p), summed term by term.
double binomial_cdf(int k, int n, double p) {
  double sum = 0;
  for (int i = 0; i <= k; ++i) sum += choose(n, i) * std::pow(p, i) * std::pow(1 - p, n - i);
  return sum;
}

// Claim: Clopper-Pearson as tabulated to four digits (e.g. in Newcombe, Stat. Med. 17 (1998) 857, method 5).
TEST(ClopperPearson, Tabulated) {
  const auto expect = [](std::uint64_t k, std::uint64_t n, double low, double high) {
    const Interval interval = clopper_pearson(k, n);
    EXPECT_NEAR(interval.low, low, 5e-5) << k << " of " << n;
    EXPECT_NEAR(interval.high, high, 5e-5) << k << " of " << n;
  };
  expect(81, 263, 0.2527, 0.3676);
  expect(15, 148, 0.0578, 0.1617);
  expect(0, 20, 0.0000, 0.1684);
  expect(1, 29, 0.0009, 0.1776);
}

// Claim: at the bounds the binomial tails are exactly 2.5 %; no trials tell nothing; 0 and n reach the ends.
TEST(ClopperPearson, TailsAreExact) {
  for (const int n : {1, 2, 7, 30, 100}) {
    for (int k = 0; k <= n; ++k) {
      const Interval interval = clopper_pearson(static_cast<std::uint64_t>(k), static_cast<std::uint64_t>(n));
      if (k > 0) {
        EXPECT_NEAR(1 - binomial_cdf(k - 1, n, interval.low), 0.025, 1e-10) << k << " of " << n;
      }
      if (k < n) {
        EXPECT_NEAR(binomial_cdf(k, n, interval.high), 0.025, 1e-10) << k << " of " << n;
      }
    }
    EXPECT_EQ(clopper_pearson(0, static_cast<std::uint64_t>(n)).low, 0);
    EXPECT_EQ(clopper_pearson(static_cast<std::uint64_t>(n), static_cast<std::uint64_t>(n)).high, 1);
  }
  EXPECT_EQ(clopper_pearson(0, 0).low, 0);
  EXPECT_EQ(clopper_pearson(0, 0).high, 1);
}

// Claim: the interval covers the true rate in at least 95 % of campaigns. Its exact coverage at each rate follows from
// brute force over k; 4000 simulated campaigns per rate agree with it within 4 standard errors (five comparisons: false
// alarm below 4e-4).
TEST(ClopperPearson, Coverage) {
  const int n = 40, campaigns = 4000;
  std::vector<Interval> interval;
  for (int k = 0; k <= n; ++k) interval.push_back(clopper_pearson(static_cast<std::uint64_t>(k), n));
  for (const double p : {0.02, 0.1, 0.3, 0.5, 0.97}) {
    double exact = 0;
    for (int k = 0; k <= n; ++k) {
      const bool covers = interval[k].low <= p && p <= interval[k].high;
      if (covers) exact += choose(n, k) * std::pow(p, k) * std::pow(1 - p, n - k);
    }
    EXPECT_GE(exact, 0.95) << p;
    int covered = 0;
    for (int c = 0; c < campaigns; ++c) {
      int k = 0;
      for (std::uint32_t i = 0; i < n; ++i) k += uniform(5, i, static_cast<std::uint64_t>(p * 1000), c) < p ? 1 : 0;
      covered += interval[k].low <= p && p <= interval[k].high ? 1 : 0;
    }
    const double error = std::sqrt(exact * (1 - exact) / campaigns);
    EXPECT_NEAR(static_cast<double>(covered) / campaigns, exact, 4 * error + 1e-12) << p;
  }
}

// Claim: McNemar's p-value is the two-sided binomial tail at 1/2, by brute force, and by hand for 1 and 9: 2 (1 + 10) /
// 1024.
TEST(McNemar, IsTheBinomialTail) {
  EXPECT_NEAR(mcnemar_exact(1, 9), 22.0 / 1024, 1e-15);
  EXPECT_EQ(mcnemar_exact(0, 0), 1);
  for (int b = 0; b <= 30; ++b) {
    for (int c = 0; c <= 30; ++c) {
      const double brute = b == c ? 1 : std::min(1.0, 2 * binomial_cdf(std::min(b, c), b + c, 0.5));
      EXPECT_NEAR(mcnemar_exact(static_cast<std::uint64_t>(b), static_cast<std::uint64_t>(c)), brute, 1e-12);
    }
  }
  EXPECT_NEAR(mcnemar_exact(0, 1000) / std::pow(2.0, -999), 1, 1e-9);  // far below what 1 - CDF could give
}

// Claim: Wilson's interval as tabulated (Newcombe, Stat. Med. 17 (1998) 857, method 3), and its bounds solve the
// equation it is made from: |p - k/n| = z sqrt(p (1 - p) / n).
TEST(Wilson, TabulatedAndDefining) {
  EXPECT_NEAR(wilson(81, 263).low, 0.2553, 5e-5);
  EXPECT_NEAR(wilson(81, 263).high, 0.3662, 5e-5);
  EXPECT_NEAR(wilson(0, 20).high, 0.1611, 5e-5);
  EXPECT_NEAR(wilson(1, 29).low, 0.0061, 5e-5);
  const double z = 1.959963984540054;
  for (int k = 0; k <= 12; ++k) {
    const Interval interval = wilson(static_cast<std::uint64_t>(k), 12);
    for (const double p : {interval.low, interval.high}) {
      EXPECT_NEAR(std::abs(p - k / 12.0), z * std::sqrt(p * (1 - p) / 12), 1e-12) << k;
    }
  }
}

// Claim: two worked examples, one with negative and one with positive correlation (computed apart from the formulas of
// the paper, step by step).
TEST(NewcombePaired, WorkedExamples) {
  EXPECT_NEAR(newcombe_paired({36, 2, 12, 0}).low, 0.0569, 5e-5);
  EXPECT_NEAR(newcombe_paired({36, 2, 12, 0}).high, 0.3404, 5e-5);
  EXPECT_NEAR(newcombe_paired({12, 2, 9, 21}).low, 0.0112, 5e-5);
  EXPECT_NEAR(newcombe_paired({12, 2, 9, 21}).high, 0.2954, 5e-5);
}

// Claim: swapping the policies mirrors the interval; it contains the difference and lies in [-1, 1]; no pairs tell
// nothing.
TEST(NewcombePaired, SymmetryAndRange) {
  for (std::uint64_t both : {0, 3, 40}) {
    for (std::uint64_t a : {0, 1, 9}) {
      for (std::uint64_t b : {0, 2, 30}) {
        for (std::uint64_t neither : {0, 5}) {
          if (both + a + b + neither == 0) continue;
          const Interval there = newcombe_paired({both, a, b, neither});
          const Interval back = newcombe_paired({both, b, a, neither});
          const double difference = paired_difference({both, a, b, neither});
          EXPECT_NEAR(there.low, -back.high, 1e-12);
          EXPECT_NEAR(there.high, -back.low, 1e-12);
          EXPECT_LE(there.low, difference);
          EXPECT_GE(there.high, difference);
          EXPECT_GE(there.low, -1 - 1e-12);
          EXPECT_LE(there.high, 1 + 1e-12);
        }
      }
    }
  }
  EXPECT_EQ(newcombe_paired({}).low, -1);
  EXPECT_EQ(newcombe_paired({}).high, 1);
  EXPECT_TRUE(std::isnan(paired_difference({})));
}

// Claim: with uncorrelated outcomes (ad = bc) the paired interval is square-and-add of the Wilson intervals alone, as
// for two independent samples (Newcombe's method 10 there).
TEST(NewcombePaired, UncorrelatedIsSquareAndAdd) {
  const PairedTable table{6, 14, 9, 21};  // 6 * 21 = 14 * 9
  const Interval a = wilson(20, 50), b = wilson(15, 50);
  const Interval got = newcombe_paired(table);
  EXPECT_NEAR(got.low, -0.1 - std::hypot(0.3 - b.low, a.high - 0.4), 1e-12);
  EXPECT_NEAR(got.high, -0.1 + std::hypot(b.high - 0.3, 0.4 - a.low), 1e-12);
}

// Claim: over 20,000 simulated campaigns of 50 pairs each, the interval covers the true difference about as often as it
// says: Newcombe reports a mean coverage of 0.951 for this method; single settings stay within 0.93 ... 0.99 (standard
// error 0.0015).
TEST(NewcombePaired, Coverage) {
  struct Setting {
    double both, only_a, only_b;
  };
  for (const Setting& s : {Setting{0.3, 0.1, 0.2}, Setting{0.5, 0.05, 0.3}, Setting{0.1, 0.3, 0.3}}) {
    int covered = 0;
    const int campaigns = 20000;
    for (int c = 0; c < campaigns; ++c) {
      PairedTable table;
      for (std::uint32_t i = 0; i < 50; ++i) {
        const double u = uniform(11, i, static_cast<std::uint64_t>(1000 * s.both + 10 * s.only_a), c);
        ++(u < s.both                         ? table.both
           : u < s.both + s.only_a            ? table.only_a
           : u < s.both + s.only_a + s.only_b ? table.only_b
                                              : table.neither);
      }
      const Interval interval = newcombe_paired(table);
      const double truth = s.only_b - s.only_a;
      covered += interval.low <= truth && truth <= interval.high ? 1 : 0;
    }
    EXPECT_GT(covered, 0.93 * campaigns);
    EXPECT_LT(covered, 0.99 * campaigns);
  }
}

}  // namespace
}  // namespace graze
