// Mean and variance of every distribution, for tables; closed forms but for the truncated normal.

#include <boost/math/quadrature/gauss.hpp>
#include <cassert>
#include <cmath>

#include "sampling/distribution.h"
#include "sampling/elementary.h"

namespace graze {
namespace {

using Moments = std::pair<double, double>;

// Standard normal restricted to [low, high], by composite Gauss quadrature of the density about the point c of the
// interval that is nearest to 0: exp(-(c+t)^2/2) is proportional to exp(-t (t + 2c) / 2). The closed form with
// phi(low) - phi(high) cancels in the tails and underflows beyond z = 38; this does neither. The density is cut where
// it has fallen by exp(-40).
Moments truncated_moments(double low, double high) {
  const double c = low > 0 ? low : high < 0 ? high : 0.0;
  const double reach = 80.0 / (std::abs(c) + std::sqrt(c * c + 80.0));
  const double first = std::max(low - c, c > 0 ? 0.0 : -reach), last = std::min(high - c, c < 0 ? 0.0 : reach);
  constexpr int kPanels = 16;
  const double width = (last - first) / kPanels;
  const auto integrate = [&](auto&& f) {
    double sum = 0;
    for (int i = 0; i < kPanels; ++i) {
      const double begin = first + i * width;
      sum += width * boost::math::quadrature::gauss<double, 20>::integrate(
                         [&](double s) {
                           const double t = begin + width * s;
                           return pinned::exp(-0.5 * t * (t + 2.0 * c)) * f(t);
                         },
                         0.0, 1.0);
    }
    return sum;
  };
  const double mass = integrate([](double) { return 1.0; });
  const double m = integrate([](double t) { return t; }) / mass;
  const double variance = integrate([&](double t) { return (t - m) * (t - m); }) / mass;
  return {c + m, variance};
}

// `values` empty: the indices themselves.
Moments choice_moments(const std::vector<double>& cumulative, const std::vector<double>& values) {
  const auto value = [&](std::size_t i) { return values.empty() ? static_cast<double>(i) : values[i]; };
  const auto weight = [&](std::size_t i) { return cumulative[i] - (i > 0 ? cumulative[i - 1] : 0.0); };
  double mean = 0, variance = 0;
  for (std::size_t i = 0; i < cumulative.size(); ++i) mean += weight(i) * value(i);
  for (std::size_t i = 0; i < cumulative.size(); ++i) variance += weight(i) * (value(i) - mean) * (value(i) - mean);
  return {mean, variance};
}

// Of the piecewise linear quantile function: half a cell at either end, straight lines between the values. Over a line
// from a to b the mean square is (a^2 + a b + b^2) / 3.
Moments empirical_moments(const std::vector<double>& x) {
  const double n = static_cast<double>(x.size());
  double mean = 0;
  for (const double v : x) mean += v / n;
  const auto square = [&](double a, double b) {
    a -= mean, b -= mean;
    return (a * a + a * b + b * b) / 3.0;
  };
  double variance = 0.5 * (square(x.front(), x.front()) + square(x.back(), x.back()));
  for (std::size_t i = 1; i < x.size(); ++i) variance += square(x[i - 1], x[i]);
  return {mean, variance / n};
}

Moments log_normal_moments(double log_mean, double log_std) {
  const double s2 = log_std * log_std, mean = pinned::exp(log_mean + 0.5 * s2);
  return {mean, mean * mean * 2.0 * pinned::exp(0.5 * s2) * pinned::sinh(0.5 * s2)};  // 2 e^(s/2) sinh(s/2) = e^s - 1
}

// E x = (b - a) / L, E x^2 = (b^2 - a^2) / (2 L) with L = ln(b/a); about the mean, in r = L/2:
// Var / (a b) = sinh(r) (r cosh(r) - sinh(r)) / r^2, the bracket by its series r^3/3 + r^5/30 while r is small.
Moments log_uniform_moments(double a, double b) {
  const double r = 0.5 * (pinned::log(b) - pinned::log(a));
  if (r == 0) return {a, 0};
  const double sinh = pinned::sinh(r), cosh = sinh + pinned::exp(-r);
  const double bracket = r < 1e-2 ? r * r * r * (1.0 / 3.0 + r * r / 30.0 + r * r * r * r / 840.0) : r * cosh - sinh;
  const double middle = std::sqrt(a) * std::sqrt(b);
  return {middle * sinh / r, middle * middle * sinh * bracket / (r * r)};
}

}  // namespace

Moments Distribution::moments() const {
  switch (kind_) {
    case Kind::constant:
      return {a_, 0.0};
    case Kind::normal:
      return {a_, b_ * b_};
    case Kind::truncated_normal: {
      if (b_ == 0) return {a_, 0.0};
      const auto [m, v] = truncated_moments((c_ - a_) / b_, (d_ - a_) / b_);
      return {a_ + b_ * m, b_ * b_ * v};
    }
    case Kind::uniform:
      return {0.5 * a_ + 0.5 * b_, (b_ - a_) * (b_ - a_) / 12.0};
    case Kind::log_normal:
      return log_normal_moments(a_, b_);
    case Kind::log_uniform:
      return log_uniform_moments(a_, b_);
    case Kind::triangular: {
      const double p = b_ - a_, q = c_ - b_;  // variance (p^2 + p q + q^2) / 18
      return {(a_ + b_ + c_) / 3.0, (p * p + p * q + q * q) / 18.0};
    }
    case Kind::choice:
      return choice_moments(table_, values_);
    case Kind::empirical:
      return empirical_moments(table_);
  }
  assert(false);
  return {};
}

}  // namespace graze
