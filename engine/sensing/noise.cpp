#include "engine/sensing/noise.h"

#include "engine/sensing/philox.h"

namespace graze {

namespace {

NoiseKind noise_kind(const Distribution& distribution) {
  const Distribution::Numbers numbers = distribution.numbers();
  switch (distribution.kind()) {
    case Distribution::Kind::normal:
      return kNormalNoise;
    case Distribution::Kind::truncated_normal:
      return numbers.far || numbers.b == 0 ? kRawNoise : kTruncatedNoise;
    case Distribution::Kind::uniform:
      return kUniformNoise;
    default:
      return kRawNoise;
  }
}

/// The channel's share of the first two rounds of Philox.
NoiseChannel noise_channel(std::uint64_t seed, const LaneNoise::Channel& channel) {
  const auto low = static_cast<std::uint32_t>(channel.name), high = static_cast<std::uint32_t>(channel.name >> 32);
  const std::uint64_t p1 = std::uint64_t{kPhiloxM1} * high;
  const std::uint32_t c0 = static_cast<std::uint32_t>(p1 >> 32) ^ low ^ philox_key0(seed, 0);
  const std::uint64_t p0 = std::uint64_t{kPhiloxM0} * c0;
  const Distribution::Numbers n = channel.distribution.numbers();
  return {{static_cast<std::uint32_t>(p1) ^ philox_key0(seed, 1),
           static_cast<std::uint32_t>(p0 >> 32) ^ philox_key1(seed, 1), static_cast<std::uint32_t>(p0)},
          channel.row,
          n.a,
          n.b,
          n.c,
          n.d,
          n.low,
          n.high,
          n.span};
}

}  // namespace

LaneNoise::LaneNoise(std::uint64_t seed, const std::vector<Channel>& channels, Isa isa)
    : kernel_(GRAZE_KERNEL(isa, find_sensing_kernel)) {
  view_.seed = seed;
  for (int kind = 0; kind < kNoiseKinds; ++kind) {
    for (const Channel& channel : channels) {
      if (noise_kind(channel.distribution) != kind) continue;
      channels_.push_back(noise_channel(seed, channel));
      if (kind == kRawNoise) other_.push_back(channel.distribution);
    }
    view_.end[kind] = static_cast<int>(channels_.size());
  }
  uniform_ = BlockArray(static_cast<int>(other_.size()));
}

void LaneNoise::draw(const std::array<std::uint32_t, kLanes>& particle, const std::array<std::uint32_t, kLanes>& step,
                     LaneMask active, const BlockArray& mean, BlockArray& out) {
  if (channels_.empty()) return;
  view_.channels = channels_.data();
  double* raw = other_.empty() ? nullptr : uniform_.row(0);
  kernel_->draw(view_, {particle.data(), step.data(), active.bits(), mean.row(0), out.row(0), raw});
  for (std::size_t i = 0; i < other_.size(); ++i) {
    const int row = channels_[view_.end[kUniformNoise] + i].row;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!active[lane]) continue;
      out(row, lane) = mean(row, lane) + other_[i].quantile(uniform_(static_cast<int>(i), lane));
    }
  }
}

}  // namespace graze
