// Contact phases of made-up contact points: what is one phase, what is none, and what each tells.
#include "engine/contact/phases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace graze {
namespace {

using ::testing::DoubleNear;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kStep = 1e-3;

Contact touch(int a, int b, double impulse, ContactMode mode = ContactMode::stick, Feature feature = Feature::surface) {
  Contact out;
  out.a = a;
  out.b = b;
  out.phi = impulse > 0 ? 0 : 1e-3;
  out.impulse_W = Vec3(0, 0, impulse);
  out.mode = mode;
  out.feature_b = feature;
  out.age = kStep;
  return out;
}

/// Steps a tracker through contacts of each lane.
class Contacts {
 public:
  explicit Contacts(const PhaseRules& rules) : tracker(rules) {
    for (int lane = 0; lane < kLanes; ++lane) tracker.start(lane);
  }
  /// `count` steps with these contacts in lane 0.
  void steps(int count, const std::vector<Contact>& contacts, int lane = 0) {
    LaneMask active;
    active.set(lane);
    for (int i = 0; i < count; ++i) {
      ContactLists lists;
      lists[lane] = contacts;
      std::array<double, kLanes> now{};
      now[lane] = ++done_[lane] * kStep;
      const std::vector<ContactPoint> points = lists.gather();
      tracker.update(now, points, active);
    }
  }
  std::vector<ContactPhase> take(int lane = 0) { return tracker.take(lane); }

  PhaseTracker tracker;

