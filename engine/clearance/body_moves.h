#pragma once
// How far the bodies of a block have moved, for all who ask how near they have come (clearance.h): looked at once per
// step, whoever asks first.

#include <vector>

#include "engine/block_physics.h"

namespace graze {

struct LaneKernel;

class BodyMoves {
 public:
  /// Of these bodies, each once.
  explicit BodyMoves(std::vector<int> bodies);

  /// A fresh trace in a lane: sums begin at 0 when it is looked at next.
  void start(int lane) { fresh_.set(lane); }
  /// The state has changed.
  void next() { seen_ = false; }
  /// Adds what has happened since the last look, if the state has changed since.
  void look(const BlockState& state);

  /// The row of a body in turn() and way(). Asserts that it is one of them.
  int row_of(int body) const;
  /// [bodies]: sums of the chords of turns, at 1 m, and of the ways of the bodies' origins, m.
  const double* turn() const { return turn_.row(0); }
  const double* way() const { return way_.row(0); }

 private:
  const LaneKernel* kernel_;
  std::vector<int> bodies_;
  BlockArray last_, turn_, way_;  // 12 per body: as last looked at; per body
  LaneMask fresh_;
  bool seen_ = false;
};

}  // namespace graze
