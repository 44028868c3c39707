#pragma once
// One-dimensional distributions. All are sampled through their quantile function (inverse CDF) from a uniform in (0,1),
// so that random, Latin hypercube and Sobol designs share one path.

#include <optional>
#include <string>
#include <vector>

namespace graze {

/// Inverse of the standard normal CDF. Wichura's AS 241 (PPND16), relative error below 1e-15.
double normal_quantile(double u);
/// Standard normal CDF.
double normal_cdf(double z);

class Distribution {
 public:
  // Each throws std::invalid_argument with the violated rule ("std -0.1 is negative; a standard deviation must be >=
  // 0").
  static Distribution constant(double value);
  static Distribution normal(double mean, double std);
  static Distribution truncated_normal(double mean, double std, double min, double max);  // +-inf allowed
  static Distribution uniform(double min, double max);
  static Distribution log_normal(double log_mean, double log_std);  // of ln x
  static Distribution log_uniform(double min, double max);          // both > 0
  static Distribution triangular(double min, double mode, double max);
  /// Index 0 … n-1 (Eq. 15: uniform over the choices unless weights are given).
  static Distribution choice(int n, std::vector<double> weights = {});
  /// The values themselves, equally likely, sorted: quantile(u) interpolates between order statistics.
  static Distribution empirical(std::vector<double> values);

  /// x with P(X <= x) = u, u in (0,1).
  double quantile(double u) const;
  /// Shifted by `offset` (a jitter about a persistent value, Eq. 14).
  double mean() const;
  double std() const;
  double median() const { return quantile(0.5); }
  /// Smallest and largest value that can be drawn in practice: quantiles of kSmallestUniform and kLargestUniform.
  double lowest() const;
  double highest() const;
  bool is_constant() const;
  /// One line for tables and archives, e.g. "normal(mean=0.1, std=0.0025)".
  std::string describe() const;

 private:
  enum class Kind {
    constant,
    normal,
    truncated_normal,
    uniform,
    log_normal,
    log_uniform,
    triangular,
    choice,
    empirical
  };
  Kind kind_ = Kind::constant;
  double a_ = 0, b_ = 0, c_ = 0, d_ = 0;  // parameters in the order of the factory's arguments
  double low_ = 0, span_ = 0;             // truncated normal: CDF at min, CDF(max) - CDF(min)
  std::vector<double> table_;             // choice: cumulative weights; empirical: sorted values
};

}  // namespace graze
