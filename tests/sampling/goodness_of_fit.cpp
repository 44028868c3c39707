// Draws of every distribution against a CDF that was not used to make them.

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/lognormal.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/triangular.hpp>
#include <cmath>
#include <functional>
#include <string>

#include "sampling/distribution.h"
#include "sampling/stream.h"
#include "tests/sampling/statistics.h"

namespace graze {
namespace {

struct Fit {
  std::string name;
  Distribution distribution;
  std::function<double(double)> cdf;
};

// Phi(x) in the tail where it is small.
double between(double low, double x, double high) {
  const auto tail = [](double z) { return std::erfc(z / std::sqrt(2.0)); };
  return (tail(low) - tail(x)) / (tail(low) - tail(high));
}

std::vector<Fit> fits() {
  using boost::math::cdf;
  return {
      {"normal", Distribution::normal(0.1, 0.0025), [](double x) { return cdf(boost::math::normal(0.1, 0.0025), x); }},
      {"truncated", Distribution::truncated_normal(5, 2, 4, 12),
       [](double x) { return between(-0.5, (x - 5) / 2, 3.5); }},
      {"truncated tail", Distribution::truncated_normal(0, 1, 35, 36), [](double x) { return between(35, x, 36); }},
      {"uniform", Distribution::uniform(-1, 3), [](double x) { return (x + 1) / 4; }},
      {"log-normal", Distribution::log_normal(-2, 0.3),
       [](double x) { return cdf(boost::math::lognormal(-2, 0.3), x); }},
      {"log-uniform", Distribution::log_uniform(0.01, 10),
       [](double x) { return std::log(x / 0.01) / std::log(1000); }},
      {"triangular", Distribution::triangular(-1, 0.5, 1),
       [](double x) { return cdf(boost::math::triangular(-1, 0.5, 1), x); }},
      // Order statistics 0, 1, 4 stand at u = 1/6, 1/2, 5/6; a third of the mass lies on the end points, where any CDF
      // value of the jump may be taken: a Kolmogorov-Smirnov test is then conservative only within [1/6, 5/6].
      {"empirical", Distribution::empirical({4, 0, 1}),
       [](double x) { return x < 1 ? 1.0 / 6 + x / 3 : 0.5 + (x - 1) / 9; }},
  };
}

// Claim: draws of every continuous distribution follow its CDF. Kolmogorov-Smirnov on 20,000 draws, 8 tests at 1e-4
// each: false alarms 8e-4. Where the CDF jumps, draws are compared on the continuous part alone.
TEST(GoodnessOfFit, KolmogorovSmirnov) {
  for (const auto& fit : fits()) {
    const double low = fit.cdf(fit.distribution.lowest()), high = fit.cdf(fit.distribution.highest());
    std::vector<double> u;
    for (std::uint32_t i = 0; i < 20000; ++i) {
      const double x = fit.distribution.quantile(uniform(11, i, name_hash(fit.name), kPersistent));
      if (x > fit.distribution.lowest() && x < fit.distribution.highest())
        u.push_back((fit.cdf(x) - low) / (high - low));
    }
    EXPECT_GT(u.size(), 12000u) << fit.name;
    EXPECT_LT(ks_statistic(u), ks_limit(1e-4)) << fit.name;
  }
}

// Claim: the ends of an empirical distribution carry half a value's share each: 1/(2n). Binomial, 4.5 sigma: 1.4e-5.
TEST(GoodnessOfFit, EmpiricalEnds) {
  const auto d = Distribution::empirical({4, 0, 1});
  int low = 0, high = 0;
  constexpr int kDraws = 20000;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const double x = d.quantile(uniform(12, i, name_hash("ends"), kPersistent));
    low += x == 0, high += x == 4;
  }
  const double sigma = std::sqrt(kDraws * (1.0 / 6) * (5.0 / 6));
  EXPECT_NEAR(low, kDraws / 6.0, 4.5 * sigma);
  EXPECT_NEAR(high, kDraws / 6.0, 4.5 * sigma);
}

// Claim: choices come in the proportion of their weights. Chi-square, 3 degrees of freedom, at 1e-4.
TEST(GoodnessOfFit, Choice) {
  const std::vector<double> weights = {1, 2, 3, 4};
  const auto d = Distribution::choice(4, weights);
  std::vector<double> counts(4, 0.0);
  for (std::uint32_t i = 0; i < 20000; ++i)
    ++counts[static_cast<int>(d.quantile(uniform(13, i, name_hash("choice"), kPersistent)))];
  double chi = 0;
  for (int k = 0; k < 4; ++k) chi += std::pow(counts[k] - 2000 * weights[k], 2) / (2000 * weights[k]);
  EXPECT_LT(chi, quantile(complement(boost::math::chi_squared(3), 1e-4)));
}

}  // namespace
}  // namespace graze
