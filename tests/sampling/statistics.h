#pragma once
// What the statistical tests of this folder share. Seeds are fixed, so a test passes always or never; the false-alarm
// rate stated with each is the chance that an arbitrary seed would have failed a correct generator.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "sampling/design.h"
#include "sampling/distribution.h"

namespace graze {

/// One of every kind that varies, with odd numbers.
inline std::vector<Distribution> sample_distributions() {
  return {Distribution::normal(0.1, 0.0025),
          Distribution::truncated_normal(0.005, 0.001, 0, 1),
          Distribution::truncated_normal(-3, 1.7, -2.5, 40),
          Distribution::truncated_normal(0, 1, 35, 36),
          Distribution::truncated_normal(0, 1, -36, -35),
          Distribution::uniform(1000, 1200),
          Distribution::log_normal(-2, 0.3),
          Distribution::log_uniform(1e-3, 10),
          Distribution::triangular(-1, 0.5, 1),
          Distribution::choice(5, {1, 2, 3, 4, 0.5}),
          Distribution::empirical({0.3, -1, 2.5, 0.31, 7, 1.5})};
}

/// Parameters p0, p1, … that are uniform in [0, 1].
inline ParameterSpace cube(int dimensions) {
  ParameterSpace space;
  for (int i = 0; i < dimensions; ++i) {
    UncertainParameter p;
    p.name = fmt::format("p{}", i);
    p.persistent = Distribution::uniform(0, 1);
    space.parameters.push_back(p);
  }
  return space;
}

/// Kolmogorov-Smirnov distance of samples from U(0,1), times sqrt(n).
inline double ks_statistic(std::vector<double> u) {
  std::sort(u.begin(), u.end());
  const double n = static_cast<double>(u.size());
  double distance = 0;
  for (std::size_t i = 0; i < u.size(); ++i) distance = std::max({distance, u[i] - i / n, (i + 1) / n - u[i]});
  return distance * std::sqrt(n);
}

/// The value that sqrt(n) D exceeds with probability alpha: leading term 2 exp(-2 x^2) of Kolmogorov's law, whose next
/// term is -2 exp(-8 x^2).
inline double ks_limit(double alpha) { return std::sqrt(-0.5 * std::log(alpha / 2)); }

inline double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) ma += a[i] / n, mb += b[i] / n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb), aa += (a[i] - ma) * (a[i] - ma), bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

inline std::vector<double> ranks(const std::vector<double>& x) {
  std::vector<std::size_t> order(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  std::vector<double> rank(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) rank[order[i]] = static_cast<double>(i);
  return rank;
}

}  // namespace graze
