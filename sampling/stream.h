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

/// Two independent uniforms in (0,1), 53 bits each, for (seed, particle, name, step).
std::pair<double, double> uniform_pair(std::uint64_t seed, std::uint32_t particle, std::uint64_t name,
                                       std::uint32_t step);

/// The first of uniform_pair.
double uniform(std::uint64_t seed, std::uint32_t particle, std::uint64_t name, std::uint32_t step);

}  // namespace graze
