// The project's own exponentials, logarithms and error function err by less than their header says, and end where the
// range of a double ends.
#include "sampling/elementary.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sampling/constants.h"
#include "tests/ulps.h"

namespace graze {
namespace {

using test::ulps;
using test::worst_ulps;

double of_e(double u) { return std::exp(u); }
double minus_of_e(double u) { return -std::exp(u); }

TEST(Elementary, ExponentialErrsByLessThanOneUlp) {
  EXPECT_LT(worst_ulps(pinned::exp, expl, -1, 1), 1.0);
  EXPECT_LT(worst_ulps(pinned::exp, expl, -708, 709.7), 1.0);
  EXPECT_LT(worst_ulps(pinned::exp, expl, -30, 0, of_e), 1.0);
  EXPECT_EQ(pinned::exp(0.0), 1.0);
  EXPECT_EQ(pinned::exp(-745.1), 5e-324);
  EXPECT_EQ(pinned::exp(-746), 0.0);
  EXPECT_EQ(pinned::exp(-kInfinity), 0.0);
  EXPECT_TRUE(std::isfinite(pinned::exp(709.78)));
  EXPECT_EQ(pinned::exp(709.785), kInfinity);
  EXPECT_EQ(pinned::exp(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(pinned::exp(kNaN)));
}

TEST(Elementary, LogarithmErrsByLessThanOneUlp) {
  EXPECT_LT(worst_ulps(pinned::log, logl, 0.5, 2), 1.0);
  EXPECT_LT(worst_ulps(pinned::log, logl, -744, 709, of_e), 1.0);
  EXPECT_EQ(pinned::log(1.0), 0.0);
  for (const double x : {5e-324, 1e-310, 1.7e308}) EXPECT_LT(ulps(pinned::log(x), logl(x)), 1.0) << x;
  EXPECT_EQ(pinned::log(0.0), -kInfinity);
  EXPECT_EQ(pinned::log(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(pinned::log(-1.0)));
  EXPECT_TRUE(std::isnan(pinned::log(kNaN)));
}

TEST(Elementary, LogarithmOfOneAndMoreErrsByLessThanThreeUlp) {
  EXPECT_LT(worst_ulps(pinned::log1p, log1pl, -0.999999, 3), 3.0);
  EXPECT_LT(worst_ulps(pinned::log1p, log1pl, -50, 700, of_e), 3.0);
  EXPECT_LT(worst_ulps(pinned::log1p, log1pl, -50, -0.1, minus_of_e), 3.0);
  EXPECT_EQ(pinned::log1p(0.0), 0.0);
  EXPECT_EQ(pinned::log1p(-1.0), -kInfinity);
  EXPECT_EQ(pinned::log1p(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(pinned::log1p(-1.5)));
}

TEST(Elementary, HyperbolicSineErrsByLessThanThreeUlp) {
  EXPECT_LT(worst_ulps(pinned::sinh, sinhl, -3, 3), 3.0);
  EXPECT_LT(worst_ulps(pinned::sinh, sinhl, -50, 6.5, of_e), 3.0);
  EXPECT_LT(worst_ulps(pinned::sinh, sinhl, -50, 6.5, minus_of_e), 3.0);
  EXPECT_EQ(pinned::sinh(0.0), 0.0);
}

TEST(Elementary, ErrorFunctionErrsByLessThanEightUlp) {
  EXPECT_LT(worst_ulps(pinned::erfc, erfcl, -6, 1), 8.0);
  EXPECT_LT(worst_ulps(pinned::erfc, erfcl, 0, 3), 8.0);
  EXPECT_LT(worst_ulps(pinned::erfc, erfcl, 2, 26.5), 8.0);
  EXPECT_LT(worst_ulps(pinned::erfc, erfcl, -40, 0, of_e), 8.0);
  EXPECT_NEAR(pinned::erfc(27.2), 9.9e-324, 1e-323);
  EXPECT_EQ(pinned::erfc(30.0), 0.0);
  EXPECT_EQ(pinned::erfc(kInfinity), 0.0);
  EXPECT_EQ(pinned::erfc(-kInfinity), 2.0);
  EXPECT_TRUE(std::isnan(pinned::erfc(kNaN)));
}

}  // namespace
}  // namespace graze
