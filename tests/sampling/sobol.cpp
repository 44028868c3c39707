#include "sampling/sobol.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <set>

#include "sampling/design.h"
#include "sampling/stream.h"
#include "tests/sampling/statistics.h"

namespace graze {
namespace {

// Claim: before scrambling, the points are Sobol's: the first four in two dimensions as printed in Joe and Kuo's notes
// (natural order), and the first 2^10 in 50 dimensions are, dimension by dimension and point by point, those of Boost's
// engine, which visits them in Gray code order.
TEST(Sobol, PointsAreThoseOfBoost) {
  const auto two = sobol_directions(2);
  constexpr std::uint64_t kHalf = std::uint64_t{1} << 63, kQuarter = kHalf / 2;
  const std::array<std::array<std::uint64_t, 2>, 4> printed = {
      {{0, 0}, {kHalf, kHalf}, {kQuarter, kHalf + kQuarter}, {kHalf + kQuarter, kQuarter}}};
  for (std::uint32_t i = 0; i < 4; ++i)
    for (int d = 0; d < 2; ++d) EXPECT_EQ(sobol_digits(&two[d * kSobolBits], i), printed[i][d]);
  const int dimensions = 50;
  const auto directions = sobol_directions(dimensions);
  boost::random::sobol_engine<std::uint_least64_t, 64> engine(dimensions);
  for (std::uint32_t n = 1; n < 1024; ++n)
    for (int d = 0; d < dimensions; ++d)
      ASSERT_EQ(sobol_digits(&directions[d * kSobolBits], n ^ (n >> 1)), engine()) << n << ' ' << d;
}

// Claim: scrambling keeps equidistribution: of the first 2^m points (and of any later run of 2^m that starts at a
// multiple of 2^m) every dyadic interval of length 2^-m holds exactly one, in every dimension.
TEST(Sobol, OnePointPerDyadicInterval) {
  const int dimensions = 200;
  const Sampler sampler(cube(dimensions), Design::sobol, 17, 0);
  for (const int m : {0, 1, 5, 9})
    for (const std::uint32_t start : {0u, 3u << m}) {
      std::vector<std::vector<int>> hits(dimensions, std::vector<int>(1 << m, 0));
      for (std::uint32_t i = start; i < start + (1u << m); ++i) {
        const auto point = sampler.draw(i);
        for (int d = 0; d < dimensions; ++d) ++hits[d][static_cast<int>(point[d] * (1 << m))];
      }
      for (int d = 0; d < dimensions; ++d) ASSERT_EQ(hits[d], std::vector<int>(1 << m, 1)) << m << ' ' << d;
    }
}

// Claim: the first two dimensions stay a (0, m, 2)-net: every elementary box 2^-a x 2^-(m-a) holds exactly one point.
TEST(Sobol, FirstTwoDimensionsAreANet) {
  constexpr int kM = 8;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Sampler sampler(cube(2), Design::sobol, seed, 0);
    for (int a = 0; a <= kM; ++a) {
      std::set<std::pair<int, int>> boxes;
      for (std::uint32_t i = 0; i < (1u << kM); ++i) {
        const auto point = sampler.draw(i);
        boxes.emplace(static_cast<int>(point[0] * (1 << a)), static_cast<int>(point[1] * (1 << (kM - a))));
      }
      EXPECT_EQ(boxes.size(), 1u << kM) << seed << ' ' << a;
    }
  }
}

// Claim: the scramble reaches the digits that the unscrambled directions leave 0: coordinates of 4096 points are all
// different modulo 2^-32, and all 53 bits occur in both states.
TEST(Sobol, AllBitsVary) {
  const Sampler sampler(cube(1), Design::sobol, 17, 0);
  std::set<std::uint64_t> low;
  std::uint64_t ones = 0, zeros = 0;
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const auto k = static_cast<std::uint64_t>(sampler.draw(i)[0] * 0x1p53);
    low.insert(k & 0x1fffff);
    ones |= k, zeros |= ~k;
  }
  EXPECT_EQ(ones & zeros & ((1ull << 53) - 1), (1ull << 53) - 1);
  EXPECT_GT(low.size(), 4000u);  // 4096 of 2^21 at random: 4 collisions expected
}

// A smooth function of six coordinates with mean 1.
double smooth(const std::vector<double>& x) {
  double f = 1;
  for (std::size_t d = 0; d < x.size(); ++d) f *= 1 + (std::exp(x[d]) - (M_E - 1)) / (d + 1.0);
  return f;
}

// Root mean square error of the mean over `count` points, over 40 seeds.
double integration_error(Design design, std::uint32_t count) {
  double square = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Sampler sampler(cube(6), design, seed, count);
    double sum = 0;
    for (std::uint32_t i = 0; i < count; ++i) sum += smooth(sampler.draw(i));
    square += std::pow(sum / count - 1, 2) / 40;
  }
  return std::sqrt(square);
}

// Claim: the integration error of a smooth function falls faster than random's N^-1/2. Between 2^6 and 2^12 points the
// exponent of random lies within 0.5 +- 0.1 and that of scrambled Sobol is at least 0.9; a Latin hypercube gains a
// constant factor. An RMS over 40 seeds is known to 11 % (1/sqrt(80)), so an exponent over a factor of 64 to
// 0.16 / ln 64 = 0.04: the bounds are 2.5 standard errors or more away.
TEST(Sobol, IntegratesFasterThanRandom) {
  const auto exponent = [](Design design) {
    return std::log(integration_error(design, 64) / integration_error(design, 4096)) / std::log(64.0);
  };
  EXPECT_NEAR(exponent(Design::random), 0.5, 0.1);
  EXPECT_GT(exponent(Design::sobol), 0.9);
  EXPECT_LT(integration_error(Design::latin_hypercube, 1024), 0.7 * integration_error(Design::random, 1024));
  EXPECT_LT(integration_error(Design::sobol, 4096), 0.1 * integration_error(Design::random, 4096));
}

}  // namespace
}  // namespace graze
