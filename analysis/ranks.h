#pragma once
// Tests by ranks: whether a number rises or falls with another one, whatever their distributions.

#include <cstdint>
#include <span>
#include <vector>

namespace graze {

/// Indices in rising order of their values; of equal values in rising order of the indices. No NaN.
std::vector<std::uint32_t> order_of(std::span<const double> values);

/// Ranks from 1; equal values share the mean of theirs.
std::vector<double> midranks(std::span<const double> values);
/// The same of the values at `order`, which is in rising order of their values: ranks[order[i]]. Other places of
/// `ranks` are left as they are.
void midranks_in_order(std::span<const double> values, std::span<const std::uint32_t> order, std::span<double> ranks);

/// Sum over groups of t equal ranks of t^3 - t; 0: no two are equal.
double tie_sum(std::span<const double> ranks);

/// Pearson's correlation (of ranks: Spearman's); NaN if one of them does not vary.
double correlation(std::span<const double> a, std::span<const double> b);

/// Two-sided p-values of Spearman's rank correlation with one target, for many predictors without ties (with few of
/// them it is close). Up to 40 values: by permutations of the target (200,000 with a fixed seed, so p >= 5e-6); beyond:
/// Student's approximation, r sqrt((n - 2) / (1 - r^2)).
class SpearmanTest {
 public:
  /// `ranks`: of the target.
  explicit SpearmanTest(std::span<const double> ranks);
  double p_value(double r) const;

 private:
  std::size_t n_;
  std::vector<double> null_;  // |r| under permutations, rising; empty: not needed
};

/// Two-sided p-values of the rank-sum test (Wilcoxon, Mann and Whitney) for a group of `k` among n. Without ties and
/// while that is quick (k^2 n^2 <= 1e8, of the smaller group): exact; else by the normal approximation, whose tail is
/// heavier than that of the rank sum, with its variance corrected for ties.
class RankSumTest {
 public:
  RankSumTest(std::size_t k, std::size_t n);
  /// `sum`: of the group's ranks among all n; `ties`: tie_sum() of all ranks.
  double p_value(double sum, double ties) const;

 private:
  double exact(double sum) const;
  std::size_t k_, n_;
  std::vector<double> tail_;  // P(sum of a group <= its least + i); empty: too large
};

/// Kruskal and Wallis: whether the ranks of some groups differ. `group`: of each value, 0, 1, …; corrected for ties. p
/// by chi-square with groups - 1 degrees of freedom. `epsilon`: the share of the ranks' variance that is between the
/// groups, in 0 .. 1. One group or constant ranks: p NaN.
struct GroupTest {
  double statistic, p_value, epsilon;
};
GroupTest kruskal_wallis(std::span<const double> ranks, std::span<const std::uint32_t> group);

}  // namespace graze
