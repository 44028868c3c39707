#include "sampling/stream.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/sampling/statistics.h"

namespace graze {
namespace {

// Claim: the generator is Philox4x32-10 as published: the three vectors of Random123's kat_vectors file, and our
// counter layout (particle, name low, name high, step) with key (seed low, seed high).
TEST(Stream, KnownAnswersOfPhilox) {
  EXPECT_EQ(random_bits(0, 0, 0, 0), std::pair(std::uint64_t{0xe169c58d6627e8d5u}, std::uint64_t{0x9b00dbd8bc57ac4cu}));
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  EXPECT_EQ(random_bits(kOnes, 0xffffffffu, kOnes, 0xffffffffu),
            std::pair(std::uint64_t{0x41c83b0e408f276du}, std::uint64_t{0x6d5451fda20bc7c6u}));
  EXPECT_EQ(random_bits(0x299f31d0a4093822u, 0x243f6a88u, 0x13198a2e85a308d3u, 0x03707344u),
            std::pair(std::uint64_t{0x94fdccebd16cfe09u}, std::uint64_t{0x24126ea15001e420u}));
}

// Claim: names are hashed by 64-bit FNV-1a (the vectors for "", "a" and "foobar" of the FNV specification).
TEST(Stream, KnownAnswersOfNameHash) {
  EXPECT_EQ(name_hash(""), 0xcbf29ce484222325u);
  EXPECT_EQ(name_hash("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(name_hash("foobar"), 0x85944171f73967e8u);
}

// Claim: the reproducibility promise: these bits never change, or every archive would become unrepeatable.
TEST(Stream, FrozenValues) {
  const auto name = name_hash("robot.link.LF_SHIN.length");
  EXPECT_EQ(name, 0xe8f0adbe7db85a08u);
  EXPECT_EQ(uniform(1, 0, name, kPersistent), 0x1.27710dddd0909p-1);
  EXPECT_EQ(uniform_pair(1, 7, name, 12), std::pair(0x1.cb4a7a8326d85p-1, 0x1.ebdafd669072ap-1));
}

// Claim: the smallest and largest uniform are exactly the promised constants, and 53 bits survive in between.
TEST(Stream, ExtremesOfUniform) {
  EXPECT_EQ(to_uniform(0), kSmallestUniform);
  EXPECT_EQ(to_uniform(0x7ff), kSmallestUniform);
  EXPECT_EQ(to_uniform(0x800), 0x1p-53);
  EXPECT_EQ(to_uniform(~std::uint64_t{0}), kLargestUniform);
  EXPECT_LT(kLargestUniform, 1.0);
  EXPECT_EQ(to_uniform(std::uint64_t{1} << 63), 0.5);
}

// Claim: uniforms are uniform along each of the four coordinates of the counter and key, and the two halves of a pair
// as well. Kolmogorov-Smirnov, 6 tests at 1e-4 each: false alarms 6e-4.
TEST(Stream, UniformAlongEveryCoordinate) {
  constexpr int kDraws = 50000;
  const auto run = [](auto&& draw) {
    std::vector<double> u;
    for (std::uint32_t i = 0; i < kDraws; ++i) u.push_back(draw(i));
    return ks_statistic(std::move(u));
  };
  const auto name = name_hash("a");
  const double limit = ks_limit(1e-4);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform(1, i, name, kPersistent); }), limit);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform(1, 3, name, i); }), limit);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform(i, 3, name, kPersistent); }), limit);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform(1, 3, i, kPersistent); }), limit);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform(1, 3, name_hash(fmt::format("p{}", i)), 5); }), limit);
  EXPECT_LT(run([&](std::uint32_t i) { return uniform_pair(1, i, name, 5).second; }), limit);
}

/// Chi-square of pairs on a 16 x 16 grid against independence of two uniforms: 255 degrees of freedom.
template <typename Draw>
double grid_chi_square(Draw&& draw) {
  constexpr int kCells = 16, kDraws = 60000;
  std::array<int, kCells * kCells> counts{};
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const auto [a, b] = draw(i);
    ++counts[static_cast<int>(a * kCells) * kCells + static_cast<int>(b * kCells)];
  }
  const double expected = kDraws / double(kCells * kCells);
  double sum = 0;
  for (const int c : counts) sum += (c - expected) * (c - expected) / expected;
  return sum;
}

// Claim: neighbours are independent: names that differ in one letter, consecutive particles, consecutive steps,
// consecutive seeds (also against the neighbouring particle: no stream is another seed's stream), the halves of a pair.
// 6 chi-square tests at 1e-4 each: false alarms 6e-4.
TEST(Stream, NeighboursAreIndependent) {
  const double limit = quantile(complement(boost::math::chi_squared(255), 1e-4));
  const auto a = name_hash("robot.joint.LF_X_1.zero"), b = name_hash("robot.joint.LF_X_2.zero");
  using U = std::uint32_t;
  EXPECT_LT(grid_chi_square([&](U i) { return std::pair(uniform(1, i, a, 0), uniform(1, i, b, 0)); }), limit);
  EXPECT_LT(grid_chi_square([&](U i) { return std::pair(uniform(1, i, a, 0), uniform(1, i + 1, a, 0)); }), limit);
  EXPECT_LT(grid_chi_square([&](U i) { return std::pair(uniform(1, 9, a, i), uniform(1, 9, a, i + 1)); }), limit);
  EXPECT_LT(grid_chi_square([&](U i) { return std::pair(uniform(i, 9, a, 0), uniform(i + 1, 9, a, 0)); }), limit);
  EXPECT_LT(grid_chi_square([&](U i) { return std::pair(uniform(1, i + 1, a, 0), uniform(2, i, a, 0)); }), limit);
  EXPECT_LT(grid_chi_square([&](U i) { return uniform_pair(1, i, a, 0); }), limit);
}

}  // namespace
}  // namespace graze
