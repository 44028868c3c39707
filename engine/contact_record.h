#pragma once
// Plain records of contacts and events, as every back end tells them and archives keep them. Units are SI; points and
// vectors are in world coordinates (_W).

#include <cstdint>
#include <string_view>

#include "engine/model/geometry.h"

namespace graze {

/// Which part of a shape touches. Boxes: face, edge, vertex; cylinders: cap, side, rim; everything else: surface.
enum class Feature : std::uint8_t { surface, top, bottom, side, edge, vertex, cap, rim };
std::string_view feature_name(Feature feature);  // "side"

/// What a contact point does while it presses. `slip`: the impulse lies on the friction cone (and the bodies slide, as
/// far as the back end can tell). `roll`: it sticks, but moves over a round surface of radius r faster than kRollSpeed.
/// With w the relative angular velocity of the bodies at the end of the step that speed is r |w - n (n . w)| on a
/// sphere, and r |w . axis| on a capsule and on the side of a cylinder. `stick`: everything else.
enum class ContactMode : std::uint8_t { stick, slip, roll };

/// One contact point (or near point: phi > 0 and no impulse) after a step.
struct Contact {
  int a = 0, b = 0;  // colliders, a < b
  Feature feature_a = Feature::surface, feature_b = Feature::surface;
  Vec3 p_W = Vec3::Zero();        // point, world
  Vec3 n_W = Vec3::UnitZ();       // unit normal from b to a
  double phi = 0;                 // signed gap, m; negative: penetration
  Vec3 impulse_W = Vec3::Zero();  // on a over the last step, N s
  ContactMode mode = ContactMode::stick;
  double age = 0;  // s from the first touch within the step to its end, 0..h (h: it touched at the beginning)

  double normal_impulse() const { return impulse_W.dot(n_W); }
  /// Bodies touch: they press on each other, or overlap.
  bool touching() const { return phi <= 0 || normal_impulse() > 0; }
};

/// A mode switch of a trace (Eq. 2: an index set changes).
enum class EventKind : std::uint8_t {
  contact_begin,
  contact_end,
  stick_to_slip,
  slip_to_stick,
  limit_begin,
  limit_end,
  stick_to_roll,
  roll_to_stick,
  slip_to_roll,
  roll_to_slip
};
std::string_view event_kind_name(EventKind kind);

struct Event {
  double time = 0;  // s: the end of the step; contact_begin: of the first touch within it
  EventKind kind = EventKind::contact_begin;
  int a = 0, b = 0;  // colliders, a < b; for a joint limit: a = body, b = -1 lower, +1 upper
  Feature feature_a = Feature::surface, feature_b = Feature::surface;
  double impulse = 0;  // normal impulse over the step in which it happened, N s
  Vec3 p_W = Vec3::Zero();
};

/// Two parts in contact, from a touch-down to a lift-off. Touches of the two that follow each other closely are one
/// phase (PhaseRules).
struct ContactPhase {
  double begin = 0, end = 0;  // s: the first touch; the end of the last step in which they touched
  int a = 0, b = 0;           // colliders, a < b
  Feature feature_a = Feature::surface, feature_b = Feature::surface;  // where they pressed most
  double peak = 0;                                                     // largest normal impulse of one step, N s
  double impulse = 0;                                                  // normal impulse of all steps, N s
  double slip = 0, roll = 0;  // shares of the steps in which they touched; the rest is stick
};

/// What makes a phase of touches of two parts.
struct PhaseRules {
  double gap = 0;      // s: a touch that follows the one before within this time continues its phase
  double dwell = 0;    // s   } a phase that is shorter than `dwell` and carries less than `impulse` is none
  double impulse = 0;  // N s }
};

}  // namespace graze
