#pragma once
// Statistics of proportions: intervals and tests for counts of successes, single and paired (analysis/score.h has the
// exact ones for one proportion and for discordant pairs).

#include <cstdint>

#include "analysis/score.h"

namespace graze {

/// Wilson's score interval for k successes of n (Wilson 1927). n = 0 gives [0, 1].
Interval wilson(std::uint64_t k, std::uint64_t n, double confidence = 0.95);

/// How two policies ended on the same particles.
struct PairedTable {
  std::uint64_t both = 0, only_a = 0, only_b = 0, neither = 0;
  std::uint64_t n() const { return both + only_a + only_b + neither; }
};

/// Rate of b minus rate of a; NaN if there are no pairs.
double paired_difference(const PairedTable& table);

/// Interval for the paired difference: Newcombe, Statistics in Medicine 17 (1998) 2635-2650, method 10 (square-and-add
/// of Wilson's intervals, with the correlation of both, continuity corrected). No pairs give [-1, 1].
Interval newcombe_paired(const PairedTable& table, double confidence = 0.95);

/// Interval for the difference rate(b) - rate(a) of independent proportions: Newcombe, Statistics in Medicine 17 (1998)
/// 873-890, method 10 (square-and-add of Wilson's intervals). A side without trials gives [-1, 1].
Interval newcombe_independent(std::uint64_t success_a, std::uint64_t n_a, std::uint64_t success_b, std::uint64_t n_b,
                              double confidence = 0.95);

}  // namespace graze
