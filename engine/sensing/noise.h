#pragma once
// Noise: named channels, each drawn afresh at every step in all lanes at once. A value depends on seed, particle, name
// and step alone (sampling/stream.h).

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/lanes/block.h"
#include "engine/lanes/isa.h"
#include "engine/sensing/kernel.h"
#include "sampling/distribution.h"

namespace graze {

class LaneNoise {
 public:
  struct Channel {
    std::uint64_t name;  // name_hash()
    int row;             // of the results; each row once
    Distribution distribution;
  };

  LaneNoise() = default;
  explicit LaneNoise(std::uint64_t seed, const std::vector<Channel>& channels, Isa isa = chosen_isa());
  bool empty() const { return channels_.empty(); }

  /// out(row) = mean(row) + quantile(uniform(seed, particle, name, step)) of each channel, in the active lanes. Equal
  /// to Distribution::quantile but for normal and truncated normal channels, which have the lanes' own arithmetic (the
  /// same for every instruction set) and may differ from it by a few ulp.
  void draw(const std::array<std::uint32_t, kLanes>& particle, const std::array<std::uint32_t, kLanes>& step,
            LaneMask active, const BlockArray& mean, BlockArray& out);

 private:
  const SensingKernel* kernel_ = nullptr;
  NoiseView view_{};
  std::vector<NoiseChannel> channels_;
  std::vector<Distribution> other_;  // of the raw channels
  BlockArray uniform_;               // of the raw channels
};

}  // namespace graze
