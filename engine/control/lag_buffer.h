#pragma once
// The control lag: what a tracker follows at time t are the newest targets that the policy issued at or before
// t - lag (zero-order hold). Lanes are independent: each has its own lag, clock and history.

#include <array>
#include <vector>

#include "engine/control/policy.h"

namespace graze {

class LagBuffer {
 public:
  /// `initial`: targets that count as issued before the trace began; `period`: control step, s; `end`: longest trace,
  /// s; `kind`: what the tracker follows. Only that and the feed-forward torques are kept.
  LagBuffer(Targets initial, double period, double end, TargetKind kind);

  /// Forgets the lane's history. `lag`: its persistent value, s; it bounds the history to three times as much (and at
  /// least 100 steps), and a momentary lag beyond that sees the oldest targets kept. No history is longer than a trace,
  /// and memory is taken as the trace goes on.
  void start(int lane, double lag);
  /// Takes over what counts as issued before the lane's trace.
  void know(int lane, const LagBuffer& other);
  /// Writes down, or reads back, the lane's history.
  void carry(int lane, LaneTape& tape);
  /// Control steps that memory has been taken for.
  std::size_t slots() const { return slots_.size(); }
  /// Records the active lanes of `targets` as issued at `time` (growing from call to call), and returns targets whose
  /// active lanes are those that were in force at time - lag. `time`, `lag`: s, one per lane. What is returned is
  /// either `targets` or lives here until the next call.
  const Targets& pass(const std::array<double, kLanes>& time, const std::array<double, kLanes>& lag, LaneMask active,
                      const Targets& targets);

 private:
  /// History of a lane: its newest targets stand in slot `head`, those before them in the slots before, in a circle.
  struct Lane {
    std::size_t issued = 0;  // since start
    std::size_t depth = 1;   // at most kept
    std::size_t head = 0;
    std::vector<double> time;  // of each slot
  };
  static constexpr int kInitial = -1;

  /// The slot `age` issues before; age at most the number of slots.
  std::size_t before(std::size_t slot, std::size_t age) const {
    return slot >= age ? slot - age : slot + slots_.size() - age;
  }
  /// The head of the lane that is furthest on its way: lanes that act together then write the same slot, row by row.
  std::size_t common_head() const;
  void grow(std::size_t slots);
  void make_room(LaneMask active);
  void record(const std::array<double, kLanes>& time, LaneMask active, const Targets& targets);
  /// How many issues ago the targets in force were issued; kInitial: before the first.
  int age_in_force(const Lane& lane, double due) const;

  Targets initial_, delayed_;
  double period_;
  double longest_;                           // control steps of a whole trace
  std::vector<BlockArray Targets::*> kept_;  // what is passed on
  std::vector<Targets> slots_;
  std::array<Lane, kLanes> lanes_;
};

}  // namespace graze
