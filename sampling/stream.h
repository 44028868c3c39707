#pragma once
// Counter-based random streams (design: a value depends on the seed, the particle, the name and the step, and on
// nothing else). Generator: Philox4x32-10 (Salmon et al., SC'11) from Random123.

#include <cstdint>
#include <string_view>
#include <utility>

namespace graze {

/// 64-bit hash of a parameter's or channel's name (FNV-1a). Part of the reproducibility promise: never changes.
std::uint64_t name_hash(std::string_view name);

/// The smallest and largest uniform that a stream or a design can return; every distribution's support in practice is
/// [quantile(kSmallestUniform), quantile(kLargestUniform)].
inline constexpr double kSmallestUniform = 0x1p-54;
inline constexpr double kLargestUniform = 1.0 - 0x1p-53;

/// Step number of persistent draws (made once per particle); control steps count 0, 1, 2, …
inline constexpr std::uint32_t kPersistent = 0xffffffffu;

/// Steps from here up to kPersistent belong to the designs (permutations and scrambles of design.cpp): a control step
/// never gets so far (at 1 ms per step: 49 days of simulated time).
inline constexpr std::uint32_t kFirstReservedStep = 0xffffff00u;

/// 64 random bits as a uniform: the top 53 bits k as k 2^-53, and k = 0 as the middle of its cell, 2^-54, so that the
/// quantile function never meets 0 or 1. (A half cell added throughout would round the largest k up to 1.)
constexpr double to_uniform(std::uint64_t bits) {
  const std::uint64_t k = bits >> 11;
  return k == 0 ? kSmallestUniform : static_cast<double>(k) * 0x1p-53;
}

/// The 128 raw bits of (seed, particle, name, step): Philox counter = (particle, low and high word of name, step), key
/// = (low and high word of seed); output words (w1 w0, w3 w2), the first of each pair the more significant.
std::pair<std::uint64_t, std::uint64_t> random_bits(std::uint64_t seed, std::uint32_t particle, std::uint64_t name,
                                                    std::uint32_t step);

/// Two independent uniforms in (0,1), 53 bits each, for (seed, particle, name, step).
std::pair<double, double> uniform_pair(std::uint64_t seed, std::uint32_t particle, std::uint64_t name,
                                       std::uint32_t step);

/// The first of uniform_pair.
double uniform(std::uint64_t seed, std::uint32_t particle, std::uint64_t name, std::uint32_t step);

}  // namespace graze
