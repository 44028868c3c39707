#include "engine/contact/events.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/contact/pair_list.h"

namespace graze {
namespace {

/// A joint is at a limit from this near (rad or m), and has left it when it is farther than the second: a limit holds
/// a joint to rounding only, which must not chatter (our choices).
constexpr double kAtLimit = 1e-5, kOffLimit = 1e-4;

Event event_at(double time, EventKind kind, const ContactPoint& point, int lane) {
  const Contact contact = point.contact(lane);
  return {time,       kind, contact.a, contact.b, contact.feature_a, contact.feature_b, point(kNormalImpulse, lane),
          contact.p_W};
}

/// An event of which only the two parts are known.
Event plain_event(double time, EventKind kind, int a, int b) {
  Event event;
  event.time = time;
  event.kind = kind;
  event.a = a;
  event.b = b;
  return event;
}

/// Which side of its limits a joint is on: -1 at the lower, +1 at the upper, 0 between.
double side_of(double q, double lower, double upper, double side) {
  const double upper_side = upper - q < (side > 0 ? kOffLimit : kAtLimit) ? 1.0 : 0.0;
  return q - lower < (side < 0 ? kOffLimit : kAtLimit) ? -1.0 : upper_side;
}

/// The event of a change from one mode to another.
EventKind change_of(ContactMode from, ContactMode to) {
  static constexpr EventKind kinds[3][3] = {
      {EventKind::stick_to_slip, EventKind::stick_to_slip, EventKind::stick_to_roll},
      {EventKind::slip_to_stick, EventKind::slip_to_stick, EventKind::slip_to_roll},
      {EventKind::roll_to_stick, EventKind::roll_to_slip, EventKind::roll_to_stick}};
  return kinds[static_cast<int>(from)][static_cast<int>(to)];
}

ContactMode mode_of(const ContactPoint& point, int lane) {
  return static_cast<ContactMode>(static_cast<int>(point(kMode, lane)));
}

}  // namespace

std::string_view event_kind_name(EventKind kind) {
  static constexpr std::array<std::string_view, 10> names = {
      "contact_begin", "contact_end",   "stick_to_slip", "slip_to_stick", "limit_begin",
      "limit_end",     "stick_to_roll", "roll_to_stick", "slip_to_roll",  "roll_to_slip"};
  return names[static_cast<std::size_t>(kind)];
}

EventTracker::EventTracker(const Model& nominal) {
  for (int i = 0; i < static_cast<int>(nominal.bodies.size()); ++i) {
    const Body& body = nominal.bodies[i];
    if (body.type == JointType::floating) continue;
    if (std::isfinite(body.lower) || std::isfinite(body.upper)) limits_.push_back({i, body.q, {}, {}, {}, {}});
  }
  for (int lane = 0; lane < kLanes; ++lane) start(lane, nominal);
}

void EventTracker::start(int lane, const Model& model) {
  events_[lane].clear();
  for (Pair& pair : pairs_) pair.before &= ~(1u << lane);
  for (Limit& limit : limits_) {
    limit.lower[lane] = model.bodies[limit.body].lower;
    limit.upper[lane] = model.bodies[limit.body].upper;
    limit.side[lane] = 0;
  }
}

void EventTracker::update(const std::array<double, kLanes>& time, const std::vector<ContactPoint>& points,
                          const BlockState& state, LaneMask active) {
  find_touching(points, active.bits());
  const unsigned contacts = changed_contacts(active.bits()), limits = changed_limits(state, active.bits());
  if ((contacts | limits) != 0) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (contacts >> lane & 1u) add_contact_events(lane, time[lane]);
      if (limits >> lane & 1u) add_limit_events(lane, time[lane]);
    }
  }
  for (Pair& pair : pairs_) pair.before = (pair.before & ~active.bits()) | pair.now;
  std::erase_if(pairs_, [](const Pair& pair) { return pair.before == 0; });
}

