#include "analysis/proportions.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>

#include "sampling/distribution.h"

namespace graze {
namespace {

/// Newcombe's phi-hat: the correlation of the two outcomes, whose numerator is drawn toward 0 by n/2 when positive.
double correlation(const PairedTable& table) {
  const auto a = static_cast<double>(table.both), b = static_cast<double>(table.only_a);
  const auto c = static_cast<double>(table.only_b), d = static_cast<double>(table.neither);
  const double margins = (a + b) * (c + d) * (a + c) * (b + d);
  if (margins == 0) return 0;
  const double product = a * d - b * c;
  const double corrected = product > 0 ? std::max(product - (a + b + c + d) / 2, 0.0) : product;
  return corrected / std::sqrt(margins);
}

}  // namespace

Interval clopper_pearson(std::uint64_t k, std::uint64_t n, double confidence) {
  const double tail = (1 - confidence) / 2;
  const auto successes = static_cast<double>(k), failures = static_cast<double>(n - k);
  return {k == 0 ? 0.0 : boost::math::ibeta_inv(successes, failures + 1, tail),
          k == n ? 1.0 : boost::math::ibetac_inv(successes + 1, failures, tail)};
}

double mcnemar_exact(std::uint64_t b, std::uint64_t c) {
  const std::uint64_t less = std::min(b, c), n = b + c;
  if (2 * less == n) return 1;
  // P(X <= less), X binomial(n, 1/2), is the regularised incomplete beta function I_1/2(n - less, less + 1).
  const double tail = boost::math::ibeta(static_cast<double>(n - less), static_cast<double>(less + 1), 0.5);
  return std::min(1.0, 2 * tail);
}

Interval wilson(std::uint64_t k, std::uint64_t n, double confidence) {
  if (n == 0) return {0, 1};
  const double z = normal_quantile(1 - (1 - confidence) / 2), z2 = z * z;
  const auto trials = static_cast<double>(n);
  const double p = static_cast<double>(k) / trials;
  const double middle = (p + z2 / (2 * trials)) / (1 + z2 / trials);
  const double half = z / (1 + z2 / trials) * std::sqrt(p * (1 - p) / trials + z2 / (4 * trials * trials));
  return {k == 0 ? 0.0 : middle - half, k == n ? 1.0 : middle + half};  // exactly, not to rounding
}

double paired_difference(const PairedTable& table) {
  const auto n = static_cast<double>(table.n());
  return (static_cast<double>(table.only_b) - static_cast<double>(table.only_a)) / n;  // 0/0: no pairs, NaN
}

Interval newcombe_paired(const PairedTable& table, double confidence) {
  const std::uint64_t n = table.n();
  if (n == 0) return {-1, 1};
  const double trials = static_cast<double>(n);
  const std::uint64_t of_a = table.both + table.only_a, of_b = table.both + table.only_b;
  const double p_a = static_cast<double>(of_a) / trials, p_b = static_cast<double>(of_b) / trials;
  const Interval a = wilson(of_a, n, confidence), b = wilson(of_b, n, confidence);
  const double phi = correlation(table);
  // Distance of a bound of b - a: one proportion moves down, the other up.
  const auto distance = [phi](double x, double y) { return std::sqrt(std::max(0.0, x * x - 2 * phi * x * y + y * y)); };
  return {p_b - p_a - distance(p_b - b.low, a.high - p_a), p_b - p_a + distance(b.high - p_b, p_a - a.low)};
}

Interval newcombe_independent(std::uint64_t success_a, std::uint64_t n_a, std::uint64_t success_b, std::uint64_t n_b,
                              double confidence) {
  if (n_a == 0 || n_b == 0) return {-1, 1};
  const Interval a = wilson(success_a, n_a, confidence), b = wilson(success_b, n_b, confidence);
  const double rate_a = static_cast<double>(success_a) / static_cast<double>(n_a);
  const double rate_b = static_cast<double>(success_b) / static_cast<double>(n_b);
  return {rate_b - rate_a - std::hypot(rate_b - b.low, a.high - rate_a),
          rate_b - rate_a + std::hypot(b.high - rate_b, rate_a - a.low)};
}

}  // namespace graze
