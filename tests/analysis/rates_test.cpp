// What a rate leaves open: bounds, joint coverage, margins, sizes.
#include "analysis/rates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "analysis/proportions.h"
#include "analysis/sequential.h"
#include "sampling/stream.h"

namespace graze {
namespace {

Score score_of(const std::vector<std::uint64_t>& successes, std::uint64_t n, std::uint64_t unknown) {
  Score out;
  for (const std::uint64_t k : successes) {
    PolicyScore& one = out.policies.emplace_back();
    one.policy = "p" + std::to_string(out.policies.size());
    one.n = n;
    one.success = k;
    one.unknown = unknown;
  }
  return out;
}

// Claim: unknown failures count as failures in the worst case and as successes in the best, each with its interval.
TEST(Rates, UnknownFailuresBothWays) {
  const RateBounds got = rate_statistics(score_of({60}, 100, 30)).policies[0];
  EXPECT_EQ(got.worst, 0.6);
  EXPECT_EQ(got.best, 0.9);
  EXPECT_EQ(got.worst_interval.low, clopper_pearson(60, 100).low);
  EXPECT_EQ(got.best_interval.high, clopper_pearson(90, 100).high);
  EXPECT_EQ(got.simultaneous.low, got.worst_interval.low);  // there is one policy
  EXPECT_TRUE(std::isnan(rate_statistics(score_of({0}, 0, 0)).policies[0].worst));
}

// Claim: all of ten policies' simultaneous intervals hold together in at least 95 % of 2000 campaigns, also where the
// policies share their particles; single ones would not (the bound is met within 3 standard errors).
TEST(Rates, SimultaneousIntervalsHoldTogether) {
  const int campaigns = 2000;
  for (const double shared : {0.0, 0.5}) {
    int together = 0, single = 0;
    for (std::uint32_t c = 0; c < campaigns; ++c) {
      std::vector<std::uint64_t> successes(10);
      for (std::uint32_t i = 0; i < 50; ++i) {
        const bool by_particle = uniform(51, i, 98, c) < shared;
        for (std::uint64_t policy = 0; policy < 10; ++policy) {
          successes[policy] += uniform(51, i, by_particle ? 99 : policy, c) < 0.7;
        }
      }
      const auto holds = [](const Interval& interval) { return interval.low <= 0.7 && 0.7 <= interval.high; };
      bool all = true, all_single = true;
      for (const RateBounds& one : rate_statistics(score_of(successes, 50, 0)).policies) {
        all = all && holds(one.simultaneous);
        all_single = all_single && holds(one.worst_interval);
      }
      together += all;
      single += all_single;
    }
    EXPECT_GE(together, campaigns * 0.95 - 3 * std::sqrt(campaigns * 0.0475)) << shared;
    EXPECT_LT(single, campaigns * 0.9) << shared;
  }
}

// Claim: McNemar's p-values are corrected by Holm over all pairs; a pair without particles is none.
TEST(Rates, PairsAreCorrected) {
  Score score = score_of({1, 2, 3}, 10, 0);
  score.pairs.resize(3);
  score.pairs[0].n = score.pairs[1].n = 10;
  score.pairs[0].p_value = 0.01;
  score.pairs[1].p_value = 0.04;
  const RateStatistics got = rate_statistics(score);
  EXPECT_NEAR(got.pairs[0].p_holm, 0.02, 1e-15);
  EXPECT_NEAR(got.pairs[1].p_holm, 0.04, 1e-15);
  EXPECT_TRUE(std::isnan(got.pairs[2].p_holm));
}

// Claim: quantiles, the worst with its particle (of equal ones the lowest), and the share below 0.
TEST(Rates, Margins) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const MarginSummary got = summarise_margins({3, -1, nan, 1, -1, 2}, {0, 7, 2, 3, 4, 5});
  EXPECT_EQ(got.n, 5u);
  EXPECT_EQ(got.worst, -1);
  EXPECT_EQ(got.worst_particle, 4u);
  EXPECT_EQ(got.below, 2u);
  EXPECT_EQ(got.interval.low, clopper_pearson(2, 5).low);
  EXPECT_EQ(got.quantiles[3], 1);
  EXPECT_EQ(got.quantiles[4], 2);
  EXPECT_EQ(summarise_margins({inf, inf}, {0, 1}).quantiles[0], inf);
  EXPECT_TRUE(std::isnan(summarise_margins({}, {}).quantiles[0]));
}

// Claim: sizes are those of the tables of docs/statistics.md: half width 0.05 at 0.5, 0.9 and 0.99 takes 402, 159 and
// some 36 particles; p >= 0.9 is open at the size before the one told and decided at it; a rate at the bound never is.
TEST(Rates, HowManyParticles) {
  EXPECT_NEAR(particles_for_width(0.5, 0.05), 402, 2);
  EXPECT_NEAR(particles_for_width(0.9, 0.05), 159, 10);
  const DecisionSize got = particles_to_decide(0.95, 0.9);
  const auto low = [](std::uint64_t n) {
    return clopper_pearson(static_cast<std::uint64_t>(std::llround(0.95 * static_cast<double>(n))), n).low;
  };
  EXPECT_GE(low(got.fixed), 0.9);
  EXPECT_LT(low(got.fixed - 1), 0.9);
  EXPECT_GT(got.sequence, got.fixed);
  EXPECT_EQ(particles_to_decide(0.9, 0.9).fixed, 0u);
  EXPECT_NEAR(particles_to_decide(1, 0.9).fixed, 36, 1);  // as docs/statistics.md says of gates
}

// Claim: means of margins that hardly differ are told apart by their digits, others have three.
TEST(MarginSummary, MeansHaveDigitsEnoughToDiffer) {
  std::vector<double> close, wide;
  std::vector<std::uint32_t> particles;
  for (int i = 0; i <= 100; ++i) {
    particles.push_back(static_cast<std::uint32_t>(i));
    close.push_back(-0.145 + 1e-6 * i);
    wide.push_back(-0.145 + 0.01 * i);
  }
  MarginSummary some = summarise_margins(close, particles);
  some.unit = "m";
  EXPECT_NEAR(spread_of(some), 90e-6, 1e-12);
  EXPECT_EQ(mean_text(-0.14495, some), "-0.14495 m");
  EXPECT_EQ(mean_text(-0.144951, some), "-0.144951 m");
  some = summarise_margins(wide, particles);
  EXPECT_EQ(mean_text(-0.144951, some), "-0.145");
  EXPECT_EQ(mean_text(0, some), "0");
  EXPECT_EQ(mean_text(2, summarise_margins({2, 2}, {0, 1})), "2") << "all alike";
  EXPECT_TRUE(std::isnan(spread_of(summarise_margins({}, {}))));
}

// Both score and explain show pairs so.
TEST(PairsToShow, AreThoseThatDifferMostOfMany) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(pairs_to_show({0.5, none, 0.1}), (std::vector<std::size_t>{0, 1, 2})) << "few stay as they are";
  EXPECT_EQ(pairs_left_out(3, 3), "");
  std::vector<double> many = {none};
  for (int i = 0; i < 11; ++i) many.push_back(1.0 - 0.05 * i);
  many.push_back(0.5);  // as the one before
  const std::vector<std::size_t> shown = pairs_to_show(many);
  EXPECT_EQ(shown, (std::vector<std::size_t>{11, 12, 10, 9, 8, 7, 6, 5, 4, 3}));
  EXPECT_EQ(pairs_left_out(many.size(), shown.size()), "… and 3 pairs that differ less (--json has all)\n");
}

}  // namespace
}  // namespace graze
