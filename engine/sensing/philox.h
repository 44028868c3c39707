#pragma once
// sampling/stream.h's uniform() on lanes: Philox4x32-10 (Salmon et al., SC'11), counter = (particle, low and high word
// of name, step), key = (low and high word of seed). Words of 32 bits stand in the low halves of 64; what is above them
// is arbitrary, since only low halves are multiplied.
//
// One round makes of (c0, c1, c2, c3): (high(p1) ^ c1 ^ k0, low(p1), high(p0) ^ c3 ^ k1, low(p0)) with p0 = M0 c0 and
// p1 = M1 c2. In the first two rounds name and lane meet by exclusive or only, so each side's share is computed once:
// the channel's when it is made (NoiseChannel::word), the lane's once per draw of all channels.

#include "engine/lanes/bits.h"
#include "engine/sensing/kernel.h"

namespace graze {

inline constexpr std::uint32_t kPhiloxM0 = 0xD2511F53u, kPhiloxM1 = 0xCD9E8D57u;  // multipliers
inline constexpr std::uint32_t kPhiloxW0 = 0x9E3779B9u, kPhiloxW1 = 0xBB67AE85u;  // what a round adds to the key

inline namespace GRAZE_ISA_NAMESPACE {

/// Key words of round 0 … 9.
constexpr std::uint32_t philox_key0(std::uint64_t seed, std::uint32_t round) {
  return static_cast<std::uint32_t>(seed) + round * kPhiloxW0;
}
constexpr std::uint32_t philox_key1(std::uint64_t seed, std::uint32_t round) {
  return static_cast<std::uint32_t>(seed >> 32) + round * kPhiloxW1;
}

/// What the lanes contribute after two rounds, and the keys of the rounds that follow.
template <class T>
struct PhiloxLanes {
  using B = bits_of<T>;
  B product;  // p1 of the second round
  B c3;       // of the first round
  std::uint64_t key0[8], key1[8];
};

template <class T>
inline PhiloxLanes<T> philox_lanes(std::uint64_t seed, const std::uint32_t* particle, const std::uint32_t* step) {
  using B = bits_of<T>;
  std::uint64_t wide_particle[kWidth<T>], wide_step[kWidth<T>];
  for (int lane = 0; lane < kWidth<T>; ++lane) {
    wide_particle[lane] = particle[lane];
    wide_step[lane] = step[lane];
  }
  const B p0 = multiply_low(B(kPhiloxM0), load_bits<T>(wide_particle));
  const B c2 = exclusive_or(shift_right<32>(p0), load_bits<T>(wide_step), B(philox_key1(seed, 0)));
  PhiloxLanes<T> out;
  out.product = multiply_low(B(kPhiloxM1), c2);
  out.c3 = p0;
  for (std::uint32_t round = 2; round < 10; ++round) {
    out.key0[round - 2] = philox_key0(seed, round);
    out.key1[round - 2] = philox_key1(seed, round);
  }
  return out;
}

/// uniform(seed, particle, name, step) of one channel.
template <class T>
inline T philox_uniform(const PhiloxLanes<T>& lanes, const NoiseChannel& channel) {
  using B = bits_of<T>;
  const B m0(kPhiloxM0), m1(kPhiloxM1);
  B c0 = shift_right<32>(lanes.product) ^ B(channel.word[0]), c1 = lanes.product;
  B c2 = lanes.c3 ^ B(channel.word[1]), c3(channel.word[2]);
  GRAZE_UNROLL
  for (int round = 0; round < 7; ++round) {
    const B p0 = multiply_low(m0, c0), p1 = multiply_low(m1, c2);
    c0 = exclusive_or(shift_right<32>(p1), c1, B(lanes.key0[round]));
    c1 = p1;
    c2 = exclusive_or(shift_right<32>(p0), c3, B(lanes.key1[round]));
    c3 = p0;
  }
  // Of the last round only the first two words are wanted, the second above the first; of these 64 bits the top 53.
  const B p1 = multiply_low(m1, c2);
  const B w0 = exclusive_or(shift_right<32>(p1), c1, B(lanes.key0[7]));
  const B word = shift_left<21>(p1 & B(0xffffffffu)) | shift_right<11>(w0 & B(0xffffffffu));
  return max(number(word) * T(0x1p-53), T(0x1p-54));  // kSmallestUniform where the word is 0
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
