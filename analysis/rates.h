#pragma once
// What a success rate leaves open: unknown failures counted both ways, several policies at once, how many particles
// would tell more; and how far margins are from 0.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/score.h"

namespace graze {

/// One policy's rate when several are judged together, and with its unknown failures (nothing was violated, the
/// objective was not met) counted as failures and as successes.
struct RateBounds {
  std::string policy;
  std::uint64_t n = 0, success = 0, unknown = 0;
  double worst = 0, best = 0;              // success / n, (success + unknown) / n; NaN if n = 0
  Interval worst_interval, best_interval;  // each 95 %, Score::interval()
  Interval simultaneous;  // of `worst`: all policies' together hold at 95 % (Bonferroni: it asks for no independence)
};

/// Two policies on the same particles, corrected for how many pairs there are.
struct CorrectedPair {
  std::string a, b;
  double difference = 0;           // rate b - rate a
  double p_value = 1, p_holm = 1;  // McNemar, exact
};

/// Which pairs a text shows, of the p values of all: as they stand if they are few, else those that differ most, the
/// most different first. What has no p value comes last.
std::vector<std::size_t> pairs_to_show(const std::vector<double>& p_values);
/// "… and 5 pairs that differ less (--json has all)" with its line end; empty if all are shown.
std::string pairs_left_out(std::size_t all, std::size_t shown);

struct RateStatistics {
  std::vector<RateBounds> policies;
  std::vector<CorrectedPair> pairs;
};
RateStatistics rate_statistics(const Score& score);

/// How far traces kept from violating a requirement, or missed the objective.
struct MarginSummary {
  std::string name, unit;
  std::uint64_t n = 0;
  std::vector<double> quantiles;  // at kMarginQuantiles; NaN without traces
  double worst = 0;
  std::uint32_t worst_particle = 0;
  std::uint64_t below = 0;  // that are < 0
  Interval interval;        // of below / n, 95 %, Clopper-Pearson
};
inline constexpr double kMarginQuantiles[] = {0.01, 0.05, 0.25, 0.5, 0.75, 0.95};

/// From the 5 % to the 95 % quantile: nine in ten of the margins lie no farther apart. NaN without traces.
double spread_of(const MarginSummary& margins);
/// A mean of some of these margins, with its unit, and digits enough to tell it from those of others.
std::string mean_text(double mean, const MarginSummary& margins);

/// margins: by trace, of the particles. NaN does not count.
MarginSummary summarise_margins(const std::vector<double>& margins, const std::vector<std::uint32_t>& particles);

/// Particles that a fixed campaign needs, were the rate this one: the least n whose Clopper-Pearson interval after
/// round(rate n) successes is at most 2 `half_width` wide. 0: more than 10^9.
std::uint64_t particles_for_width(double rate, double half_width, double confidence = 0.95);

/// Particles at which `p >= bound` would be decided, were the successes just as many as the rate says.
struct DecisionSize {
  double bound = 0;
  std::uint64_t fixed = 0;     // by Clopper and Pearson's interval, of a number fixed beforehand
  std::uint64_t sequence = 0;  // by the confidence sequence of --until; both 0: more than 10^9
};
DecisionSize particles_to_decide(double rate, double bound, double confidence = 0.95);

}  // namespace graze
