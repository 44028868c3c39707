#include "sampling/design.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <stdexcept>

#include "sampling/permutation.h"
#include "sampling/stream.h"
#include "tests/sampling/statistics.h"

namespace graze {
namespace {

UncertainParameter parameter(const std::string& name, const Distribution& distribution) {
  UncertainParameter p;
  p.name = name;
  p.persistent = distribution;
  return p;
}

constexpr std::array kDesigns = {Design::random, Design::latin_hypercube, Design::sobol};

// Claim: the reproducibility promise: these draws never change.
TEST(Sampler, FrozenDraws) {
  ParameterSpace space;
  space.parameters.push_back(parameter("robot.link.LF_SHIN.length", Distribution::normal(0.1, 0.0025)));
  space.parameters.push_back(parameter("contact.friction", Distribution::uniform(0.8, 1.2)));
  EXPECT_EQ(Sampler(space, Design::random, 1, 10).draw(3),
            (std::vector<double>{0x1.9ec620bbeccc4p-4, 0x1.2aaa901fcab7ep+0}));
  EXPECT_EQ(Sampler(space, Design::latin_hypercube, 1, 10).draw(3),
            (std::vector<double>{0x1.98cfe0f6bf7cfp-4, 0x1.3258bc7e0f26ep+0}));
  EXPECT_EQ(Sampler(space, Design::sobol, 1, 10).draw(3),
            (std::vector<double>{0x1.8ec4925001315p-4, 0x1.0f2facc7236aap+0}));
}

// Claim: a random or Sobol particle is the same however many are asked for; a Latin hypercube's is not (which shows
// that the comparison can tell).
TEST(Sampler, ParticleDoesNotDependOnCount) {
  for (const Design design : kDesigns) {
    const Sampler few(cube(5), design, 3, 100), many(cube(5), design, 3, 10000);
    int same = 0;
    for (std::uint32_t i = 0; i < 100; ++i) same += few.draw(i) == many.draw(i);
    if (design == Design::latin_hypercube)
      EXPECT_LT(same, 5);
    else
      EXPECT_EQ(same, 100);
  }
}

// Claim: adding a parameter changes no other draw: anywhere in the list for the designs that are keyed by name alone,
// at its end for Sobol, where the place in the list is the dimension.
TEST(Sampler, AddingAParameterChangesNoOther) {
  for (const Design design : kDesigns) {
    ParameterSpace more = cube(5);
    const bool last = design == Design::sobol;
    more.parameters.insert(last ? more.parameters.end() : more.parameters.begin() + 2,
                           parameter("new", Distribution::normal(0, 1)));
    const Sampler before(cube(5), design, 3, 64), after(more, design, 3, 64);
    for (std::uint32_t i = 0; i < 64; ++i) {
      auto values = after.draw(i);
      values.erase(last ? values.end() - 1 : values.begin() + 2);
      EXPECT_EQ(values, before.draw(i));
    }
  }
}

// Claim: the seed matters, and a draw goes through the parameter's own quantile function.
TEST(Sampler, SeedAndQuantile) {
  for (const Design design : kDesigns) {
    ParameterSpace space = cube(1);
    space.parameters[0].persistent = Distribution::triangular(0, 1, 4);
    const Sampler a(space, design, 3, 64), b(space, design, 4, 64);
    std::vector<double> u(1);
    a.unit_point(5, u);
    EXPECT_EQ(a.draw(5)[0], space.parameters[0].persistent.quantile(u[0]));
    EXPECT_NE(a.draw(5), b.draw(5));
  }
}

// Claim: every design is uniform in every coordinate and uncorrelated between coordinates, point by point, over seeds
// (a scrambled net and a Latin hypercube are each unbiased). KS and correlation at 5 sigma over 4000 seeds, 3 x 3 tests
// at 1e-4 and 3 x 3 at 6e-7: false alarms 1e-3.
TEST(Sampler, EveryPointIsUniformOverSeeds) {
  for (const Design design : kDesigns) {
    std::vector<std::vector<double>> u(3);
    for (std::uint64_t seed = 0; seed < 4000; ++seed) {
      std::vector<double> point(3);
      Sampler(cube(3), design, seed, 7).unit_point(2, point);
      for (int k = 0; k < 3; ++k) u[k].push_back(point[k]);
    }
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(ks_statistic(u[k]), ks_limit(1e-4)) << static_cast<int>(design);
      EXPECT_LT(std::abs(correlation(u[k], u[(k + 1) % 3])), 5 / std::sqrt(4000.0)) << static_cast<int>(design);
    }
  }
}

// Claim: permute() is a bijection of 0 … n-1 for every n, small or not.
TEST(Permutation, IsABijection) {
  for (std::uint64_t n = 1; n < 300; n += n < 40 ? 1 : 37) {
    std::vector<int> hits(n, 0);
    for (std::uint64_t i = 0; i < n; ++i) ++hits.at(permute(i, n, 5, name_hash("x")));
    EXPECT_EQ(hits, std::vector<int>(n, 1)) << n;
  }
  constexpr std::uint64_t kBig = 100003;
  std::vector<bool> hit(kBig);
  for (std::uint64_t i = 0; i < kBig; ++i) hit.at(permute(i, kBig, 5, name_hash("x"))) = true;
  EXPECT_EQ(std::count(hit.begin(), hit.end(), true), static_cast<long>(kBig));
  EXPECT_LT(permute(0xffffffffu, std::uint64_t{1} << 32, 5, 1), std::uint64_t{1} << 32);
}

// Claim: all n! permutations of few elements are equally likely. Chi-square over 12,000 names, n = 2, 3, 4, each at
// 1e-4: false alarms 3e-4.
TEST(Permutation, AllOrdersAreEquallyLikely) {
  for (const int n : {2, 3, 4}) {
    constexpr int kNames = 12000;
    std::map<std::vector<std::uint64_t>, int> counts;
    for (int k = 0; k < kNames; ++k) {
      std::vector<std::uint64_t> order(n);
      for (int i = 0; i < n; ++i) order[i] = permute(i, n, 1, name_hash(fmt::format("name{}", k)));
      ++counts[order];
    }
    const int orders = n == 2 ? 2 : n == 3 ? 6 : 24;
    const double expected = static_cast<double>(kNames) / orders;
    double chi = (orders - static_cast<double>(counts.size())) * expected;  // orders that never came
    for (const auto& [order, count] : counts) chi += (count - expected) * (count - expected) / expected;
    EXPECT_LT(chi, quantile(complement(boost::math::chi_squared(orders - 1), 1e-4))) << n;
  }
}

// Claim: a Latin hypercube puts exactly one particle into each of the N cells of every coordinate.
TEST(LatinHypercube, OneParticlePerCell) {
  for (const int count : {1, 7, 64, 1000}) {
    const Sampler sampler(cube(3), Design::latin_hypercube, 9, count);
    std::vector<std::vector<int>> hits(3, std::vector<int>(count, 0));
    for (int i = 0; i < count; ++i) {
      const auto point = sampler.draw(i);
      for (int k = 0; k < 3; ++k) ++hits[k][static_cast<int>(point[k] * count)];
    }
    for (int k = 0; k < 3; ++k) EXPECT_EQ(hits[k], std::vector<int>(count, 1)) << count;
  }
}

// Claim: within its cell a particle lies anywhere: the positions are uniform. KS at 1e-4.
TEST(LatinHypercube, JitterWithinTheCell) {
  const Sampler sampler(cube(1), Design::latin_hypercube, 9, 5000);
  std::vector<double> within;
  for (int i = 0; i < 5000; ++i) within.push_back(std::fmod(sampler.draw(i)[0] * 5000, 1.0));
  EXPECT_LT(ks_statistic(within), ks_limit(1e-4));
}

// Claim: what a design cannot serve is refused with the limit.
TEST(Sampler, RefusesWhatItCannotServe) {
  EXPECT_THROW(Sampler(cube(3668), Design::sobol, 1, 1), std::invalid_argument);
  EXPECT_NO_THROW(Sampler(cube(3667), Design::sobol, 1, 1));
  EXPECT_NO_THROW(Sampler(cube(3668), Design::random, 1, 1));
  EXPECT_THROW(Sampler(cube(1), Design::latin_hypercube, 1, 0), std::invalid_argument);
  EXPECT_THROW(Sampler(cube(1), Design::latin_hypercube, 1, (1ull << 32) + 1), std::invalid_argument);
  EXPECT_TRUE(Sampler(cube(0), Design::sobol, 1, 1).draw(0).empty());
}

}  // namespace
}  // namespace graze
