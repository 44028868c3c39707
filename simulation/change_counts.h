#pragma once
// How large changes of velocity were, counted in bins: a median that takes the same room for any number of them and
// does not depend on the order in which they came.

#include <cstdint>
#include <vector>

#include "engine/lanes/lane_tape.h"

namespace graze {

/// Changes above 0, m/s or rad/s, each in one of eight bins per octave.
class ChangeCounts {
 public:
  /// `times`: as often as that. What lies beyond the bins, or is infinite, counts in the last of them.
  void add(double change, std::uint64_t times = 1);
  /// Middle of the bin that holds the lower median: to 7 % of it. NaN if there are none.
  double median() const;
  void clear() { counts_.clear(); }
  void carry(LaneTape& tape) { tape.carry(counts_); }

 private:
  std::vector<std::uint64_t> counts_;  // per bin; empty: none, as in most traces
};

}  // namespace graze
