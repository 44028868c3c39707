#pragma once
// Noise on lanes: uniforms by Philox (philox.h), then quantiles (quantile.h).

#include "engine/sensing/philox.h"
#include "engine/sensing/quantile.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Where a truncated normal looks its quantile up, as Distribution::quantile: from whichever end is nearer.
template <class T>
struct TruncatedArgument {
  T u;
  mask_of<T> upper;  // the quantile is -normal_quantile(u)
};

template <class T>
inline TruncatedArgument<T> truncated_argument(const NoiseChannel& channel, const T& u) {
  const T p = T(channel.low) + u * T(channel.span);
  const auto upper = p > T(0.5);
  return {select(upper, T(channel.high) + (T(1.0) - u) * T(channel.span), p), upper};
}

/// Adds a channel's noise to its mean, in the active lanes.
template <class T>
inline void add_noise(const NoiseDraw& draw, const mask_of<T>& active, const NoiseChannel& channel, const T& noise) {
  double* out = draw.out + channel.row * kWidth<T>;
  store(out, select(active, load<T>(draw.mean + channel.row * kWidth<T>) + noise, load<T>(out)));
}

/// Channels [first, first + count), count <= kChunk, all of one kind.
template <class T>
inline void draw_chunk(const NoiseView& noise, const NoiseDraw& draw, const PhiloxLanes<T>& lanes, int kind, int first,
                       int count) {
  constexpr int W = kWidth<T>;
  const NoiseChannel* channels = noise.channels + first;
  alignas(64) double u[kChunk * W], z[kChunk * W];
  unsigned upper[kChunk];
  for (int i = 0; i < count; ++i) store(u + i * W, philox_uniform(lanes, channels[i]));
  if (kind == kTruncatedNoise) {
    for (int i = 0; i < count; ++i) {
      const TruncatedArgument<T> argument = truncated_argument(channels[i], load<T>(u + i * W));
      store(u + i * W, argument.u);
      upper[i] = bits(argument.upper);
    }
  }
  if (kind == kNormalNoise || kind == kTruncatedNoise) normal_quantiles<T>(u, count, z);
  const auto active = mask_from_bits<T>(draw.active);
  for (int i = 0; i < count; ++i) {
    const NoiseChannel& channel = channels[i];
    const T a(channel.a), b(channel.b);
    if (kind == kNormalNoise) {
      add_noise<T>(draw, active, channel, a + b * load<T>(z + i * W));
    } else if (kind == kTruncatedNoise) {
      const T standard = load<T>(z + i * W);
      const T value = a + b * select(mask_from_bits<T>(upper[i]), -standard, standard);
      add_noise<T>(draw, active, channel, min(max(value, T(channel.c)), T(channel.d)));
    } else if (kind == kUniformNoise) {
      add_noise<T>(draw, active, channel, min(a + load<T>(u + i * W) * (b - a), b));
    } else {
      store(draw.raw + (first - noise.end[kUniformNoise] + i) * W, load<T>(u + i * W));
    }
  }
}

template <class T>
void draw_noise(const NoiseView& noise, const NoiseDraw& draw) {
  const PhiloxLanes<T> lanes = philox_lanes<T>(noise.seed, draw.particle, draw.step);
  for (int kind = 0, first = 0; kind < kNoiseKinds; ++kind) {
    for (const int end = noise.end[kind]; first < end; first += kChunk) {
      draw_chunk<T>(noise, draw, lanes, kind, first, end - first < kChunk ? end - first : kChunk);
    }
    first = noise.end[kind];
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
