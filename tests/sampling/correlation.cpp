#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "sampling/copula.h"
#include "sampling/design.h"
#include "tests/sampling/statistics.h"

namespace graze {
namespace {

ParameterSpace four() {
  ParameterSpace space;
  const std::vector<Distribution> distributions = {Distribution::normal(1, 0.1), Distribution::log_normal(0, 1),
                                                   Distribution::uniform(2, 3), Distribution::triangular(0, 0, 1)};
  for (std::size_t i = 0; i < distributions.size(); ++i) {
    UncertainParameter p;
    p.name = std::string(1, static_cast<char>('a' + i));
    p.persistent = distributions[i];
    space.parameters.push_back(p);
  }
  return space;
}

Eigen::MatrixXd matrix3(double ab, double ac, double bc) {
  Eigen::MatrixXd c(3, 3);
  c << 1, ab, ac, ab, 1, bc, ac, bc, 1;
  return c;
}

ParameterSpace correlated() {
  ParameterSpace space = four();
  space.groups.push_back({{3, 0, 1}, matrix3(0.8, -0.5, -0.3)});  // order of members need not be the space's
  return space;
}

// Claim: rank correlations of a group are those of a Gaussian copula, (6 / pi) asin(rho / 2), whatever the marginals
// and the design; parameters outside stay uncorrelated. Standard error <= 1/sqrt(n); 5 sigma, 18 comparisons: 1e-5.
TEST(Copula, RankCorrelation) {
  constexpr int kCount = 20000;
  Eigen::MatrixXd expected = Eigen::MatrixXd::Identity(4, 4);
  const auto set = [&](int i, int j, double rho) { expected(i, j) = expected(j, i) = 6 / M_PI * std::asin(rho / 2); };
  set(3, 0, 0.8), set(3, 1, -0.5), set(0, 1, -0.3);
  for (const Design design : {Design::random, Design::latin_hypercube, Design::sobol}) {
    const Sampler sampler(correlated(), design, 21, kCount);
    std::vector<std::vector<double>> columns(4);
    for (int i = 0; i < kCount; ++i) {
      const auto values = sampler.draw(i);
      for (int k = 0; k < 4; ++k) columns[k].push_back(values[k]);
    }
    for (auto& column : columns) column = ranks(column);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j)
        EXPECT_NEAR(correlation(columns[i], columns[j]), expected(i, j), 5 / std::sqrt(kCount)) << i << ' ' << j;
  }
}

// Claim: the copula leaves every marginal as it was: values turn back into uniforms by their own CDF. KS, 2 tests at
// 1e-4.
TEST(Copula, KeepsMarginals) {
  const Sampler sampler(correlated(), Design::random, 22, 0);
  std::vector<double> normal, log_normal;
  for (int i = 0; i < 20000; ++i) {
    const auto values = sampler.draw(i);
    normal.push_back(normal_cdf((values[0] - 1) / 0.1));
    log_normal.push_back(normal_cdf(std::log(values[1])));
  }
  EXPECT_LT(ks_statistic(normal), ks_limit(1e-4));
  EXPECT_LT(ks_statistic(log_normal), ks_limit(1e-4));
}

// Claim: correlating touches the group's later members only.
TEST(Copula, TouchesItsMembersOnly) {
  const Sampler plain(four(), Design::random, 23, 0), joined(correlated(), Design::random, 23, 0);
  for (int i = 0; i < 20; ++i) {
    const auto a = plain.draw(i), b = joined.draw(i);
    EXPECT_EQ(a[2], b[2]);
    EXPECT_EQ(a[3], b[3]);  // first member of the group
    EXPECT_NE(a[0], b[0]);
    EXPECT_NE(a[1], b[1]);
  }
}

// Claim: the factor reproduces the matrix: every entry of L L^T to 3 rounding errors of sums of 3 products <= 1.
TEST(Copula, FactorReproducesMatrix) {
  Eigen::MatrixXd factor;
  const Eigen::MatrixXd c = matrix3(0.8, -0.5, -0.3);
  EXPECT_EQ(correlation_factor(c, factor), -1);
  EXPECT_LT((factor * factor.transpose() - c).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(correlation_factor(matrix3(0.9, 0.9, -0.9), factor), 2);
  EXPECT_EQ(correlation_factor(matrix3(1, 0, 0), factor), 1);
}

ParameterSpace correlated_cube() {
  ParameterSpace space = correlated();
  for (auto& parameter : space.parameters) parameter.persistent = Distribution::uniform(0, 1);
  return space;
}

/// Columns of the particles' values, in the order of the parameters.
std::vector<std::vector<double>> columns_of(const Sampler& sampler, int count) {
  std::vector<std::vector<double>> columns(sampler.space().size());
  for (int i = 0; i < count; ++i) {
    const auto values = sampler.draw(i);
    for (std::size_t k = 0; k < values.size(); ++k) columns[k].push_back(values[k]);
  }
  return columns;
}

// Claim: correlated or not, every parameter of a Latin hypercube has exactly one particle in each of its N cells. The
// first member and the parameter outside keep the values that they have without the group.
TEST(CorrelatedLatinHypercube, OneParticlePerCell) {
  for (const int count : {1, 2, 7, 64, 1000}) {
    const auto columns = columns_of(Sampler(correlated_cube(), Design::latin_hypercube, 9, count), count);
    for (const auto& column : columns) {
      std::vector<int> hits(count, 0);
      for (const double x : column) ++hits[static_cast<int>(x * count)];
      EXPECT_EQ(hits, std::vector<int>(count, 1)) << count;
    }
    ParameterSpace plain = correlated_cube();
    plain.groups.clear();
    const auto before = columns_of(Sampler(plain, Design::latin_hypercube, 9, count), count);
    EXPECT_EQ(columns[3], before[3]);
    EXPECT_EQ(columns[2], before[2]);
  }
}

// Claim: over seeds each particle of a correlated member is uniform, within its cell and over the cells; KS over 3000
// seeds, 2 x 2 tests at 1e-4. The latent correlations of 64 particles average to those of the matrix less what the
// place within the cells takes, which is below 3 / 64; their standard error over 200 seeds is 0.01, 5 sigma: 0.05.
TEST(CorrelatedLatinHypercube, IsUniformAndCorrelatedOverSeeds) {
  std::vector<double> at[2], within[2];
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    const auto values = Sampler(correlated_cube(), Design::latin_hypercube, seed, 7).draw(2);
    for (int k = 0; k < 2; ++k) {
      at[k].push_back(values[k]);
      within[k].push_back(std::fmod(values[k] * 7, 1.0));
    }
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(ks_statistic(at[k]), ks_limit(1e-4));
    EXPECT_LT(ks_statistic(within[k]), ks_limit(1e-4));
  }
  double mean[3] = {};
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    auto columns = columns_of(Sampler(correlated_cube(), Design::latin_hypercube, seed, 64), 64);
    for (auto& column : columns) std::transform(column.begin(), column.end(), column.begin(), normal_quantile);
    mean[0] += correlation(columns[3], columns[0]) / 200;
    mean[1] += correlation(columns[3], columns[1]) / 200;
    mean[2] += correlation(columns[0], columns[1]) / 200;
  }
  const double wanted[] = {0.8, -0.5, -0.3};
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(mean[k], wanted[k], 0.05) << k;
}

