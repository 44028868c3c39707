#pragma once
// A random permutation of 0 … n-1 that is computed entry by entry, in O(1) memory: the Latin hypercube asks only for
// its own particle's cell.

#include <cstdint>

namespace graze {

/// Image of `index` < n, 1 <= n <= 2^32, under the permutation of (seed, name). An eight-round balanced Feistel network
/// on the next power of 4 (Luby and Rackoff 1988; round function: Philox), walked until it lands below n again (Black
/// and Rogaway, "Ciphers with arbitrary finite domains", CT-RSA 2002): fewer than 4 passes on average.
std::uint64_t permute(std::uint64_t index, std::uint64_t n, std::uint64_t seed, std::uint64_t name);

}  // namespace graze
