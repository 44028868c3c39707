#pragma once
// Events: mode switches of a trace (Eq. 2's index sets change). Contact sequences come from them.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "engine/physics.h"

namespace graze {

enum class EventKind : std::uint8_t {
  contact_begin,
  contact_end,
  stick_to_slip,
  slip_to_stick,
  limit_begin,
  limit_end
};
std::string_view event_kind_name(EventKind kind);

struct Event {
  double time = 0;  // s
  EventKind kind = EventKind::contact_begin;
  int a = 0, b = 0;  // colliders, a < b; for a joint limit: a = body, b = -1 lower, +1 upper
  Feature feature_a = Feature::surface, feature_b = Feature::surface;
  double impulse = 0;  // normal impulse over the step in which it happened, N s
  Vec3 p_W = Vec3::Zero();
};

/// Follows one trace. A pair of colliders is in contact while any of its points touches; its mode is that of its most
/// loaded point. Contact has no hysteresis: it begins in the step in which touching() turns true and ends in the one
/// in which it turns false, so a bouncing foot gives as many events as it has bounces. A joint limit begins within
/// 1e-5 rad (or m) of it and ends beyond 1e-4.
class EventTracker {
 public:
  explicit EventTracker(const Model& nominal);
  void start();  // a fresh trace; forgets everything
  /// To be called after each step; appends to `events`. Order within a step: by pair, ends before beginnings.
  void update(double time, const std::vector<Contact>& contacts, const BlockState& state, int lane,
              std::vector<Event>& events);

 private:
  struct Pair {
    bool touching = false;
    ContactMode mode = ContactMode::stick;
  };
  void end_contacts(double time, const std::vector<const Contact*>& touching, std::vector<Event>& events);

  std::map<std::pair<int, int>, Pair> pairs_;
  struct Limit {
    int body, q;
    double lower, upper;
    int side;
  };
  std::vector<Limit> limits_;
};

/// "LF_FOOT-ground LF_FOOT-curb.side …": beginnings of contact in order, as named parts; the feature is written when
/// the shape has named ones (box, cylinder).
std::string contact_sequence(const Model& nominal, const std::vector<Event>& events);

}  // namespace graze
