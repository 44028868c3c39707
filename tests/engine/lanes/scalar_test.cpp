// Sine, cosine, arctangent and length of one number are the lanes' bits, err by less than their header says, and stay
// in range where arguments are no longer angles.
#include "engine/lanes/scalar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sampling/constants.h"
#include "tests/ulps.h"

namespace graze {
namespace {

using test::ulps;
using test::worst_ulps;

TEST(ScalarFunctions, SineAndCosineErrByLessThanTwoUlp) {
  for (const double range : {1.0, 10.0, 1e5}) {
    EXPECT_LT(worst_ulps(pinned::sin, sinl, -range, range), 2.0) << range;
    EXPECT_LT(worst_ulps(pinned::cos, cosl, -range, range), 2.0) << range;
  }
  EXPECT_EQ(pinned::sin(0.0), 0.0);
  EXPECT_EQ(pinned::cos(0.0), 1.0);
}

TEST(ScalarFunctions, SineAndCosineOfManyTurnsAreNearAndInRange) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> power(5, 9), beyond(9, 308);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::pow(10, power(random));
    EXPECT_NEAR(pinned::sin(x), static_cast<double>(sinl(x)), 4e-16) << x;
    EXPECT_NEAR(pinned::cos(x), static_cast<double>(cosl(x)), 4e-16) << x;
    const auto [s, c] = pinned::sin_cos(-std::pow(10, beyond(random)));
    EXPECT_NEAR(s * s + c * c, 1, 1e-15);
  }
  EXPECT_TRUE(std::isnan(pinned::sin(kInfinity)));
  EXPECT_TRUE(std::isnan(pinned::cos(std::nan(""))));
}

TEST(ScalarFunctions, ArctangentAndArccosineErrByLessThanFourUlp) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1), power(-100, 100);
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const double scale = std::pow(10, power(random)), y = uniform(random) * scale, x = uniform(random) * scale;
    worst = std::fmax(worst, ulps(pinned::atan2(y, x), atan2l(y, x)));
  }
  EXPECT_LT(worst, 4.0);
  EXPECT_LT(worst_ulps(pinned::acos, acosl, -1, 1), 4.0);
  EXPECT_EQ(pinned::acos(1.0), 0.0);
  EXPECT_TRUE(std::isnan(pinned::acos(1.5)));
}

TEST(ScalarFunctions, LengthErrsByLessThanTwoUlp) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1), power(-300, 300);
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const double scale = std::pow(10, power(random)), x = uniform(random) * scale, y = uniform(random) * scale;
    worst = std::fmax(worst, ulps(pinned::hypot(x, y), hypotl(x, y)));
  }
  EXPECT_LT(worst, 2.0);
  EXPECT_EQ(pinned::hypot(3, -4), 5.0);
  EXPECT_EQ(pinned::hypot(0, 0), 0.0);
  EXPECT_EQ(pinned::hypot(1e308, 0), 1e308);
  EXPECT_EQ(pinned::hypot(kInfinity, 1), kInfinity);
  EXPECT_TRUE(std::isnan(pinned::hypot(1, std::nan(""))));
  EXPECT_TRUE(std::isnan(pinned::hypot(std::nan(""), 1)));
}

}  // namespace
}  // namespace graze
