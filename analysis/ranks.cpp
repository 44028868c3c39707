#include "analysis/ranks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>

#include "analysis/significance.h"

namespace graze {
namespace {

constexpr std::size_t kPermutedUpTo =
    40;  // values; beyond it Student's tail is within a quarter of the true one at 1e-4
constexpr int kPermutations = 200'000;

/// A whole number below `count`: the same from every C++ library, other than std::uniform_int_distribution's.
std::size_t below(std::mt19937_64& random, std::size_t count) {
  __extension__ using Wide = unsigned __int128;
  return static_cast<std::size_t>(Wide{random()} * count >> 64);
}

}  // namespace

std::vector<std::uint32_t> order_of(std::span<const double> values) {
  std::vector<std::uint32_t> order(values.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return values[a] != values[b] ? values[a] < values[b] : a < b; });
  return order;
}

void midranks_in_order(std::span<const double> values, std::span<const std::uint32_t> order, std::span<double> ranks) {
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double rank = 0.5 * static_cast<double>(begin + 1 + end);
    for (; begin < end; ++begin) ranks[order[begin]] = rank;
  }
}

double tie_sum(std::span<const double> ranks) {
  std::vector<double> sorted(ranks.begin(), ranks.end());
  std::sort(sorted.begin(), sorted.end());
  double sum = 0;
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin;
    while (end < sorted.size() && sorted[end] == sorted[begin]) ++end;
    const auto t = static_cast<double>(end - begin);
    sum += t * t * t - t;
    begin = end;
  }
  return sum;
}

std::vector<double> midranks(std::span<const double> values) {
  std::vector<double> ranks(values.size());
  midranks_in_order(values, order_of(values), ranks);
  return ranks;
}

double correlation(std::span<const double> a, std::span<const double> b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = a[i] - mean_a, y = b[i] - mean_b;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  return std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0);  // NaN stays NaN
}

SpearmanTest::SpearmanTest(std::span<const double> ranks) : n_(ranks.size()) {
  if (n_ < 3 || n_ > kPermutedUpTo || tie_sum(ranks) >= std::pow(n_, 3) - static_cast<double>(n_)) return;
  std::vector<double> target(ranks.begin(), ranks.end());
  const double mean = 0.5 * static_cast<double>(n_ + 1);
  double squares = 0, of_line = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    target[i] -= mean;
    squares += target[i] * target[i];
    of_line += std::pow(static_cast<double>(i + 1) - mean, 2);
  }
  const double scale = 1 / std::sqrt(squares * of_line);
  std::mt19937_64 random(1);
  null_.reserve(kPermutations);
  for (int k = 0; k < kPermutations; ++k) {
    double sum = 0;
    for (std::size_t i = n_; i > 0; --i) {
      std::swap(target[i - 1], target[below(random, i)]);
      sum += static_cast<double>(i) * target[i - 1];
    }
    null_.push_back(std::abs(sum * scale));
  }
  std::sort(null_.begin(), null_.end());
}

double SpearmanTest::p_value(double r) const {
  if (std::isnan(r) || n_ < 3) return std::numeric_limits<double>::quiet_NaN();
  if (!null_.empty()) {
    const auto from = std::lower_bound(null_.begin(), null_.end(), std::abs(r) - 1e-9);
    return static_cast<double>(null_.end() - from + 1) / static_cast<double>(null_.size() + 1);
  }
  const auto freedom = static_cast<double>(n_ - 2);
  return two_sided_student(r * std::sqrt(freedom / (1 - r * r)), freedom);
}

RankSumTest::RankSumTest(std::size_t k, std::size_t n) : k_(k), n_(n) {
  const std::size_t less = std::min(k, n - k);
  if (less == 0 || static_cast<double>(less) * static_cast<double>(n) > 1e4) return;
  const std::size_t width = less * (n - less) + 1;
  // ways[j][s]: subsets of j of the ranks 1 … m whose sum exceeds the least one by s.
  std::vector<std::vector<double>> ways(less + 1, std::vector<double>(width, 0.0));
  ways[0][0] = 1;
  for (std::size_t m = 1; m <= n; ++m) {
    for (std::size_t j = std::min(m, less); j >= 1; --j) {
      const std::size_t shift = m - j;  // element m becomes the j-th, which is j at the least
      if (shift >= width) continue;
      for (std::size_t s = width; s-- > shift;) ways[j][s] += ways[j - 1][s - shift];
    }
  }
  tail_ = std::move(ways[less]);
  const double all = std::accumulate(tail_.begin(), tail_.end(), 0.0);
  double sum = 0;
  for (double& one : tail_) one = (sum += one) / all;
}

double RankSumTest::exact(double sum) const {
  const auto k = static_cast<double>(k_), n = static_cast<double>(n_);
  const double above = sum - k * (k + 1) / 2, most = k * (n - k);  // both groups have the same count of U
  const double less = std::min(above, most - above);
  return std::min(1.0, 2 * tail_[static_cast<std::size_t>(std::lround(std::max(less, 0.0)))]);
}

double RankSumTest::p_value(double sum, double ties) const {
  const auto k = static_cast<double>(k_), n = static_cast<double>(n_);
  if (k_ == 0 || k_ == n_) return std::numeric_limits<double>::quiet_NaN();
  if (ties == 0 && !tail_.empty()) return exact(sum);
  const double variance = k * (n - k) / 12 * (n + 1 - ties / (n * (n - 1)));
  return two_sided_normal((sum - k * (n + 1) / 2) / std::sqrt(variance));
}

GroupTest kruskal_wallis(std::span<const double> ranks, std::span<const std::uint32_t> group) {
  struct Sum {
    double n = 0, ranks = 0;
  };
  std::map<std::uint32_t, Sum> sums;
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    Sum& sum = sums[group[i]];
    ++sum.n;
    sum.ranks += ranks[i];
  }
  const auto n = static_cast<double>(ranks.size());
  double between = 0;
  for (const auto& [number, sum] : sums) between += std::pow(sum.ranks - sum.n * (n + 1) / 2, 2) / sum.n;
  const double untied = 1 - tie_sum(ranks) / (n * n * n - n);
  const double h = 12 / (n * (n + 1)) * between / untied;
  if (sums.size() < 2 || !(untied > 0)) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan};
  }
  return {h, upper_chi_square(h, static_cast<double>(sums.size() - 1)), std::min(1.0, h / (n - 1))};
}

}  // namespace graze
