// Events and contact sequences from scripted contacts, and features from points.

#include "engine/contact/events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "engine/contact/features.h"
#include "engine/contact/phases.h"
#include "tests/engine/bullet/worlds.h"

namespace graze::test {
namespace {

/// Two feet (0, 1), a curb (2) and the ground (3); one joint with limits.
Model script_model() {
  Model model;
  const auto add = [&](const std::string& name, const Shape& shape) {
    Collider collider;
    collider.name = name;
    collider.shape = shape;
    model.colliders.push_back(collider);
  };
  add("LF_FOOT", sphere(0.01));
  add("RF_FOOT", sphere(0.01));
  add("curb", box(1, 0.01, 0.04));
  add("ground", plane());
  Body body;
  body.type = JointType::revolute;
  body.lower = -1;
  body.upper = 1;
  model.bodies.push_back(body);
  model.nq = model.nv = 1;
  return model;
}

Contact touch(int a, int b, double push, ContactMode mode = ContactMode::stick, Feature feature_b = Feature::surface) {
  Contact contact;
  contact.a = a;
  contact.b = b;
  contact.phi = push > 0 ? 0.0 : 1e-3;
  contact.impulse_W = {0, 0, push};
  contact.mode = mode;
  contact.feature_b = feature_b;
  return contact;
}

class Events : public testing::Test {
 protected:
  static constexpr int kLane = 2;

  Events() : model(script_model()), tracker(model) { state.q = BlockArray(1); }

  /// Kinds and pairs of what one more step adds, as "kind a b".
  std::vector<std::string> step(const std::vector<Contact>& contacts) {
    const std::size_t before = events().size();
    lists[kLane] = contacts;
    time[kLane] += 0.001;
    tracker.update(time, points = lists.gather(), state, LaneMask(1u << kLane));
    std::vector<std::string> out;
    for (std::size_t i = before; i < events().size(); ++i) {
      EXPECT_EQ(events()[i].time, time[kLane]);
      out.push_back(text(events()[i]));
    }
    return out;
  }

  static std::string text(const Event& event) {
    return std::string(event_kind_name(event.kind)) + " " + std::to_string(event.a) + " " + std::to_string(event.b);
  }

  const std::vector<Event>& events() const { return tracker.events(kLane); }

