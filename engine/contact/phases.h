#pragma once
// Contact phases: what is left of contact events without the flicker of contacts that bounce within a few steps or
// change between stick, slip and roll. The alphabet of contact sequences (§3.6.1, §4.3.2).

#include <array>
#include <string>
#include <vector>

#include "engine/block_physics.h"
#include "engine/lanes/lane_tape.h"

namespace graze {

/// Follows the traces of a block. A pair of colliders touches in a step while any of its points does; impulses of all
/// its points add up, mode and features are those of the most loaded one.
class PhaseTracker {
 public:
  explicit PhaseTracker(const PhaseRules& rules) : rules_(rules) {}
  /// A fresh trace in a lane; forgets everything that was there.
  void start(int lane);
  /// Writes down, or reads back after start(), the lane's phases so far.
  void carry(int lane, LaneTape& tape);
  /// To be called after each step of the active lanes, which has led to `time` s.
  void update(const std::array<double, kLanes>& time, const std::vector<ContactPoint>& points, LaneMask active);
  /// Hands over the phases of the lane's trace, by begin, then parts. Those that are under way end with their last
  /// touch.
  std::vector<ContactPhase> take(int lane);

 private:
  /// A pair that has touched in some lane. Numbers per lane.
  struct Pair {
    int a, b;
    unsigned open = 0;                               // lanes that have a phase, which may be over
    unsigned now = 0;                                // lanes in which it touches in this step
    std::array<double, kLanes> load{};               // normal impulse of this step, where `now`
    std::array<const ContactPoint*, kLanes> most{};  // the most loaded point of this step, where `now`
    std::array<ContactPhase, kLanes> phase{};        // slip and roll count steps
    std::array<double, kLanes> steps{};              // in which it touched
  };
  void find_touching(const std::vector<ContactPoint>& points, unsigned active);
  void follow(Pair& pair, int lane, double time);
  void close(Pair& pair, int lane);

  PhaseRules rules_;
  std::vector<Pair> pairs_;                               // by a, then b
  std::array<std::vector<ContactPhase>, kLanes> phases_;  // that are over
};

/// "LF_FOOT-ground LF_FOOT-curb.side …": the phases in their order, as named parts; the feature is written when the
/// shape has named ones (box, cylinder).
std::string contact_sequence(const Model& nominal, const std::vector<ContactPhase>& phases);

}  // namespace graze
