#pragma once
// One-dimensional distributions. All are sampled through their quantile function (inverse CDF) from a uniform in (0,1),
// so that random, Latin hypercube and Sobol designs share one path.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace graze {

/// Inverse of the standard normal CDF. Wichura's AS 241 (PPND16), relative error below 1e-15.
double normal_quantile(double u);
/// Standard normal CDF.
double normal_cdf(double z);

class Distribution {
 public:
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
  /// Numbers for code that computes quantiles itself (the sensors' kernels).
  struct Numbers {
    double a, b, c, d;  // parameters in the order of the factory's arguments
    // Truncated normal, unless `far`: probability below min, above max, and between.
    double low, high, span;
    bool far;  // truncated to a tail so far out that these probabilities do not describe it
  };

  // Each throws std::invalid_argument with the violated rule ("std -0.1 is negative; a standard deviation must be >=
  // 0").
  static Distribution constant(double value);
  static Distribution normal(double mean, double std);
  static Distribution truncated_normal(double mean, double std, double min, double max);  // +-inf allowed
  static Distribution uniform(double min, double max);
  static Distribution log_normal(double log_mean, double log_std);  // of ln x
  static Distribution log_uniform(double min, double max);          // both > 0
  static Distribution triangular(double min, double mode, double max);
  /// Index 0 … n-1 (Eq. 15: uniform over the choices unless weights are given; weights need not sum to 1).
  static Distribution choice(int n, std::vector<double> weights = {});
  /// One of these values (Eq. 15 for numbers), weighted as a choice; sorted, so that quantile(u) rises with u.
  static Distribution discrete(const std::vector<double>& values, const std::vector<double>& weights = {});
  /// The values themselves, equally likely, sorted: quantile(u) interpolates between order statistics, value i of n
  /// standing at u = (i - 1/2) / n (type 5 of Hyndman and Fan 1996), so that the mean is the mean of the values.
  static Distribution empirical(std::vector<double> values);

  /// x with P(X <= x) = u, u in (0,1).
  double quantile(double u) const;
  double mean() const;
  double std() const;
  double median() const { return quantile(0.5); }
  /// Smallest and largest value that can be drawn in practice: quantiles of kSmallestUniform and kLargestUniform.
  double lowest() const;
  double highest() const;
  bool is_constant() const;
  Kind kind() const { return kind_; }
  Numbers numbers() const { return {a_, b_, c_, d_, low_, high_, span_, far_ != 0}; }
  /// How many numbers it keeps: values of an empirical one, weights and values of a choice.
  std::size_t kept_numbers() const { return table_.size() + values_.size(); }
  bool is_choice() const { return kind_ == Kind::choice; }
  /// One line for tables and archives, e.g. "normal(mean=0.1, std=0.0025)".
  std::string describe() const;

 private:
  double truncated_quantile(double u) const;
  double empirical_quantile(double u) const;
  std::pair<double, double> moments() const;  // mean and variance

  Kind kind_ = Kind::constant;
  double a_ = 0, b_ = 0, c_ = 0, d_ = 0;  // parameters in the order of the factory's arguments
  // Truncated normal, in standard units: probability below min, above max, and between. Far in a tail (sampling/tail.h)
  // instead: low_ is the distance of the nearer end from the mean, high_ and span_ the probabilities of lying beyond
  // the farther end and between the ends, both given that the nearer one is passed; far_ = +1 or -1 names the tail.
  // Log-uniform: low_ = ln min, span_ = ln max - ln min.
  double low_ = 0, high_ = 0, span_ = 0;
  int far_ = 0;
  std::vector<double> table_;   // choice: cumulative weights; empirical: sorted values
  std::vector<double> values_;  // discrete: ascending, as many as table_; empty for a choice of indices
};

}  // namespace graze
