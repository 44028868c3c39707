#include "sampling/distribution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/triangular.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "sampling/stream.h"
#include "sampling/tail.h"
#include "tests/sampling/statistics.h"

namespace graze {
namespace {

using Wide = boost::multiprecision::cpp_bin_float_50;
constexpr double kInf = std::numeric_limits<double>::infinity();

double relative(double a, double b) { return a == b ? 0 : std::abs(a - b) / std::abs(b); }

// Claim: normal_quantile agrees with Boost.Math's independent algorithm in 50 digits to 1e-15 (AS 241's own claim is
// 1e-16 before rounding; the last operations add a few half-ulps, 1.1e-16 each), from the smallest to the largest
// uniform.
TEST(Normal, QuantileAgreesWithBoostMath) {
  const boost::math::normal_distribution<Wide> reference;
  double worst = 0;
  for (int i = 1; i < 2000; ++i) {
    const double u = i / 2000.0;
    if (u != 0.5) worst = std::max(worst, relative(normal_quantile(u), double(quantile(reference, Wide(u)))));
  }
  for (double u = kSmallestUniform; u < 0.5; u *= 1.37)
    worst = std::max(worst, relative(normal_quantile(u), double(quantile(reference, Wide(u)))));
  worst =
      std::max(worst, relative(normal_quantile(kLargestUniform), double(quantile(reference, Wide(kLargestUniform)))));
  EXPECT_LT(worst, 1e-15);
  EXPECT_EQ(normal_quantile(0.5), 0.0);
}

// Claim: the tails that truncated normals use, down to 1e-300, are as accurate.
TEST(Normal, QuantileHoldsInDeepTails) {
  const boost::math::normal_distribution<Wide> reference;
  for (double u = 1e-17; u > 1e-300; u *= 1e-7)
    EXPECT_LT(relative(normal_quantile(u), double(quantile(reference, Wide(u)))), 1e-15) << u;
}

// Claim: the CDF inverts the quantile. d(cdf) = pdf dz, so one ulp of z = 8 makes a relative error of 8 * 8 * 1.1e-16
// in a tail probability; 64 * 1.1e-16 plus erfc's own few ulp stays below 2e-14.
TEST(Normal, CdfInvertsQuantile) {
  for (double u = kSmallestUniform; u < 0.9; u *= 1.37) EXPECT_LT(relative(normal_cdf(normal_quantile(u)), u), 2e-14);
}

// Q(z) in 50 digits; boost's erfc has the range that double lacks.
Wide upper_tail(Wide z) { return boost::math::erfc(z / sqrt(Wide(2))) / 2; }

// Claim: truncated normals hold their probability in both tails, near, far, and beyond where a double's tail
// probability is 0: the share of the interval's mass that lies between the near end and quantile(u) is u. Compared in
// 50 digits; an error of 4 ulp of the distance from the end is allowed, but not less than 4 ulp of x itself.
TEST(TruncatedNormal, HoldsInFarTails) {
  for (const double low : {0.5, 5.0, 20.0, 29.9, 30.0, 37.0, 45.0, 300.0})
    for (const double width : {0.01, 1.0, kInf})
      for (const double u : {1e-12, 0.1, 0.5, 0.9, 1 - 1e-12}) {
        const auto d = Distribution::truncated_normal(0, 1, low, low + width);
        const double x = d.quantile(u);
        const Wide top = upper_tail(low), bottom = std::isinf(width) ? Wide(0) : upper_tail(low + width);
        const Wide share = (top - upper_tail(x)) / (top - bottom);
        const Wide density = exp(-Wide(x) * x / 2) / sqrt(2 * boost::math::constants::pi<Wide>()) / (top - bottom);
        const double error = double(abs(share - Wide(u)) / density);  // in x
        EXPECT_LT(error, 4 * 2.3e-16 * x) << low << ' ' << width << ' ' << u;
        const auto mirrored = Distribution::truncated_normal(0, 1, -low - width, -low);
        EXPECT_NEAR(mirrored.quantile(1 - u), -d.quantile(1 - (1 - u)), 8 * 2.3e-16 * x) << low << ' ' << width;
      }
}

// Claim: the joint between the two methods at 30 standard deviations is smooth: a millionth to either side of it the
// quantiles differ by a millionth times a factor near 1.
TEST(TruncatedNormal, MethodsMeetAtThirty) {
  const auto near = Distribution::truncated_normal(0, 1, kFarTail - 1e-6, kInf);
  const auto far = Distribution::truncated_normal(0, 1, kFarTail, kInf);
  for (const double u : {0.01, 0.5, 0.99}) EXPECT_NEAR(far.quantile(u) - near.quantile(u), 1e-6, 2e-8);
}

// Claim: a truncation that cuts nothing leaves the normal as it is, and one at the mean leaves the half normal.
TEST(TruncatedNormal, Limits) {
  const auto all = Distribution::truncated_normal(3, 2, -kInf, kInf);
  const auto half = Distribution::truncated_normal(3, 2, 3, kInf);
  for (const double u : {kSmallestUniform, 0.2, 0.5, 0.7, kLargestUniform}) {
    EXPECT_DOUBLE_EQ(all.quantile(u), Distribution::normal(3, 2).quantile(u));
    EXPECT_GE(half.quantile(u), 3.0);
    EXPECT_TRUE(std::isfinite(half.quantile(u)));
  }
  EXPECT_NEAR(half.mean(), 3 + 2 * std::sqrt(2 / M_PI), 1e-14);
  EXPECT_NEAR(half.std(), 2 * std::sqrt(1 - 2 / M_PI), 1e-14);
}

// Claim: closed forms, at points worked out by hand.
TEST(Distribution, ClosedForms) {
  EXPECT_EQ(Distribution::constant(4).quantile(0.3), 4);
  EXPECT_DOUBLE_EQ(Distribution::uniform(-1, 3).quantile(0.25), 0);
  EXPECT_DOUBLE_EQ(Distribution::log_uniform(1, 100).quantile(0.5), 10);
  EXPECT_DOUBLE_EQ(Distribution::log_normal(0, 1).quantile(0.5), 1);
  EXPECT_DOUBLE_EQ(Distribution::log_normal(1, 0.5).quantile(0.8), std::exp(1 + 0.5 * normal_quantile(0.8)));
  const boost::math::triangular_distribution<double> reference(1, 2, 5);
  for (const double u : {0.01, 0.2, 0.25, 0.5, 0.99})
    EXPECT_NEAR(Distribution::triangular(1, 2, 5).quantile(u), quantile(reference, u), 1e-14);
  EXPECT_DOUBLE_EQ(Distribution::triangular(1, 1, 5).quantile(0.75), 3);
  EXPECT_DOUBLE_EQ(Distribution::triangular(1, 5, 5).quantile(0.25), 3);
}

// Claim: a choice takes index i for its share of (0,1), and one without weight never, at either end.
TEST(Distribution, Choice) {
  const auto even = Distribution::choice(3);
  EXPECT_EQ(even.quantile(kSmallestUniform), 0);
  EXPECT_EQ(even.quantile(0.34), 1);
  EXPECT_EQ(even.quantile(kLargestUniform), 2);
  const auto weighted = Distribution::choice(4, {0, 1, 3, 0});
  EXPECT_EQ(weighted.quantile(kSmallestUniform), 1);
  EXPECT_EQ(weighted.quantile(0.2499), 1);
  EXPECT_EQ(weighted.quantile(0.2501), 2);
  EXPECT_EQ(weighted.quantile(kLargestUniform), 2);
  EXPECT_EQ(weighted.describe(), "choice(n=4, p=[0, 0.25, 0.75, 0])");
}

// Claim: a discrete distribution takes each value for its share of (0,1), in ascending order whatever the order given,
// so that lowest() and highest() are the extremes; mean and variance are the weighted sums.
TEST(Distribution, Discrete) {
  const auto d = Distribution::discrete({5, -1, 2}, {1, 1, 2});
  EXPECT_EQ(d.lowest(), -1);
  EXPECT_EQ(d.quantile(0.3), 2);
  EXPECT_EQ(d.quantile(0.7), 2);
  EXPECT_EQ(d.highest(), 5);
  EXPECT_DOUBLE_EQ(d.mean(), (5 - 1 + 2 * 2) / 4.0);
  EXPECT_DOUBLE_EQ(d.std(), std::sqrt((9 + 9 + 0 + 0) / 4.0));
  EXPECT_EQ(d.describe(), "discrete(values=[-1, 2, 5], p=[0.25, 0.5, 0.25])");
  EXPECT_THROW(Distribution::discrete({1, 2}, {1}), std::invalid_argument);
  EXPECT_THROW(Distribution::discrete({}), std::invalid_argument);
}

// Claim: an empirical distribution interpolates between the sorted values, never leaves their range, and has their
// mean.
TEST(Distribution, Empirical) {
  const auto d = Distribution::empirical({5, 1, 2});
  EXPECT_EQ(d.lowest(), 1);
  EXPECT_EQ(d.highest(), 5);
  EXPECT_DOUBLE_EQ(d.quantile(0.5), 2);
  EXPECT_DOUBLE_EQ(d.quantile(1.0 / 3), 1.5);
  EXPECT_DOUBLE_EQ(d.mean(), 8.0 / 3);
  EXPECT_EQ(Distribution::empirical({7}).quantile(0.9), 7);
}

// Claim: every quantile function is monotonic, and its mean and standard deviation are those that integrating it gives
// (midpoint rule with 200,000 points; for the unbounded tails the rule is short by < 1e-4 of the std).
TEST(Distribution, MomentsMatchQuantile) {
  for (const auto& d : sample_distributions()) {
    constexpr int kPoints = 200000;
    double mean = 0, square = 0, before = d.lowest();
    for (int i = 0; i < kPoints; ++i) {
      const double x = d.quantile((i + 0.5) / kPoints);
      EXPECT_GE(x, before) << d.describe();
      before = x;
      mean += (x - d.median()) / kPoints;
      square += (x - d.median()) * (x - d.median()) / kPoints;
    }
    EXPECT_GE(d.highest(), before) << d.describe();
    EXPECT_NEAR(d.mean(), d.median() + mean, 1e-4 * d.std()) << d.describe();
    EXPECT_NEAR(d.std(), std::sqrt(square - mean * mean), 2e-4 * d.std()) << d.describe();
  }
}

// Claim: moments stay right where textbook formulas cancel or underflow. A normal beyond z has excess mean
// 1/z - 2/z^3 + 10/z^5 and variance 1/z^2 - 6/z^4 + 50/z^6 (expansion of the Mills ratio); the next terms are below
// 74/z^7 and 518/z^8. A narrow log-uniform is uniform up to relative width^2.
TEST(Distribution, MomentsInHardCases) {
  const double z = 100;
  const auto tail = Distribution::truncated_normal(0, 1, z, kInf);
  EXPECT_NEAR(tail.mean() - z, 1 / z - 2 / (z * z * z) + 10 / std::pow(z, 5), 3e-12);
  EXPECT_NEAR(tail.std() * tail.std(), 1 / (z * z) - 6 / std::pow(z, 4) + 50 / std::pow(z, 6), 1e-13);
  const auto narrow = Distribution::log_uniform(1, 1 + 1e-6);
  EXPECT_NEAR(narrow.std(), 1e-6 / std::sqrt(12.0), 1e-12);
  const auto wide = Distribution::log_uniform(1, M_E);
  EXPECT_NEAR(wide.mean(), M_E - 1, 1e-14);
  EXPECT_NEAR(wide.std(), std::sqrt((M_E * M_E - 1) / 2 - (M_E - 1) * (M_E - 1)), 1e-14);
}

// Claim: what cannot vary says so, and what can vary does not.
TEST(Distribution, IsConstant) {
  EXPECT_TRUE(Distribution::constant(1).is_constant());
  EXPECT_TRUE(Distribution::normal(1, 0).is_constant());
  EXPECT_TRUE(Distribution::truncated_normal(1, 0, 0, 2).is_constant());
  EXPECT_TRUE(Distribution::uniform(2, 2).is_constant());
  EXPECT_TRUE(Distribution::triangular(2, 2, 2).is_constant());
  EXPECT_TRUE(Distribution::choice(1).is_constant());
  EXPECT_TRUE(Distribution::empirical({3, 3}).is_constant());
  for (const auto& d : sample_distributions()) EXPECT_FALSE(d.is_constant()) << d.describe();
}

// Claim: every wrong argument is refused, and the message states the value and the rule.
TEST(Distribution, RefusesWrongArguments) {
  const double nan = std::nan("");
  const std::vector<std::pair<std::function<void()>, std::string>> cases = {
      {[] { Distribution::normal(0, -0.1); }, "std -0.1 is negative; a standard deviation must be >= 0"},
      {[&] { Distribution::normal(nan, 1); }, "mean nan is not a finite number"},
      {[] { Distribution::constant(kInf); }, "value inf is not a finite number"},
      {[] { Distribution::truncated_normal(0, 1, 2, 2); }, "min 2 is not below max 2"},
      {[&] { Distribution::truncated_normal(0, 1, nan, 2); }, "is not below max 2"},
      {[] { Distribution::truncated_normal(0, 0, 1, 2); }, "lies outside [1, 2]"},
      {[] { Distribution::uniform(3, 1); }, "min 3 is above max 1"},
      {[] { Distribution::uniform(-1e308, 1e308); }, "too wide"},
      {[] { Distribution::log_normal(0, -1); }, "log std -1 is negative"},
      {[] { Distribution::log_uniform(0, 1); }, "min 0 is not positive"},
      {[] { Distribution::triangular(0, 2, 1); }, "mode 2 is outside [0, 1]"},
      {[] { Distribution::choice(0); }, "0 choices"},
      {[] { Distribution::choice(2, {1}); }, "1 weights for 2 choices"},
      {[] {
         Distribution::choice(2, {1, -1});
       },
       "weight -1 is not a finite number >= 0"},
      {[] {
         Distribution::choice(2, {0, 0});
       },
       "at least one must be > 0"},
      {[] { Distribution::empirical({}); }, "at least one"},
      {[] {
         Distribution::choice(2, {1e308, 1e308});
       },
       "make all of them smaller"},
      {[] { Distribution::log_normal(0, 1e3); }, "every draw must be a finite number: give a log_std of at most 86.4"},
      {[] { Distribution::log_normal(709, 1); }, "can be as high as inf; every draw must be a finite number"},
      {[] { Distribution::normal(0, 1e308); }, "can be as low as -inf; every draw must be a finite number"},
      {[] { Distribution::truncated_normal(1e308, 1e308, 0, kInf); }, "cut it with both min and max"},
      {[] { Distribution::triangular(0, 1, 1e200); }, "too wide for a triangular distribution"},
  };
  for (const auto& [make, message] : cases) {
    try {
      make();
      ADD_FAILURE() << "accepted: " << message;
    } catch (const std::invalid_argument& e) {
      EXPECT_THAT(e.what(), testing::HasSubstr(message));
    }
  }
}

}  // namespace
}  // namespace graze
