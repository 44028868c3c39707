#pragma once
// Scrambled Sobol points. Directions: Joe and Kuo (SIAM J. Sci. Comput. 30, 2008), as Boost.Random carries them.
// Scrambling: random linear matrix scramble with digital shift (J. Matousek, "On the L2-discrepancy for anchored
// boxes", J. Complexity 14, 1998): each dimension's digits are multiplied over GF(2) by a random lower triangular
// matrix with unit diagonal, then XORed with random digits. It keeps the net (every elementary interval holds its exact
// share), makes each point uniform, and has the variance of Owen's full scramble.

#include <cstdint>
#include <vector>

namespace graze {

inline constexpr int kSobolBits = 32;             // of a particle id
inline constexpr int kSobolMaxDimensions = 3667;  // of Boost's table

/// Unscrambled direction numbers [dimension][bit], most significant digit in bit 63. 1 <= dimensions <= the above.
std::vector<std::uint64_t> sobol_directions(int dimensions);

/// One dimension's directions (kSobolBits of them), scrambled in place by the matrix of (seed, name). The matrix is 64
/// digits deep, so that all 53 bits of a coordinate vary.
void scramble_directions(std::uint64_t* directions, std::uint64_t seed, std::uint64_t name);

/// The digital shift of (seed, name).
std::uint64_t sobol_shift(std::uint64_t seed, std::uint64_t name);

/// Digits of point `index`, in the natural (not Gray code) order, before the shift.
inline std::uint64_t sobol_digits(const std::uint64_t* directions, std::uint32_t index) {
  std::uint64_t digits = 0;
  for (; index != 0; index >>= 1, ++directions) digits ^= (index & 1) ? *directions : 0;
  return digits;
}

}  // namespace graze
