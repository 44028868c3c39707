#pragma once
// Telemetry of the traces under way: frames of each lane, gathered in memory of the lane's own and handed over when its
// trace has ended, as far as the scenario's `record` wants them kept.

#include <array>
#include <cstdint>
#include <vector>

#include "engine/lanes/block.h"
#include "engine/lanes/lane_tape.h"
#include "scenarios/scenario.h"
#include "simulation/trace.h"

namespace graze {

/// One state of a block, as frames are taken from it. Arrays [row][lane].
struct FrameSource {
  const BlockArray &q, &v, &tau;
};

class TelemetryRecorder {
 public:
  /// `step`: physics step, s. Where only the last seconds before a failure are kept, a lane holds no more than that.
  TelemetryRecorder(const Recording& recording, double step);

  /// False: nothing is ever kept, nothing else need be called.
  bool on() const { return recording_.telemetry != Telemetry::none; }
  /// The lane begins a new trace.
  void start(int lane);
  /// Writes down, or reads back after start(), the frames so far.
  void carry(int lane, LaneTape& tape);
  /// Takes a frame after `step` physics steps of the trace if one is due; always at its end. `failed`: a requirement is
  /// violated, though the trace may go on; where the last seconds before a failure are kept, these are the ones.
  void take(int lane, std::uint32_t step, bool ended, bool failed, const FrameSource& source);
  /// What is kept of the trace.
  FrameLog hand_over(int lane, bool failed);

 private:
  struct Lane {
    FrameLog frames;          // a ring if there is a capacity
    std::uint64_t count = 0;  // frames taken, those that were overwritten included
    bool frozen = false;
  };
  const Recording recording_;
  const double step_;
  std::uint64_t capacity_ = 0;  // frames per lane; 0: no limit
  std::size_t longest_ = 0;     // frames of the longest trace so far: the next ones will be as long
  std::vector<double> row_;     // one frame: q, v, tau
  std::array<Lane, kLanes> lanes_;
};

}  // namespace graze
