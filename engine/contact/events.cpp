#include "engine/contact/events.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace graze {
namespace {

/// A joint is at a limit from this near (rad or m), and has left it when it is farther than the second: a limit holds
/// a joint to rounding only, which must not chatter.
constexpr double kAtLimit = 1e-5, kOffLimit = 1e-4;

/// The most loaded touching point of each pair, by pair.
std::vector<const Contact*> most_loaded(const std::vector<Contact>& contacts) {
  std::vector<const Contact*> out;
  for (const Contact& contact : contacts) {
    if (contact.touching()) out.push_back(&contact);
  }
  const auto pair_of = [](const Contact* c) { return std::pair(c->a, c->b); };
  std::stable_sort(out.begin(), out.end(), [&](const Contact* x, const Contact* y) {
    if (pair_of(x) != pair_of(y)) return pair_of(x) < pair_of(y);
    return x->normal_impulse() > y->normal_impulse();
  });
  const auto same = [&](const Contact* x, const Contact* y) { return pair_of(x) == pair_of(y); };
  out.erase(std::unique(out.begin(), out.end(), same), out.end());
  return out;
}

bool named_features(ShapeKind kind) { return kind == ShapeKind::box || kind == ShapeKind::cylinder; }

std::string part(const Model& model, int collider, Feature feature) {
  const Collider& c = model.colliders[collider];
  if (!named_features(c.shape.kind)) return c.name;
  return c.name + "." + std::string(feature_name(feature));
}

Event event_at(double time, EventKind kind, const Contact& contact) {
  return {time,       kind, contact.a, contact.b, contact.feature_a, contact.feature_b, contact.normal_impulse(),
          contact.p_W};
}

/// Which side of its limits a joint is on: -1 at the lower, +1 at the upper, 0 between.
int side_of(double q, double lower, double upper, int side) {
  if (q - lower < (side < 0 ? kOffLimit : kAtLimit)) return -1;
  if (upper - q < (side > 0 ? kOffLimit : kAtLimit)) return 1;
  return 0;
}

Event limit_event(double time, EventKind kind, int body, int side) {
  Event event;
  event.time = time;
  event.kind = kind;
  event.a = body;
  event.b = side;
  return event;
}

}  // namespace

std::string_view event_kind_name(EventKind kind) {
  static constexpr std::array<std::string_view, 6> names = {"contact_begin", "contact_end", "stick_to_slip",
                                                            "slip_to_stick", "limit_begin", "limit_end"};
  return names[static_cast<std::size_t>(kind)];
}

EventTracker::EventTracker(const Model& nominal) {
  for (int i = 0; i < static_cast<int>(nominal.bodies.size()); ++i) {
    const Body& body = nominal.bodies[i];
    if (body.type == JointType::floating) continue;
    if (std::isfinite(body.lower) || std::isfinite(body.upper)) {
      limits_.push_back({i, body.q, body.lower, body.upper, 0});
    }
  }
}

void EventTracker::start() {
  pairs_.clear();
  for (Limit& limit : limits_) limit.side = 0;
}

void EventTracker::update(double time, const std::vector<Contact>& contacts, const BlockState& state, int lane,
                          std::vector<Event>& events) {
  const std::vector<const Contact*> touching = most_loaded(contacts);
  end_contacts(time, touching, events);
  for (const Contact* contact : touching) {
    Pair& pair = pairs_[{contact->a, contact->b}];
    if (!pair.touching) {
      events.push_back(event_at(time, EventKind::contact_begin, *contact));
    } else if (pair.mode != contact->mode) {
      const bool slips = contact->mode == ContactMode::slip;
      events.push_back(event_at(time, slips ? EventKind::stick_to_slip : EventKind::slip_to_stick, *contact));
    }
    pair = {true, contact->mode};
  }
  for (Limit& limit : limits_) {
    const int side = side_of(state.q(limit.q, lane), limit.lower, limit.upper, limit.side);
    if (side == limit.side) continue;
    if (limit.side != 0) events.push_back(limit_event(time, EventKind::limit_end, limit.body, limit.side));
    if (side != 0) events.push_back(limit_event(time, EventKind::limit_begin, limit.body, side));
    limit.side = side;
  }
}

void EventTracker::end_contacts(double time, const std::vector<const Contact*>& touching, std::vector<Event>& events) {
  auto next = touching.begin();
  for (auto& [key, pair] : pairs_) {
    while (next != touching.end() && std::pair((*next)->a, (*next)->b) < key) ++next;
    const bool still = next != touching.end() && std::pair((*next)->a, (*next)->b) == key;
    if (!pair.touching || still) continue;
    pair.touching = false;
    Event event;
    event.time = time;
    event.kind = EventKind::contact_end;
    event.a = key.first;
    event.b = key.second;
    events.push_back(event);
  }
}

std::string contact_sequence(const Model& nominal, const std::vector<Event>& events) {
  std::string out;
  for (const Event& event : events) {
    if (event.kind != EventKind::contact_begin) continue;
    if (!out.empty()) out += ' ';
    out += part(nominal, event.a, event.feature_a) + "-" + part(nominal, event.b, event.feature_b);
  }
  return out;
}

}  // namespace graze
