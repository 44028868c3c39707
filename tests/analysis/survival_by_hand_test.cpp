// Survival against roads of its own: Efron's redistribution of the censored, trapezia under the curve, and log-rank
// tests counted failure by failure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "analysis/significance.h"
#include "analysis/survival.h"
#include "sampling/constants.h"

namespace graze {
namespace {

/// Lifetimes on a coarse grid of times, so that many are tied; `censored` of them, about.
std::vector<Lifetime> coarse_lifetimes(std::mt19937_64& random, std::size_t n, double censored) {
  std::vector<Lifetime> out;
  for (std::size_t i = 0; i < n; ++i) {
    const double time = 0.25 * static_cast<double>(1 + random() % 12);
    out.push_back({time, static_cast<double>(random() % 1000) >= 1000 * censored});
  }
  return out;
}

/// The share that has not failed after `time`, by Efron's redistribution to the right: every trace has the same mass;
/// that of a censored one goes to those that are seen longer (or fail later), in equal parts.
double redistributed_share(std::vector<Lifetime> lives, double time) {
  std::stable_sort(lives.begin(), lives.end(), [](const Lifetime& a, const Lifetime& b) {
    return a.time != b.time ? a.time < b.time : a.failed && !b.failed;
  });
  std::vector<double> mass(lives.size(), 1.0 / static_cast<double>(lives.size()));
  double failed = 0;
  for (std::size_t i = 0; i < lives.size(); ++i) {
    if (lives[i].failed) {
      if (lives[i].time <= time) failed += mass[i];
      continue;
    }
    const std::size_t later = lives.size() - i - 1;
    for (std::size_t j = i + 1; j < lives.size(); ++j) mass[j] += mass[i] / static_cast<double>(later);
  }
  return 1 - failed;
}

double share_at(const Survival& survival, double time) {
  double share = 1;
  for (const SurvivalStep& step : survival.steps) share = step.time <= time ? step.share : share;
  return share;
}

// Claim: the product-limit estimate is that of redistribution to the right, at every time, with ties between failures
// and censoring; steps stand at the times of failures alone, with the counts of these.
TEST(SurvivalByHand, SharesAreRedistributed) {
  std::mt19937_64 random(121);
  for (int round = 0; round < 60; ++round) {
    const auto lives = coarse_lifetimes(random, 1 + random() % 40, 0.1 * static_cast<double>(random() % 10));
    const Survival got = survival_of(lives);
    std::map<double, std::size_t> failures;
    for (const Lifetime& life : lives) failures[life.time] += life.failed;
    std::erase_if(failures, [](const auto& one) { return one.second == 0; });
    ASSERT_EQ(got.steps.size(), failures.size());
    std::size_t all = 0;
    for (const SurvivalStep& step : got.steps) {
      EXPECT_EQ(step.failed, failures.at(step.time));
      const auto at_risk =
          std::count_if(lives.begin(), lives.end(), [&](const Lifetime& l) { return l.time >= step.time; });
      EXPECT_EQ(step.at_risk, static_cast<std::size_t>(at_risk));
      all += step.failed;
    }
    EXPECT_EQ(got.failed, all);
    EXPECT_EQ(got.traces, lives.size());
    for (double time = 0; time < 3.3; time += 0.125) {
      EXPECT_NEAR(share_at(got, time), redistributed_share(lives, time), 1e-12) << time;
    }
  }
}

// Claim: the restricted mean is the area under the shares (a thousand strips, cut at a quarter of the grid: exact), and
// of uncensored traces the mean of their times.
TEST(SurvivalByHand, MeanIsTheArea) {
  std::mt19937_64 random(122);
  for (int round = 0; round < 40; ++round) {
    const auto lives = coarse_lifetimes(random, 2 + random() % 30, round % 2 == 0 ? 0.0 : 0.4);
    const Survival got = survival_of(lives);
    double area = 0, last = 0, sum = 0;
    for (const Lifetime& life : lives) last = std::max(last, life.time), sum += life.time;
    for (double t = 0; t < last - 1e-9; t += 0.0625) area += 0.0625 * redistributed_share(lives, t);
    EXPECT_EQ(got.seen_until, last);
    EXPECT_NEAR(got.mean, area, 1e-12);
    if (round % 2 == 0) {
      EXPECT_NEAR(got.mean, sum / static_cast<double>(lives.size()), 1e-12);
    }
    if (got.failed == 0) continue;
    EXPECT_LE(got.mean_interval.low, got.mean);
    EXPECT_GE(got.mean_interval.high, got.mean);
    EXPECT_GE(got.mean_interval.low, 0);
    EXPECT_LE(got.mean_interval.high, last);
  }
}

// Claim: the variance of the mean is Kaplan and Meier's sum, each area counted again from its step to the end.
TEST(SurvivalByHand, MeanHasItsVariance) {
  std::mt19937_64 random(123);
  for (int round = 0; round < 20; ++round) {
    const auto lives = coarse_lifetimes(random, 60, 0.3);
    const Survival got = survival_of(lives);
    double variance = 0;
    for (const SurvivalStep& step : got.steps) {
      double area = 0;
      for (double t = step.time; t < got.seen_until - 1e-9; t += 0.25) area += 0.25 * share_at(got, t);
      const auto n = static_cast<double>(step.at_risk), d = static_cast<double>(step.failed);
      if (d < n) variance += area * area * d / (n * (n - d));
    }
    EXPECT_NEAR(got.mean_interval.high - got.mean, 1.959963985 * std::sqrt(variance), 1e-8);
  }
}

// Claim: without censoring Greenwood's variance is the binomial one, s (1 - s) / n, so that the interval of a share is
// s^exp(-+ z sqrt((1 - s) / (n s)) / |log s|), at 95 and at 80 %.
TEST(SurvivalByHand, IntervalsWithoutCensoringAreBinomial) {
  std::mt19937_64 random(124);
  for (const auto& [confidence, z] : {std::pair{0.95, 1.959963985}, {0.8, 1.281551566}}) {
    const auto lives = coarse_lifetimes(random, 50, 0);
    const Survival got = survival_of(lives, confidence);
    double before = 1;
    for (const SurvivalStep& step : got.steps) {
      const double s = step.share;
      if (s == 0) {
        EXPECT_EQ(step.interval.low, 0);
        EXPECT_EQ(step.interval.high, before);
        continue;
      }
      const double error = z * std::sqrt((1 - s) / (50 * s)) / std::abs(std::log(s));
      EXPECT_NEAR(step.interval.low, std::pow(s, std::exp(error)), 1e-8);
      EXPECT_NEAR(step.interval.high, std::pow(s, std::exp(-error)), 1e-8);
      before = step.interval.high;
    }
  }
}

// Claim: the median is the first time at which half or fewer are left, exactly half included; its interval's ends are
// where those of the shares reach a half, and neither is known where more than half last.
TEST(SurvivalByHand, Medians) {
  const Survival half = survival_of({{1, true}, {2, true}, {3, false}, {4, false}});
  EXPECT_EQ(half.median, 2);
  EXPECT_EQ(half.median_interval.low, 1);
  EXPECT_TRUE(std::isnan(half.median_interval.high));
  EXPECT_TRUE(std::isnan(survival_of({{1, true}, {2, false}, {3, false}}).median));
  const Survival one = survival_of({{0.7, true}});
  EXPECT_EQ(one.median, 0.7);
  EXPECT_EQ(one.steps.at(0).share, 0);
  EXPECT_EQ(one.steps[0].interval.high, 1) << "before it nothing is known";
  EXPECT_EQ(one.mean, 0.7);
  EXPECT_EQ(survival_of({{0.7, false}}).mean, 0.7);
  EXPECT_EQ(survival_of({}).traces, 0u);
  EXPECT_EQ(survival_of({}).seen_until, 0);
}

// Claim: doubling all times doubles all times and no share; the order of the traces means nothing.
TEST(SurvivalByHand, UnitsAndOrderDoNotMatter) {
  std::mt19937_64 random(125);
  auto lives = coarse_lifetimes(random, 40, 0.4);
  const Survival before = survival_of(lives);
  std::shuffle(lives.begin(), lives.end(), random);
  for (Lifetime& life : lives) life.time *= 2;
  const Survival after = survival_of(lives);
  ASSERT_EQ(after.steps.size(), before.steps.size());
  for (std::size_t i = 0; i < after.steps.size(); ++i) {
    EXPECT_EQ(after.steps[i].time, 2 * before.steps[i].time);
    EXPECT_EQ(after.steps[i].share, before.steps[i].share);
    EXPECT_EQ(after.steps[i].interval.low, before.steps[i].interval.low);
  }
  EXPECT_NEAR(after.mean, 2 * before.mean, 1e-12);
}

/// The log-rank statistic of two groups, time by time, with the hypergeometric mean and variance of each.
double log_rank_by_hand(const std::vector<Lifetime>& a, const std::vector<Lifetime>& b) {
  std::set<double> times;
  for (const auto* group : {&a, &b}) {
    for (const Lifetime& life : *group) {
      if (life.failed) times.insert(life.time);
    }
  }
  double excess = 0, variance = 0;
  for (const double time : times) {
    const auto count = [&](const std::vector<Lifetime>& group, bool failed) {
      return static_cast<double>(std::count_if(group.begin(), group.end(), [&](const Lifetime& life) {
        return failed ? life.failed && life.time == time : life.time >= time;
      }));
    };
    const double risk_a = count(a, false), n = risk_a + count(b, false);
    const double d_a = count(a, true), d = d_a + count(b, true);
    excess += d_a - d * risk_a / n;
    if (n > 1) variance += d * risk_a / n * (1 - risk_a / n) * (n - d) / (n - 1);
  }
  return variance > 0 ? excess * excess / variance : 0;
}

// Claim: of two groups with ties and censoring the statistic is the one by hand; groups may change places; the p-value
// is chi-square's with one degree of freedom.
TEST(SurvivalByHand, LogRankOfTwoGroups) {
  std::mt19937_64 random(126);
  for (int round = 0; round < 60; ++round) {
    const auto a = coarse_lifetimes(random, 5 + random() % 30, 0.3),
               b = coarse_lifetimes(random, 5 + random() % 30, 0.5);
    const LogRank got = log_rank({a, b});
    const double wanted = log_rank_by_hand(a, b);
    EXPECT_NEAR(got.chi_square, wanted, 1e-9 * (1 + wanted));
    EXPECT_NEAR(log_rank({b, a}).chi_square, wanted, 1e-9 * (1 + wanted));
    if (got.freedom == 1) {
      EXPECT_NEAR(got.p_value, upper_chi_square(wanted, 1), 1e-9);
    }
  }
}

// Claim: of three groups the order does not matter, and an empty one adds neither a degree of freedom nor any
// statistic.
TEST(SurvivalByHand, LogRankOfThreeGroups) {
  std::mt19937_64 random(127);
  for (int round = 0; round < 20; ++round) {
    const auto a = coarse_lifetimes(random, 20, 0.2), b = coarse_lifetimes(random, 25, 0.2),
               c = coarse_lifetimes(random, 15, 0.5);
    const double chi_square = log_rank({a, b, c}).chi_square;
    EXPECT_NEAR(log_rank({c, a, b}).chi_square, chi_square, 1e-8);
    EXPECT_NEAR(log_rank({b, a, c}).chi_square, chi_square, 1e-8);
    EXPECT_EQ(log_rank({a, b, c}).freedom, 2);
    EXPECT_GE(chi_square, 0);
    const LogRank with_empty = log_rank({a, {}, b});
    EXPECT_EQ(with_empty.freedom, 1);
    EXPECT_NEAR(with_empty.chi_square, log_rank_by_hand(a, b), 1e-8);
  }
}

// Claim: in three groups with equal hazards 5 % of 1000 tests reject at 5 % (4 standard errors: 2.8 %).
TEST(SurvivalByHand, LogRankOfThreeGroupsErrsAsItSays) {
  std::mt19937_64 random(128);
  std::exponential_distribution<double> life;
  int rejected = 0;
  constexpr int kTests = 1000;
  for (int i = 0; i < kTests; ++i) {
    std::vector<std::vector<Lifetime>> groups(3);
    for (auto& group : groups) {
      for (int k = 0; k < 40; ++k) {
        const double fails = life(random), seen = 2 * life(random);
        group.push_back({std::min(fails, seen), fails <= seen});
      }
    }
    rejected += log_rank(groups).p_value < 0.05;
  }
  EXPECT_NEAR(static_cast<double>(rejected) / kTests, 0.05, 4 * std::sqrt(0.0475 / kTests));
}

/// The paired test by hand: scores from a hazard that is summed for each trace anew.
double paired_by_hand(const std::vector<Lifetime>& a, const std::vector<Lifetime>& b) {
  std::vector<Lifetime> all = a;
  all.insert(all.end(), b.begin(), b.end());
  const auto score = [&](const Lifetime& life) {
    std::set<double> times;
    for (const Lifetime& one : all) {
      if (one.failed && one.time <= life.time) times.insert(one.time);
    }
    double out = life.failed ? 1 : 0;
    for (const double t : times) {
      double d = 0, n = 0;
      for (const Lifetime& one : all) d += one.failed && one.time == t, n += one.time >= t;
      out -= d / n;
    }
    return out;
  };
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = score(a[i]) - score(b[i]);
    sum += d;
    squares += d * d;
  }
  return sum * sum / squares;
}

// Claim: the paired test's statistic is that of Nelson and Aalen's scores by hand; policies may change places; of the
// same lifetimes there is nothing to tell.
TEST(SurvivalByHand, PairedLogRank) {
  std::mt19937_64 random(129);
  for (int round = 0; round < 30; ++round) {
    const std::size_t n = 6 + random() % 20;
    const auto a = coarse_lifetimes(random, n, 0.3), b = coarse_lifetimes(random, n, 0.3);
    const LogRank got = paired_log_rank(a, b);
    EXPECT_NEAR(got.chi_square, paired_by_hand(a, b), 1e-9);
    EXPECT_NEAR(paired_log_rank(b, a).chi_square, got.chi_square, 1e-9);
    EXPECT_NEAR(got.p_value, upper_chi_square(got.chi_square, 1), 1e-12);
    EXPECT_TRUE(std::isnan(paired_log_rank(a, a).p_value));
    EXPECT_EQ(paired_log_rank(a, a).freedom, 0);
  }
}

}  // namespace
}  // namespace graze