 private:
  std::array<int, kLanes> done_{};
};

TEST(Phases, LastFromTouchDownToLiftOff) {
  Contacts contacts({0.02, 0, 0});
  contacts.steps(10, {});
  contacts.steps(30, {touch(0, 1, 0.5)});
  contacts.steps(25, {});
  contacts.steps(5, {touch(0, 1, 0.25)});
  const std::vector<ContactPhase> phases = contacts.take();
  ASSERT_THAT(phases, SizeIs(2));
  EXPECT_NEAR(phases[0].begin, 0.010, 1e-12);
  EXPECT_NEAR(phases[0].end, 0.040, 1e-12);
  EXPECT_NEAR(phases[0].impulse, 15, 1e-12);
  EXPECT_EQ(phases[0].peak, 0.5);
  EXPECT_NEAR(phases[1].begin, 0.065, 1e-12);
  EXPECT_NEAR(phases[1].end, 0.070, 1e-12) << "under way at the end: it ends with the last touch";
}

TEST(Phases, GoOnOverGapsOfTheGapTimeAndNotBeyond) {
  for (const int gap : {1, 19, 20, 21}) {
    Contacts contacts({0.02, 0, 0});
    contacts.steps(5, {touch(0, 1, 1)});
    contacts.steps(gap, {touch(0, 1, 0)});  // a near point that does not touch
    contacts.steps(5, {touch(0, 1, 1)});
    EXPECT_THAT(contacts.take(), SizeIs(gap <= 20 ? 1 : 2)) << gap;
  }
}

TEST(Phases, OfNoGapTimeEndWithTheFirstStepWithoutTouch) {
  Contacts contacts({0, 0, 0});
  contacts.steps(500, {touch(0, 1, 1)});
  EXPECT_THAT(contacts.take(), SizeIs(1)) << "touching on and on is one phase";
  Contacts broken({0, 0, 0});
  broken.steps(5, {touch(0, 1, 1)});
  broken.steps(1, {});
  broken.steps(5, {touch(0, 1, 1)});
  EXPECT_THAT(broken.take(), SizeIs(2));
}

TEST(Phases, ThatAreShortAndLightAreNone) {
  const PhaseRules rules{0.02, 0.005, 1e-3};
  const auto phases = [&](int steps, double impulse) {
    Contacts contacts(rules);
    contacts.steps(steps, {touch(0, 1, impulse)});
    return contacts.take();
  };
  EXPECT_THAT(phases(4, 1e-4), IsEmpty());
  EXPECT_THAT(phases(6, 1e-4), SizeIs(1)) << "long enough";
  EXPECT_THAT(phases(1, 2e-3), SizeIs(1)) << "a blow";
}

TEST(Phases, ShareTheirStepsAmongModes) {
  Contacts contacts({0.02, 0, 0});
  contacts.steps(6, {touch(0, 1, 1)});
  contacts.steps(3, {touch(0, 1, 1, ContactMode::slip)});
  contacts.steps(10, {});  // does not count
  contacts.steps(1, {touch(0, 1, 1, ContactMode::roll)});
  const std::vector<ContactPhase> phases = contacts.take();
  ASSERT_THAT(phases, SizeIs(1));
  EXPECT_THAT(phases[0].slip, DoubleNear(0.3, 1e-15));
  EXPECT_THAT(phases[0].roll, DoubleNear(0.1, 1e-15));
}

TEST(Phases, HaveTheFeatureThatPressedMostAndTheSumOfAllPoints) {
  Contacts contacts({0.02, 0, 0});
  contacts.steps(1, {touch(0, 1, 1, ContactMode::stick, Feature::edge)});
  contacts.steps(1,
                 {touch(0, 1, 2, ContactMode::slip, Feature::side), touch(0, 1, 1, ContactMode::stick, Feature::top)});
  contacts.steps(1, {touch(0, 1, 2.5, ContactMode::stick, Feature::vertex)});
  const std::vector<ContactPhase> phases = contacts.take();
  ASSERT_THAT(phases, SizeIs(1));
  EXPECT_EQ(phases[0].feature_b, Feature::side);
  EXPECT_EQ(phases[0].peak, 3);
  EXPECT_EQ(phases[0].impulse, 6.5);
  EXPECT_THAT(phases[0].slip, DoubleNear(1.0 / 3, 1e-15)) << "the mode of the most loaded point";
}

TEST(Phases, StandInTheOrderOfTheirBeginnings) {
  Contacts contacts({0.005, 0, 0});
  contacts.steps(5, {touch(2, 3, 1)});
  contacts.steps(5, {touch(2, 3, 1), touch(0, 1, 1)});
  contacts.steps(10, {touch(2, 3, 1)});
  contacts.steps(1, {touch(2, 3, 1), touch(0, 1, 1)});
  const std::vector<ContactPhase> phases = contacts.take();
  ASSERT_THAT(phases, SizeIs(3));
  EXPECT_EQ(phases[0].a, 2) << "it ended last";
  EXPECT_EQ(phases[1].a, 0);
  EXPECT_EQ(phases[2].a, 0);
}

TEST(Phases, OfALaneDoNotDependOnItsNeighbours) {
  Contacts alone({0.005, 0, 0}), together({0.005, 0, 0});
  for (Contacts* one : {&alone, &together}) {
    for (int i = 0; i < 100; ++i) {
      if (one == &together) one->steps(1, {touch(i % 3, 3 + i % 2, 0.1 * i)}, 5);
      one->steps(1, {touch(0, 1, i % 40 < 10 ? 0.0 : 1.0 + i)}, 2);
    }
  }
  const std::vector<ContactPhase> a = alone.take(2), b = together.take(2);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_THAT(a, SizeIs(testing::Gt(1u)));
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].begin, b[i].begin);
    EXPECT_EQ(a[i].impulse, b[i].impulse);
    EXPECT_EQ(a[i].end, b[i].end);
  }
}

TEST(Phases, AreForgottenByAFreshTraceAndCarriedByASavedOne) {
  Contacts contacts({0.02, 0, 0});
  contacts.steps(5, {touch(0, 1, 1)});
  contacts.steps(30, {touch(2, 3, 1)});
  LaneTape tape;
  contacts.tracker.carry(0, tape);
  Contacts other({0.02, 0, 0});
  other.steps(7, {touch(4, 5, 1)}, 3);
  const LaneTape::Content content = tape.take();
  LaneTape back(content);
  other.tracker.start(3);
  other.tracker.carry(3, back);
  const std::vector<ContactPhase> want = contacts.take(), got = other.take(3);
  ASSERT_THAT(want, SizeIs(2));
  ASSERT_THAT(got, SizeIs(2));
  EXPECT_EQ(got[1].impulse, want[1].impulse);
  EXPECT_EQ(got[1].begin, want[1].begin);
  contacts.tracker.start(0);
  EXPECT_THAT(contacts.take(), IsEmpty());
}

}  // namespace
}  // namespace graze
