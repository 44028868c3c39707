#include "analysis/significance.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>
#include <numeric>

namespace graze {
namespace {

double log_choose(double n, double k) { return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1); }

/// Calls take(k, P(both = k)) for all tables with the margins of this one.
template <class Take>
void for_each_table(const FourfoldTable& table, const Take& take) {
  const std::uint64_t with_a = table.both + table.only_a, with_b = table.both + table.only_b;
  const std::uint64_t n = with_a + table.only_b + table.neither;
  const std::uint64_t least = with_a + with_b > n ? with_a + with_b - n : 0, most = std::min(with_a, with_b);
  const auto a = static_cast<double>(with_a), b = static_cast<double>(with_b), all = static_cast<double>(n);
  for (std::uint64_t k = least; k <= most; ++k) {
    const auto both = static_cast<double>(k);
    take(k, std::exp(log_choose(a, both) + log_choose(all - a, b - both) - log_choose(all, b)));
  }
}

/// Cumulant generating function of the sum of weights Z^2, and its first two derivatives, at t < 1 / (2 max weight).
struct Cumulants {
  double value = 0, first = 0, second = 0;
};
Cumulants cumulants(double t, std::span<const double> weights) {
  Cumulants out;
  for (const double w : weights) {
    const double rest = 1 - 2 * w * t, ratio = w / rest;
    out.value -= 0.5 * std::log(rest);
    out.first += ratio;
    out.second += 2 * ratio * ratio;
  }
  return out;
}

/// The t at which the first derivative is x > 0; it rises from 0 to infinity.
double saddle_point(double x, std::span<const double> weights) {
  const double largest = *std::max_element(weights.begin(), weights.end());
  double high = 0.5 / largest, low = -static_cast<double>(weights.size()) / (2 * x) - 1 / largest;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (cumulants(middle, weights).first < x ? low : high) = middle;
  }
  return low;
}

}  // namespace

double two_sided_normal(double z) { return boost::math::erfc(std::abs(z) / std::sqrt(2.0)); }

double two_sided_student(double t, double freedom) {
  const double square = t * t;
  return std::isinf(square) ? 0.0 : boost::math::ibeta(freedom / 2, 0.5, freedom / (freedom + square));
}

double upper_chi_square(double x, double freedom) {
  return x <= 0 ? 1.0 : std::isinf(x) ? 0.0 : boost::math::gamma_q(freedom / 2, x / 2);
}

double fisher_two_sided(const FourfoldTable& table) {
  double here = 0, sum = 0;
  for_each_table(table, [&](std::uint64_t k, double p) { here = k == table.both ? p : here; });
  // Tables that are as likely as this one differ from it by rounding.
  for_each_table(table, [&](std::uint64_t, double p) { sum += p <= here * (1 + 1e-7) ? p : 0; });
  return std::min(sum, 1.0);
}

double fisher_upper(const FourfoldTable& table) {
  double sum = 0;
  for_each_table(table, [&](std::uint64_t k, double p) { sum += k >= table.both ? p : 0; });
  return std::min(sum, 1.0);
}

double upper_weighted_chi_square(double x, std::span<const double> weights) {
  if (weights.empty() || x <= 0) return 1;
  const double mean = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double t = saddle_point(x, weights);
  const Cumulants at = cumulants(t, weights);
  const double u = t * std::sqrt(at.second);
  const double squared = 2 * (t * x - at.value);
  const double r = std::copysign(std::sqrt(std::max(squared, 0.0)), t);
  // At the mean the formula is 0/0: go past it by so little that nobody can tell.
  if (std::abs(r) < 1e-4 || std::abs(u) < 1e-4) return upper_weighted_chi_square(mean * 1.001, weights);
  const double tail = 0.5 * boost::math::erfc(r / std::sqrt(2.0));
  const double density = std::exp(-0.5 * r * r) / std::sqrt(2 * std::acos(-1.0));
  return std::clamp(tail + density * (1 / u - 1 / r), 0.0, 1.0);
}

std::vector<double> holm(std::span<const double> p_values) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p_values.size(); ++i) {
    if (!std::isnan(p_values[i])) order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return p_values[a] != p_values[b] ? p_values[a] < p_values[b] : a < b;
  });
  std::vector<double> out(p_values.size(), std::numeric_limits<double>::quiet_NaN());
  double most = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    most = std::max(most, std::min(1.0, static_cast<double>(order.size() - i) * p_values[order[i]]));
    out[order[i]] = most;
  }
  return out;
}

}  // namespace graze
