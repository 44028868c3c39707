#pragma once
// The control lag: what a tracker follows at time t are the newest targets that the policy issued at or before
// t - lag (zero-order hold). Lanes are independent: each has its own lag, clock and history.

#include <array>
#include <vector>

#include "engine/control/policy.h"

namespace graze {

class LagBuffer {
 public:
  /// `initial`: targets that count as issued before the trace began; `period`: control step, s.
  LagBuffer(Targets initial, double period);

  /// Forgets the lane's history. `lag`: its persistent value, s; it sizes the history to three times as much (and at
  /// least 100 steps), and a momentary lag beyond that sees the oldest targets kept.
  void start(int lane, double lag);
  /// Records the lane's column of `targets` as issued at `time` (growing from call to call), and copies the column that
  /// was in force at time - lag to `out`.
  void pass(int lane, double time, double lag, const Targets& targets, Targets& out);

 private:
  struct Lane {
    std::size_t issued = 0;    // since start
    std::size_t depth = 1;     // slots in use
    std::vector<double> time;  // of each slot
  };
  Targets initial_;
  double period_;
  std::vector<Targets> slots_;
  std::array<Lane, kLanes> lanes_;
};

}  // namespace graze
