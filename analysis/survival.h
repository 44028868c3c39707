#pragma once
// How long traces last: the share that has not failed yet, by time, and whether policies differ in it.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "analysis/score.h"

namespace graze {

/// How long one trace was seen not to fail.
struct Lifetime {
  double time = 0;      // s
  bool failed = false;  // then; else it was seen until then, and no longer (censored)
};

/// At and after a time at which traces failed, until the next.
struct SurvivalStep {
  double time = 0;  // s
  std::size_t at_risk = 0, failed = 0;
  double share = 1;   // that has not failed
  Interval interval;  // 95 %, of this time alone
};

struct Survival {
  std::string what;  // any failure, or a requirement
  std::size_t traces = 0, failed = 0;
  double seen_until = 0;          // s: the last time at which a trace was seen; the estimate ends there
  double median = 0;              // s: the first time at which half or fewer are left; NaN: more than half last
  Interval median_interval = {};  // 95 %, by the intervals of the shares; ends NaN: beyond what was seen
  // s, until a failure or seen_until, whichever comes first: the area under the shares ("restricted mean").
  double mean = 0;
  Interval mean_interval;  // 95 %, Greenwood's variance; ends NaN: nothing failed, so nothing is known of the spread
  std::vector<SurvivalStep> steps;
};

/// Kaplan and Meier's estimate. Intervals: Greenwood's variance of log(-log share), which keeps them within 0 and 1;
/// at a share of 0 up to the upper end before it. Censoring at a time counts as after failures at it.
Survival survival_of(std::vector<Lifetime> lifetimes, double confidence = 0.95);

/// Whether lifetimes of several groups differ.
struct LogRank {
  double chi_square = 0, freedom = 0, p_value = 1;  // p NaN: nothing to compare
};
/// The log-rank test. It takes the groups' traces as independent of each other.
LogRank log_rank(const std::vector<std::vector<Lifetime>>& groups);
/// The same of two groups whose i-th traces are of one particle: each pair's difference of log-rank scores counts with
/// a sign that the test takes as a fair coin's. Uses that particles are shared; asks for no independence within pairs.
LogRank paired_log_rank(std::span<const Lifetime> a, std::span<const Lifetime> b);

}  // namespace graze
