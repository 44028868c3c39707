// Claim: the lanes' own sine and cosine err by less than 2 ulp for |x| <= 1e5, also beside the multiples of pi/2, and
// every width gives the bits of width 1.

#include "engine/lanes/trig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "tests/ulps.h"

namespace graze {
namespace {

/// The C library's, in 64 bits of mantissa.
void reference(double x, long double& s, long double& c) {
  s = std::sin(static_cast<long double>(x));
  c = std::cos(static_cast<long double>(x));
}

using test::ulps;

TEST(SineAndCosine, ErrByLessThanTwoUlp) {
  std::mt19937_64 random(1);
  for (double range : {0.8, 10.0, 1e3, 1e5}) {
    std::uniform_real_distribution<double> uniform(-range, range);
    double worst = 0, where = 0;
    for (int i = 0; i < 200000; ++i) {
      const double x = uniform(random);
      double s, c;
      sin_cos(x, s, c);
      long double want_s, want_c;
      reference(x, want_s, want_c);
      const double error = std::max(ulps(s, want_s), ulps(c, want_c));
      if (error > worst) worst = error, where = x;
    }
    EXPECT_LT(worst, 2.0) << "at " << where;
  }
}

// Where the sine passes through zero the whole argument cancels: what is left must be right to the last bits, too.
TEST(SineAndCosine, HoldBesideMultiplesOfHalfPi) {
  for (int k = 1; k < 2000; ++k) {
    const double x = k * 1.5707963267948966;
    double s, c;
    sin_cos(x, s, c);
    long double want_s, want_c;
    reference(x, want_s, want_c);
    const double small = std::min(std::fabs(s), std::fabs(c));
    const long double want = std::min(std::fabs(want_s), std::fabs(want_c));
    EXPECT_LT(std::fabs(small - want), 4e-16L * want) << k;
  }
}

TEST(SineAndCosine, AreTheSameBitsInEveryLane) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-50, 50);
  for (int i = 0; i < 2000; ++i) {
    double x[8], s[8], c[8];
    for (double& each : x) each = uniform(random);
    Pack<8> ps, pc;
    sin_cos(load<Pack<8>>(x), ps, pc);
    store(s, ps);
    store(c, pc);
    for (int lane = 0; lane < 8; ++lane) {
      double one_s, one_c;
      sin_cos(x[lane], one_s, one_c);
      EXPECT_EQ(std::memcmp(&one_s, &s[lane], 8), 0);
      EXPECT_EQ(std::memcmp(&one_c, &c[lane], 8), 0);
    }
  }
}

}  // namespace
}  // namespace graze
