#include "sampling/stream.h"

#include <Random123/philox.h>

namespace graze {

std::uint64_t name_hash(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325u;  // offset basis and prime of 64-bit FNV-1a (Fowler, Noll, Vo)
  for (const char c : name) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3u;
  }
  return hash;
}

std::pair<std::uint64_t, std::uint64_t> random_bits(std::uint64_t seed, std::uint32_t particle, std::uint64_t name,
                                                    std::uint32_t step) {
  const auto low = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
  const auto high = [](std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32); };
  const r123::Philox4x32::ctr_type counter = {{particle, low(name), high(name), step}};
  const r123::Philox4x32::key_type key = {{low(seed), high(seed)}};
  const auto w = r123::Philox4x32_R<10>()(counter, key);
  return {std::uint64_t{w[1]} << 32 | w[0], std::uint64_t{w[3]} << 32 | w[2]};
}

std::pair<double, double> uniform_pair(std::uint64_t seed, std::uint32_t particle, std::uint64_t name,
                                       std::uint32_t step) {
  const auto [first, second] = random_bits(seed, particle, name, step);
  return {to_uniform(first), to_uniform(second)};
}

double uniform(std::uint64_t seed, std::uint32_t particle, std::uint64_t name, std::uint32_t step) {
  return to_uniform(random_bits(seed, particle, name, step).first);
}

}  // namespace graze