  Model model;
  EventTracker tracker;
  BlockState state;
  ContactLists lists;
  std::vector<ContactPoint> points;
  std::array<double, kLanes> time{};
};

using ::testing::ElementsAre;
using testing::IsEmpty;

// A contact begins when a pair first touches, whatever the number of its points, and ends when none does. Near points
// that do not press are no contact.
TEST_F(Events, ContactsBeginAndEnd) {
  EXPECT_THAT(step({touch(0, 3, 0)}), IsEmpty());
  EXPECT_THAT(step({touch(0, 3, 1), touch(0, 3, 2)}), ElementsAre("contact_begin 0 3"));
  EXPECT_EQ(events()[0].impulse, 2) << "of the most loaded point";
  EXPECT_THAT(step({touch(0, 3, 1)}), IsEmpty());
  EXPECT_THAT(step({touch(0, 3, 0)}), ElementsAre("contact_end 0 3"));
  EXPECT_THAT(step({touch(0, 3, 1)}), ElementsAre("contact_begin 0 3"));
}

// Within a step: ends before beginnings, each by pair, whatever the order of the contacts.
TEST_F(Events, EndsComeBeforeBeginningsByPair) {
  step({touch(0, 3, 1), touch(1, 2, 1)});
  EXPECT_THAT(step({touch(1, 3, 1), touch(0, 2, 1)}),
              ElementsAre("contact_end 0 3", "contact_end 1 2", "contact_begin 0 2", "contact_begin 1 3"));
}

// The mode of a pair is that of its most loaded point.
TEST_F(Events, ModeFollowsTheMostLoadedPoint) {
  step({touch(0, 3, 1)});
  EXPECT_THAT(step({touch(0, 3, 2), touch(0, 3, 1, ContactMode::slip)}), IsEmpty());
  EXPECT_THAT(step({touch(0, 3, 1), touch(0, 3, 2, ContactMode::slip)}), ElementsAre("stick_to_slip 0 3"));
  EXPECT_THAT(step({touch(0, 3, 1)}), ElementsAre("slip_to_stick 0 3"));
}

// A joint limit begins at the limit and ends only well off it: rounding at the limit does not chatter.
TEST_F(Events, LimitsBeginAndEndWithoutChatter) {
  const auto at_q = [&](double q) {
    state.q(0, kLane) = q;
    return step({});
  };
  EXPECT_THAT(at_q(0.9), IsEmpty());
  EXPECT_THAT(at_q(1.0), ElementsAre("limit_begin 0 1"));
  EXPECT_THAT(at_q(1 - 2e-5), IsEmpty());
  EXPECT_THAT(at_q(1 + 1e-3), IsEmpty());
  EXPECT_THAT(at_q(0.5), ElementsAre("limit_end 0 1"));
  EXPECT_THAT(at_q(-1.0), ElementsAre("limit_begin 0 -1"));
  EXPECT_THAT(at_q(1.0), ElementsAre("limit_end 0 -1", "limit_begin 0 1"));
}

// start() forgets: the same contact begins again.
TEST_F(Events, StartForgets) {
  step({touch(0, 3, 1)});
  tracker.start(kLane, model);
  EXPECT_THAT(events(), IsEmpty());
  EXPECT_THAT(step({touch(0, 3, 1)}), ElementsAre("contact_begin 0 3"));
}

// A particle has its own limits.
TEST_F(Events, LimitsAreThoseOfTheParticle) {
  model.bodies[0].upper = 0.5;
  tracker.start(kLane, model);
  state.q(0, kLane) = 0.5;
  EXPECT_THAT(step({}), ElementsAre("limit_begin 0 1"));
}

// Each lane's events are those that it would have alone: lanes that begin, end, rest and start at other times change
// none of them.
TEST_F(Events, LanesDoNotDisturbEachOther) {
  std::mt19937 random(3);
  const auto chance = [&](unsigned one_in) { return random() % one_in == 0; };
  std::vector<EventTracker> alone(kLanes, EventTracker(model));
  std::size_t seen = 0;
  for (int i = 0; i < 300; ++i) {
    LaneMask active(random() & 0xff);
    for (int lane = 0; lane < kLanes; ++lane) {
      lists[lane].clear();
      for (int a = 0; a < 2; ++a) {
        for (int b = 2; b < 4; ++b) {
          for (int k = 0; k < 2; ++k) {
            const double push = chance(2) ? 0.0 : 1.0 + random() % 3;
            if (chance(2)) lists[lane].push_back(touch(a, b, push, chance(3) ? ContactMode::slip : ContactMode::stick));
          }
        }
      }
      state.q(0, lane) = chance(3) ? 1.0 : chance(3) ? -1.0 : 0.0;
      time[lane] += lane;
      if (!chance(50)) continue;
      tracker.start(lane, model);
      alone[lane].start(lane, model);
    }
    points = lists.gather();
    tracker.update(time, points, state, active);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane]) alone[lane].update(time, points, state, LaneMask(1u << lane));
      std::vector<std::string> together, apart;
      for (const Event& event : tracker.events(lane)) together.push_back(text(event));
      for (const Event& event : alone[lane].events(lane)) apart.push_back(text(event));
      ASSERT_EQ(together, apart) << "lane " << lane << ", step " << i;
      seen += together.size();
    }
  }
  EXPECT_GT(seen, 1000u);
}

// Sequences name the phases in order, with the feature where the shape has named ones.
TEST_F(Events, SequenceNamesPartsAndFeatures) {
  const auto phase = [](int a, int b, Feature feature_b) {
    ContactPhase out;
    out.a = a;
    out.b = b;
    out.feature_b = feature_b;
    return out;
  };
  EXPECT_EQ(
      contact_sequence(model, {phase(0, 3, Feature::surface), phase(1, 2, Feature::side), phase(0, 2, Feature::edge)}),
      "LF_FOOT-ground RF_FOOT-curb.side LF_FOOT-curb.edge");
  EXPECT_EQ(contact_sequence(model, {}), "");
}

// Points on a box and a cylinder are named by the faces that they lie on.
TEST(Features, OfBoxAndCylinder) {
  const Shape b = box(0.2, 0.4, 0.6), c = cylinder(0.1, 0.5);
  EXPECT_EQ(feature_of(b, {0, 0, 0.3}), Feature::top);
  EXPECT_EQ(feature_of(b, {0.01, 0.1, -0.3}), Feature::bottom);
  EXPECT_EQ(feature_of(b, {0.1, 0, 0}), Feature::side);
  EXPECT_EQ(feature_of(b, {0, -0.2, 0.1}), Feature::side);
  EXPECT_EQ(feature_of(b, {0.1, 0, 0.3}), Feature::edge);
  EXPECT_EQ(feature_of(b, {0.1, 0.2, 0}), Feature::edge);
  EXPECT_EQ(feature_of(b, {-0.1, 0.2, -0.3}), Feature::vertex);
  EXPECT_EQ(feature_of(b, {0, 0, 0.31}), Feature::top) << "points may stand off by a gap";
  EXPECT_EQ(feature_of(c, {0.1, 0, 0}), Feature::side);
  EXPECT_EQ(feature_of(c, {0.05, 0, 0.25}), Feature::cap);
  EXPECT_EQ(feature_of(c, {0, 0.1, -0.25}), Feature::rim);
  EXPECT_EQ(feature_of(sphere(0.1), {0, 0, 0.1}), Feature::surface);
}

}  // namespace
}  // namespace graze::test
