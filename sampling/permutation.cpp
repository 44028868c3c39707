#include "sampling/permutation.h"

#include <bit>
#include <cassert>

#include "sampling/stream.h"

namespace graze {

std::uint64_t permute(std::uint64_t index, std::uint64_t n, std::uint64_t seed, std::uint64_t name) {
  assert(index < n && n <= std::uint64_t{1} << 32);
  if (n == 1) return 0;
  const int half = (std::bit_width(n - 1) + 1) / 2;  // bits
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = index >> half, right = index & mask;
    for (std::uint32_t round = 0; round < 8; ++round) {
      const auto bits = random_bits(seed, static_cast<std::uint32_t>(right), name, kFirstReservedStep + round).first;
      const std::uint64_t next = left ^ (bits & mask);
      left = right;
      right = next;
    }
    index = left << half | right;
  } while (index >= n);
  return index;
}

}  // namespace graze
