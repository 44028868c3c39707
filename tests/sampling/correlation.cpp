#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
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
