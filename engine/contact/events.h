#pragma once
// Events: mode switches of a trace (Eq. 2's index sets change). What becomes of them as contact phases: phases.h.

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "engine/block_physics.h"
#include "engine/lanes/lane_tape.h"

namespace graze {

/// Follows the traces of a block. A pair of colliders is in contact while any of its points touches; its mode is that
/// of its most loaded point. Contact has no hysteresis: it begins in the step in which touching() turns true and ends
/// in the one in which it turns false, so a bouncing foot gives as many events as it has bounces. A joint limit begins
/// within 1e-5 rad (or m) of it and ends beyond 1e-4.
class EventTracker {
 public:
  explicit EventTracker(const Model& nominal);
  /// A fresh trace in a lane, of a particle with these joint limits; forgets everything that was there.
  void start(int lane, const Model& model);
  /// Writes down, or reads back after start(), what was so far: who touches, limits that were reached, events.
  void carry(int lane, LaneTape& tape);
  /// To be called after each step of the active lanes, which has led to `time` s. Order within a step and lane: by
  /// pair, ends before beginnings, then joints.
  void update(const std::array<double, kLanes>& time, const std::vector<ContactPoint>& points, const BlockState& state,
              LaneMask active);

  /// The events of the lane's trace so far.
  const std::vector<Event>& events(int lane) const { return events_[lane]; }
  /// Hands them over.
  std::vector<Event> take(int lane) { return std::exchange(events_[lane], {}); }

 private:
  /// A pair that touches in some lane, or did before this step. Masks of lanes, numbers per lane.
  struct Pair {
    int a, b;
    unsigned before = 0, now = 0;                     // where it touched after the last step, and touches after this
    std::array<ContactMode, kLanes> mode{};           // after the last step, where `before`
    std::array<const ContactPoint*, kLanes> point{};  // the most loaded of this step, where `now`
  };
  /// A joint that has limits, and which of them each lane is at: -1 lower, +1 upper, 0 none.
  struct Limit {
    int body, q;
    std::array<double, kLanes> lower, upper, side, now;
  };
  void find_touching(const std::vector<ContactPoint>& points, unsigned active);
  unsigned changed_contacts(unsigned active) const;
  unsigned changed_limits(const BlockState& state, unsigned active);
  void add_contact_events(int lane, double time);
  void add_limit_events(int lane, double time);

  std::vector<Pair> pairs_;  // by a, then b
  std::vector<Limit> limits_;
  std::array<std::vector<Event>, kLanes> events_;
};

}  // namespace graze
