#include "sampling/stream.h"

#include <Random123/philox.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace
}  // namespace graze
