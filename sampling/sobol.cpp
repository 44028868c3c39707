#include "sampling/sobol.h"

#include <array>
#include <bit>
#include <boost/random/sobol.hpp>
#include <cassert>

#include "sampling/stream.h"

namespace graze {
namespace {

constexpr std::uint32_t kMatrixStep = kFirstReservedStep + 16;
constexpr std::uint32_t kShiftStep = kFirstReservedStep + 17;

}  // namespace

std::vector<std::uint64_t> sobol_directions(int dimensions) {
  assert(dimensions >= 1 && dimensions <= kSobolMaxDimensions);
  // The engine walks in Gray code order and leaves out point 0: its n-th output (from 0) is the point whose digits are
  // those of gray(n + 1). gray(2^(k+1) - 1) = 2^k, so that output is direction k itself.
  boost::random::sobol_engine<std::uint_least64_t, 64> engine(static_cast<std::size_t>(dimensions));
  std::vector<std::uint64_t> directions(static_cast<std::size_t>(dimensions) * kSobolBits);
  for (int k = 0; k < kSobolBits; ++k) {
    engine.seed((std::uint64_t{1} << (k + 1)) - 2);
    for (int d = 0; d < dimensions; ++d) directions[static_cast<std::size_t>(d) * kSobolBits + k] = engine();
  }
  return directions;
}

void scramble_directions(std::uint64_t* directions, std::uint64_t seed, std::uint64_t name) {
  std::array<std::uint64_t, 64> rows;  // row r makes digit r (from the most significant) of the digits 0 … r
  for (std::uint32_t r = 0; r < 64; ++r) {
    const std::uint64_t diagonal = std::uint64_t{1} << (63 - r);
    const std::uint64_t above = ~(diagonal | (diagonal - 1));  // digits 0 … r-1
    rows[r] = (random_bits(seed, r, name, kMatrixStep).first & above) | diagonal;
  }
  for (int k = 0; k < kSobolBits; ++k) {
    std::uint64_t scrambled = 0;
    for (const std::uint64_t row : rows) scrambled = scrambled << 1 | (std::popcount(row & directions[k]) & 1u);
    directions[k] = scrambled;
  }
}

std::uint64_t sobol_shift(std::uint64_t seed, std::uint64_t name) {
  return random_bits(seed, 0, name, kShiftStep).first;
}

}  // namespace graze
