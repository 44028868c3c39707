#include "sampling/copula.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sampling/distribution.h"
#include "sampling/stream.h"

namespace graze {

int correlation_factor(const Eigen::MatrixXd& correlation, Eigen::MatrixXd& factor) {
  const int n = static_cast<int>(correlation.rows());
  factor = Eigen::MatrixXd::Zero(n, n);
  // A pivot is a sum of n squares subtracted from 1, so anything below this is rounding, not correlation.
  const double least = 4.0 * n * std::numeric_limits<double>::epsilon();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = correlation(i, j);
      for (int k = 0; k < j; ++k) sum -= factor(i, k) * factor(j, k);
      if (i == j && !(sum > least)) return i;
      factor(i, j) = i == j ? std::sqrt(sum) : sum / factor(j, j);
    }
  }
  return -1;
}

void correlate(const Eigen::MatrixXd& factor, const std::vector<int>& members, std::span<double> u) {
  const int n = static_cast<int>(members.size());
  std::vector<double> z(members.size());
  for (int i = 0; i < n; ++i) z[i] = normal_quantile(u[members[i]]);
  for (int i = 1; i < n; ++i) {
    double sum = 0;
    for (int k = 0; k <= i; ++k) sum += factor(i, k) * z[k];
    u[members[i]] = std::clamp(normal_cdf(sum), kSmallestUniform, kLargestUniform);
  }
}

void correlate_scores(const Eigen::MatrixXd& factor, std::vector<std::vector<double>>& scores) {
  // From the last row up, because each needs the rows before it as they were.
  for (std::size_t i = scores.size(); i-- > 0;) {
    for (std::size_t p = 0; p < scores[i].size(); ++p) {
      double sum = 0;
      for (std::size_t k = 0; k <= i; ++k) sum += factor(i, k) * scores[k][p];
      scores[i][p] = sum;
    }
  }
}

std::vector<std::uint32_t> ranks_of(const std::vector<double>& numbers) {
  std::vector<std::uint32_t> order(numbers.size()), ranks(numbers.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return numbers[a] < numbers[b] || (numbers[a] == numbers[b] && a < b);
  });
  for (std::size_t i = 0; i < order.size(); ++i) ranks[order[i]] = static_cast<std::uint32_t>(i);
  return ranks;
}

}  // namespace graze
