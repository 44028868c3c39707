#pragma once
// Intervals for a number that was measured on the same particles in two ways: are the means and the scatters the same?

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <vector>

namespace graze {

struct Estimate {
  double value = 0, low = 0, high = 0;

  bool holds(double x) const { return low <= x && x <= high; }
  /// Whether all of the interval lies within [a, b].
  bool within(double a, double b) const { return a <= low && high <= b; }
};

/// Student's interval of the mean. Fewer than two numbers give all of the line.
inline Estimate mean_of(const std::vector<double>& x, double confidence) {
  const double n = static_cast<double>(x.size()), infinite = std::numeric_limits<double>::infinity();
  double sum = 0, squares = 0;
  for (double one : x) sum += one;
  if (x.size() < 2) return {sum / n, -infinite, infinite};
  const double mean = sum / n;
  for (double one : x) squares += (one - mean) * (one - mean);
  const double t = boost::math::quantile(boost::math::students_t(n - 1), 0.5 * (1 + confidence));
  const double off = t * std::sqrt(squares / (n - 1) / n);
  return {mean, mean - off, mean + off};
}

/// Standard deviation.
inline double scatter_of(const std::vector<double>& x) {
  const double mean = mean_of(x, 0.5).value;
  double squares = 0;
  for (double one : x) squares += (one - mean) * (one - mean);
  return std::sqrt(squares / (static_cast<double>(x.size()) - 1));
}

namespace paired_numbers {

/// What each number adds to log(scatter), to first order: its influence (Hampel 1974). Their mean is 0.
inline std::vector<double> influence_on_log_scatter(const std::vector<double>& x) {
  const double mean = mean_of(x, 0.5).value, s = scatter_of(x);
  std::vector<double> out;
  for (double one : x) out.push_back(0.5 * ((one - mean) * (one - mean) / (s * s) - 1));
  return out;
}

inline std::vector<double> differences(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<double> out;
  for (std::size_t i = 0; i < x.size(); ++i) out.push_back(x[i] - y[i]);
  return out;
}

inline Estimate scaled(double value, const Estimate& log_error) {
  const double off = 0.5 * (log_error.high - log_error.low);
  return {value, value * std::exp(-off), value * std::exp(off)};
}

}  // namespace paired_numbers

/// Interval of the standard deviation, from the influence of each number on its logarithm: needs no normal numbers, but
/// many of them. All numbers alike give no interval: NaN.
inline Estimate scatter_of(const std::vector<double>& x, double confidence) {
  return paired_numbers::scaled(scatter_of(x), mean_of(paired_numbers::influence_on_log_scatter(x), confidence));
}

/// Mean of x - y on the same particles, Student's interval of the differences.
inline Estimate difference_of_means(const std::vector<double>& x, const std::vector<double>& y, double confidence) {
  return mean_of(paired_numbers::differences(x, y), confidence);
}

/// Scatter of x over that of y on the same particles, as scatter_of has it: influences are subtracted particle by
/// particle, so that what both share does not widen the interval.
inline Estimate ratio_of_scatters(const std::vector<double>& x, const std::vector<double>& y, double confidence) {
  const std::vector<double> difference = paired_numbers::differences(paired_numbers::influence_on_log_scatter(x),
                                                                     paired_numbers::influence_on_log_scatter(y));
  return paired_numbers::scaled(scatter_of(x) / scatter_of(y), mean_of(difference, confidence));
}

}  // namespace graze
