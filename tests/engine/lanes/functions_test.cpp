// Claim: the lanes' own logarithm errs by less than 1 ulp, their atan2, asin and acos by less than 4 ulp, zeros have
// the signs of the C library's, and every width gives the bits of width 1.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "engine/lanes/arc.h"
#include "engine/lanes/log.h"
#include "tests/ulps.h"

namespace graze {
namespace {

using test::ulps;

/// Largest error of f over `n` random arguments, ulp; the reference is the C library's in 64 bits of mantissa.
template <class Argument, class Function, class Reference>
double worst_ulps(int n, Argument argument, Function f, Reference reference) {
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    const double x = argument();
    const double error = ulps(f(x), reference(static_cast<long double>(x)));
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

constexpr int kTrials = 300000;

TEST(Logarithm, ErrsByLessThanOneUlp) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> mantissa(0.5, 2), exponent(-1021, 1022), tail(0, 0.075), one(-1e-3, 1e-3);
  const auto error = [](auto argument) {
    return worst_ulps(
        kTrials, argument, [](double x) { return log_positive(x); }, [](long double x) { return std::log(x); });
  };
  EXPECT_LT(error([&] { return mantissa(random); }), 1.0);
  EXPECT_LT(error([&] { return std::exp2(exponent(random)); }), 1.0);
  EXPECT_LT(error([&] { return tail(random) + 0x1p-54; }), 1.0);
  EXPECT_LT(error([&] { return 1 + one(random); }), 1.0);
  EXPECT_EQ(log_positive(1.0), 0.0);
  EXPECT_EQ(log_positive(0x1p-1022), -1022 * std::log(2.0));
}

TEST(Arctangent, ErrsByLessThanFourUlp) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-40, 40), turn(-3.15, 3.15);
  double worst = 0;
  for (int i = 0; i < kTrials; ++i) {
    const double angle = turn(random), length = std::exp2(exponent(random));
    double y = length * std::sin(angle), x = length * std::cos(angle);
    if (i % 3 == 0) y *= std::exp2(exponent(random));
    const double error = ulps(atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x)));
    if (!(error <= worst)) worst = error;
  }
  EXPECT_LT(worst, 4.0);
}

TEST(Arctangent, HasTheSignsOfTheCLibrary) {
  for (const double y : {0.0, -0.0, 1.0, -1.0}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0}) {
      const double got = atan2(y, x), want = std::atan2(y, x);
      EXPECT_EQ(std::signbit(got), std::signbit(want)) << y << ' ' << x;
      EXPECT_DOUBLE_EQ(got, want) << y << ' ' << x;
    }
  }
}

TEST(Arctangent, PassesOnNaN) {
  EXPECT_TRUE(std::isnan(atan2(std::nan(""), 1.0)));
  EXPECT_TRUE(std::isnan(atan2(1.0, std::nan(""))));
}

TEST(Arcsine, ErrsByLessThanFourUlp) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> all(-1, 1), exponent(-45, 0);
  const auto edge = [&] { return 1 - std::exp2(exponent(random)); };
  const auto sine = [](double x) { return asin(x); };
  const auto cosine = [](double x) { return acos(x); };
  const auto sine_l = [](long double x) { return std::asin(x); };
  const auto cosine_l = [](long double x) { return std::acos(x); };
  EXPECT_LT(worst_ulps(
                kTrials, [&] { return all(random); }, sine, sine_l),
            4.0);
  EXPECT_LT(worst_ulps(kTrials, edge, sine, sine_l), 4.0);
  EXPECT_LT(worst_ulps(
                kTrials, [&] { return std::exp2(exponent(random)); }, sine, sine_l),
            4.0);
  EXPECT_LT(worst_ulps(kTrials, edge, cosine, cosine_l), 4.0);
  EXPECT_LT(worst_ulps(
                kTrials, [&] { return -edge(); }, cosine, cosine_l),
            4.0);
  EXPECT_TRUE(std::isnan(asin(1.5)));
}

TEST(Functions, AreTheSameBitsInEveryLane) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto check = [](const double* one, const Pack<8>& pack) {
    double many[8];
    store(many, pack);
    EXPECT_EQ(std::memcmp(one, many, sizeof many), 0);
  };
  for (int i = 0; i < 2000; ++i) {
    double x[8], y[8], want_log[8], want_atan2[8], want_asin[8];
    for (int lane = 0; lane < 8; ++lane) {
      x[lane] = uniform(random), y[lane] = uniform(random);
      want_log[lane] = log_positive(std::fabs(x[lane]));
      want_atan2[lane] = atan2(y[lane], x[lane]);
      want_asin[lane] = asin(x[lane]);
    }
    const Pack<8> px = load<Pack<8>>(x), py = load<Pack<8>>(y);
    check(want_log, log_positive(abs(px)));
    check(want_atan2, atan2(py, px));
    check(want_asin, asin(px));
  }
}

}  // namespace
}  // namespace graze
