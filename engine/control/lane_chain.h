#pragma once
// The table of a chain whose lanes have a robot each.

#include <vector>

#include "engine/dynamics/chain_view.h"

namespace graze {

class LaneChain {
 public:
  /// For the chains of robots that have the parts of this one; every lane's numbers are still to come.
  explicit LaneChain(const ChainView& like);

  /// Whether a robot's chain differs from this in numbers alone.
  bool fits(const ChainView& chain) const;
  /// Takes over the numbers of a chain that fits.
  void put(int lane, const ChainView& chain);
  /// For kernels; valid as long as this, or what this is moved to, lives and is not changed.
  ChainOf<LaneNumber> view() const;

 private:
  std::vector<ChainJointOf<LaneNumber>> joints_;
  LaneNumber tip_[3] = {};
};

}  // namespace graze