// Claim: what the design is for: the mean over a correlated member errs by less than a tenth of what independent draws
// err by, whose standard deviation is 1 / sqrt(12 N). Over 200 seeds the ratio of variances is known to 10 %.
TEST(CorrelatedLatinHypercube, MeansOfLaterMembersAreStratified) {
  double square = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto columns = columns_of(Sampler(correlated_cube(), Design::latin_hypercube, seed, 50), 50);
    const double mean = std::accumulate(columns[1].begin(), columns[1].end(), 0.0) / 50;
    square += (mean - 0.5) * (mean - 0.5) / 200;
  }
  EXPECT_LT(std::sqrt(square), 0.1 / std::sqrt(12 * 50.0));
}

// Claim: more than can be ranked is refused with what else would do.
TEST(CorrelatedLatinHypercube, RefusesWhatItCannotRank) {
  try {
    Sampler(correlated_cube(), Design::latin_hypercube, 1, 1u << 25);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("33554432 particles with 3 correlated parameters (d, …)"));
    EXPECT_THAT(e.what(), testing::HasSubstr("use sobol or random"));
  }
}

std::string refusal(const ParameterSpace& space) {
  try {
    space.validate();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "accepted";
}

ParameterSpace with(std::vector<int> members, Eigen::MatrixXd correlation) {
  ParameterSpace space = four();
  space.groups.push_back({std::move(members), std::move(correlation)});
  return space;
}

// Claim: a matrix that is no correlation matrix is refused in words that name the entry or the leading minor, and the
// remedy that is offered works: scaled by it the matrix is accepted.
TEST(ParameterSpace, RefusesWrongMatrices) {
  using testing::HasSubstr;
  EXPECT_EQ(refusal(correlated()), "accepted");
  EXPECT_THAT(refusal(with({0, 1, 2}, matrix3(0.9, 0.9, -0.9))),
              testing::AllOf(HasSubstr("leading minor of order 3 (a, b, c) is not positive"), HasSubstr("by 0.55 or")));
  EXPECT_EQ(refusal(with({0, 1, 2}, matrix3(0.9 * 0.55, 0.9 * 0.55, -0.9 * 0.55))), "accepted");
  EXPECT_THAT(refusal(with({0, 1, 2}, matrix3(1, 0, 0))), HasSubstr("order 2 (a, b)"));
  EXPECT_THAT(refusal(with({0, 1, 2}, matrix3(1.5, 0, 0))),
              HasSubstr("correlation of b and a is 1.5; it must lie in [-1, 1]"));
  EXPECT_THAT(refusal(with({0, 1, 2}, matrix3(std::nan(""), 0, 0))), HasSubstr("must lie in [-1, 1]"));
  Eigen::MatrixXd c = matrix3(0.1, 0.2, 0.3);
  c(0, 2) = 0.4;
  EXPECT_THAT(refusal(with({0, 1, 2}, c)), HasSubstr("must be symmetric"));
  c = matrix3(0.1, 0.2, 0.3);
  c(1, 1) = 2;
  EXPECT_THAT(refusal(with({0, 1, 2}, c)), HasSubstr("correlation of b with itself is 2"));
  EXPECT_THAT(refusal(with({0, 1}, c)), HasSubstr("3 x 3 for 2 parameters"));
}

// Claim: wrong members are refused by name, and so is a name that is given twice.
TEST(ParameterSpace, RefusesWrongMembers) {
  using testing::HasSubstr;
  const Eigen::MatrixXd pair = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_THAT(refusal(with({0, 4}, pair)), HasSubstr("does not exist"));
  EXPECT_THAT(refusal(with({0, 0}, pair)), HasSubstr("a stands twice"));
  ParameterSpace space = correlated();
  space.groups.push_back({{2, 1}, pair});
  EXPECT_THAT(refusal(space), HasSubstr("b is in two correlation groups"));
  space = with({0, 1}, pair);
  space.parameters[1].persistent = Distribution::choice(2);
  EXPECT_THAT(refusal(space), HasSubstr("b is a choice"));
  space = four();
  space.parameters[3].name = "a";
  EXPECT_THAT(refusal(space), HasSubstr("a is given twice"));
  EXPECT_THROW(Sampler(space, Design::random, 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace graze