void EventTracker::carry(int lane, LaneTape& tape) {
  const unsigned bit = 1u << lane;
  std::vector<Pair> touching;
  for (const Pair& pair : pairs_) {
    if (pair.before & bit) touching.push_back(pair);
  }
  std::size_t count = touching.size();
  tape.carry(count);
  for (std::size_t i = 0; i < count; ++i) {
    Pair pair = i < touching.size() ? touching[i] : Pair{};
    tape.carry(pair.a), tape.carry(pair.b), tape.carry(pair.mode[lane]);
    if (!tape.reads()) continue;
    Pair& own = entry_of_pair(pairs_, pair.a, pair.b);
    own.before |= bit;
    own.mode[lane] = pair.mode[lane];
  }
  tape.same(static_cast<int>(limits_.size()));
  for (Limit& limit : limits_) tape.carry(limit.side[lane]);
  count = events_[lane].size();
  tape.carry(count);
  if (tape.reads()) events_[lane].clear();
  for (std::size_t i = 0; i < count; ++i) {
    Event& event = tape.reads() ? events_[lane].emplace_back() : events_[lane][i];
    tape.carry(event.time), tape.carry(event.kind), tape.carry(event.a), tape.carry(event.b);
    tape.carry(event.feature_a), tape.carry(event.feature_b), tape.carry(event.impulse);
    for (int k = 0; k < 3; ++k) tape.carry(event.p_W[k]);
  }
}

void EventTracker::find_touching(const std::vector<ContactPoint>& points, unsigned active) {
  for (Pair& pair : pairs_) pair.now = 0;
  for (const ContactPoint& point : points) {
    const unsigned touching = point.touching().bits() & active;
    if (touching == 0) continue;
    Pair& pair = entry_of_pair(pairs_, point.a, point.b);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!(touching >> lane & 1u)) continue;
      const bool loaded = pair.now >> lane & 1u;
      if (loaded && (*pair.point[lane])(kNormalImpulse, lane) >= point(kNormalImpulse, lane)) continue;
      pair.point[lane] = &point;
      pair.now |= 1u << lane;
    }
  }
}

/// Lanes in which some pair begins, ends or changes its mode.
unsigned EventTracker::changed_contacts(unsigned active) const {
  unsigned changed = 0;
  for (const Pair& pair : pairs_) {
    changed |= (pair.before ^ pair.now) & active;
    for (int lane = 0; lane < kLanes; ++lane) {
      if ((pair.before & pair.now) >> lane & 1u) {
        changed |= static_cast<unsigned>(mode_of(*pair.point[lane], lane) != pair.mode[lane]) << lane;
      }
    }
  }
  return changed;
}

/// Lanes in which some joint reaches or leaves a limit; fills Limit::now.
unsigned EventTracker::changed_limits(const BlockState& state, unsigned active) {
  unsigned changed = 0;
  for (Limit& limit : limits_) {
    const double* q = state.q.row(limit.q);
    for (int lane = 0; lane < kLanes; ++lane) {
      limit.now[lane] = side_of(q[lane], limit.lower[lane], limit.upper[lane], limit.side[lane]);
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      changed |= static_cast<unsigned>(limit.now[lane] != limit.side[lane]) << lane;
    }
  }
  return changed & active;
}

void EventTracker::add_contact_events(int lane, double time) {
  const unsigned bit = 1u << lane;
  for (const Pair& pair : pairs_) {
    if ((pair.before & ~pair.now & bit) == 0) continue;
    events_[lane].push_back(plain_event(time, EventKind::contact_end, pair.a, pair.b));
  }
  for (Pair& pair : pairs_) {
    if ((pair.now & bit) == 0) continue;
    const ContactPoint& point = *pair.point[lane];
    const ContactMode mode = mode_of(point, lane);
    if ((pair.before & bit) == 0) {
      events_[lane].push_back(event_at(time - point(kAge, lane), EventKind::contact_begin, point, lane));
    } else if (mode != pair.mode[lane]) {
      events_[lane].push_back(event_at(time, change_of(pair.mode[lane], mode), point, lane));
    }
    pair.mode[lane] = mode;
  }
}

void EventTracker::add_limit_events(int lane, double time) {
  for (Limit& limit : limits_) {
    const int before = static_cast<int>(limit.side[lane]), now = static_cast<int>(limit.now[lane]);
    if (before == now) continue;
    if (before != 0) events_[lane].push_back(plain_event(time, EventKind::limit_end, limit.body, before));
    if (now != 0) events_[lane].push_back(plain_event(time, EventKind::limit_begin, limit.body, now));
    limit.side[lane] = limit.now[lane];
  }
}

}  // namespace graze
