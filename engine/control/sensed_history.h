#pragma once
// Sensed quantities as they were some control steps ago, each lane by its own clock.

#include <vector>

#include "engine/control/rows.h"
#include "engine/lanes/lane_tape.h"

namespace graze {

class SensedHistory {
 public:
  SensedHistory() = default;
  /// Of `rows` rows, 0: nothing is kept. `delay`: control steps.
  SensedHistory(int rows, int delay) : rows_(rows) {
    if (rows > 0) slots_.assign(delay, BlockArray(rows));
  }

  /// Nothing has been felt before a trace begins.
  void start(int lane) {
    for (BlockArray& slot : slots_) {
      for (int k = 0; k < rows_; ++k) slot(k, lane) = 0;
    }
  }
  void carry(int lane, LaneTape& tape) {
    for (BlockArray& slot : slots_) tape.carry(slot, lane);
  }

  /// Takes what is sensed now in the active lanes, and returns rows whose active lanes are what was sensed `delay`
  /// calls ago; null if nothing is kept.
  const double* pass(const BlockArray& now, LaneMask active) {
    if (rows_ == 0) return nullptr;
    if (slots_.empty()) return now.row(0);
    if (late_.rows() == 0) late_ = BlockArray(rows_);
    for (int k = 0; k < rows_; ++k) {
      copy_lanes(late_.row(k), slots_.back().row(k), active);
      for (std::size_t i = slots_.size() - 1; i > 0; --i) copy_lanes(slots_[i].row(k), slots_[i - 1].row(k), active);
      copy_lanes(slots_.front().row(k), now.row(k), active);
    }
    return late_.row(0);
  }

 private:
  int rows_ = 0;
  std::vector<BlockArray> slots_;  // the newest first
  BlockArray late_;
};

}  // namespace graze
