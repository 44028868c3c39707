// Claim: exponentials of lanes are as near to the true ones as their header says, and NaN, infinities and zeros come
// out as they should.
#include "engine/network/exponential.h"

#include <gtest/gtest.h>

#include "tests/ulps.h"

namespace graze {
namespace {

using test::worst_ulps;

long double true_sigmoid(long double x) { return 1 / (1 + std::exp(-x)); }
long double true_softplus(long double x) { return x > 0 ? x + std::log1p(std::exp(-x)) : std::log1p(std::exp(x)); }

TEST(Exponentials, AreNear) {
  const auto exp_of = [](double x) { return exponential(x); };
  const auto less_one = [](double x) { return exponential_less_one(x); };
  const auto tangent = [](double x) { return hyperbolic_tangent(x); };
  const auto logistic_of = [](double x) { return sigmoid(x); };
  const auto softplus_of = [](double x) { return softplus(x); };
  const auto small = [](double u) { return std::copysign(std::exp2(-30 * std::fabs(u)), u); };
  EXPECT_LT(worst_ulps(exp_of, std::exp, -700, 709), 1.0);
  EXPECT_LT(worst_ulps(less_one, std::expm1, -40, 40), 2.0);
  EXPECT_LT(worst_ulps(less_one, std::expm1, -1, 1, small), 2.0);
  EXPECT_LT(worst_ulps(tangent, std::tanh, -25, 25), 3.0);
  EXPECT_LT(worst_ulps(tangent, std::tanh, -1, 1, small), 3.0);
  EXPECT_LT(worst_ulps(logistic_of, true_sigmoid, -700, 40), 3.0);
  EXPECT_LT(worst_ulps(softplus_of, true_softplus, -30, 40), 3.0);
}

TEST(Exponentials, AtTheEnds) {
  const double infinite = INFINITY, none = std::nan("");
  EXPECT_EQ(exponential(0.0), 1);
  EXPECT_EQ(exponential(infinite), infinite);
  EXPECT_LT(exponential(-infinite), 1e-307);
  EXPECT_EQ(exponential_less_one(-infinite), -1);
  EXPECT_EQ(hyperbolic_tangent(infinite), 1);
  EXPECT_EQ(hyperbolic_tangent(-infinite), -1);
  EXPECT_TRUE(std::signbit(hyperbolic_tangent(-0.0)));
  EXPECT_EQ(sigmoid(infinite), 1);
  EXPECT_LT(sigmoid(-infinite), 1e-307);
  EXPECT_EQ(softplus(infinite), infinite);
  for (const double y :
       {exponential(none), exponential_less_one(none), hyperbolic_tangent(none), sigmoid(none), softplus(none)}) {
    EXPECT_TRUE(std::isnan(y));
  }
}

}  // namespace
}  // namespace graze
