#pragma once
// Digests of the traces of a block, by which they are told to have the same bits (TraceRecord::digest).

#include <array>
#include <bit>
#include <cstdint>

#include "engine/lanes/block.h"

namespace graze {

using Digests = std::array<std::uint64_t, kLanes>;

/// Folds the bits of an array, row by row, into the running digest of each lane (multiply and fold; order matters).
inline void fold(Digests& digests, const BlockArray& array) {
  Digests d = digests;
  for (int i = 0; i < array.rows(); ++i) {
    const double* x = array.row(i);
    for (int lane = 0; lane < kLanes; ++lane) {
      d[lane] = (d[lane] ^ std::bit_cast<std::uint64_t>(x[lane])) * 0x9e3779b97f4a7c15u;
      d[lane] ^= d[lane] >> 32;
    }
  }
  digests = d;
}

}  // namespace graze
