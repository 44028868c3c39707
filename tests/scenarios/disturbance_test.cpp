// `disturbances` of a scenario: what is read, and what is refused with its place and the nearest right answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenarios/disturbances.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using testing::hopper;
using testing::message_of;

// Claim: every number of a disturbance is a parameter like any other, in place or under `uncertain`.
TEST(Disturbance, NumbersAreParameters) {
  const Scenario scenario =
      testing::read(hopper("disturbances:\n"
                           "  shove: {push: base, impulse: {uniform: [1 N s, 3 N s]}, azimuth: 90 deg, at: 0.1 s}\n"
                           "  sack: {payload: base, mass: 2 kg, at: 0.5 s, point: [0, 0, 10 cm]}\n"
                           "uncertain: {disturbances.shove.at: {uniform: [0.1 s, 0.3 s]}, disturbances.sack.point.z: "
                           "{normal: {std: 1 cm}}}\n"));
  std::vector<std::string> names;
  for (const UncertainParameter& one : scenario.space.parameters) names.push_back(one.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("disturbances.shove.at", "disturbances.shove.impulse",
                                                     "disturbances.sack.point.z"));
  ASSERT_EQ(scenario.world->disturbances.size(), 2u);
  EXPECT_DOUBLE_EQ(scenario.world->disturbances[0].strength, 2) << "the mean is the nominal value";
  EXPECT_DOUBLE_EQ(scenario.world->disturbances[1].point.z(), 0.1);
  const Fabricator fabricator(scenario.world, {"disturbances.shove.azimuth"});
  const Particle particle = fabricator.fabricate(0, std::vector<double>{0.0});
  EXPECT_NEAR((particle.disturbances[0].impulse_W - Vec3(2, 0, 0)).norm(), 0, 1e-12);
}

// Claim: a message says where, what and what would be right.
TEST(Disturbance, RefusesWhatCannotBe) {
  const std::vector<std::pair<const char*, const char*>> cases = {
      {"{push: bas, impulse: 1, at: 0}", "no link or movable object of that name; nearest: base"},
      {"{push: block, impulse: 1, at: 0}", "no link or movable object"},
      {"{impulse: 1, at: 0}", "says neither 'push: LINK' nor 'payload: LINK'"},
      {"{push: base, payload: base, at: 0}", "a second kind beside 'push'"},
      {"{push: base, impulse: 1}", "at"},
      {"{push: base, at: 0}", "either an 'impulse', or a 'force' with a 'duration'"},
      {"{push: base, impulse: 1, force: 1, duration: 1, at: 0}", "either an 'impulse', or a 'force'"},
      {"{push: base, force: 1, at: 0}", "a force needs a 'duration'"},
      {"{push: base, impulse: 1 N, at: 0}", "the unit 'N' does not fit; one of: N s"},
      {"{push: base, impulse: 1, at: -1 s}", "-1"},
      {"{push: base, impulse: 1, at: 0, azimut: 1}", "did you mean 'azimuth'?"},
      {"{push: base, impulse: 1, at: 0, mass: 1}", "is for a payload"},
      {"{payload: base, at: 0, mass: 1, force: 1}", "is for a push"},
      {"{payload: base, at: 0}", "mass"},
      {"{payload: base, at: 0, mass: -1 kg}", "-1"},
      {"{payload: base, at: 0, mass: 1e12 kg}", "1e+09"},
      {"{push: base, impulse: 1e300, at: 0}", "1e+12"}};
  for (const auto& [value, message] : cases) {
    const std::string text = hopper(std::string("disturbances:\n  one: ") + value + "\n");
    const std::string got = message_of([&] { testing::read(text); });
    EXPECT_THAT(got, HasSubstr(message)) << value;
    EXPECT_THAT(got, HasSubstr("test.yaml:7:")) << value;
  }
  EXPECT_THAT(message_of([&] { testing::read(hopper("disturbances: {a.b: {push: base, impulse: 1, at: 0}}\n")); }),
              HasSubstr("a name with none of"));
}

// Claim: what comes after the end of the trace is warned of.
TEST(Disturbance, WarnsOfWhatComesTooLate) {
  const Scenario scenario = testing::read(hopper("disturbances: {late: {push: base, impulse: 1, at: 2 s}}\n"));
  EXPECT_THAT(scenario.warnings, ::testing::Contains(HasSubstr("the trace is over after 1 s")));
  // What each particle draws counts, not what is written where it is drawn for.
  const Scenario drawn =
      testing::read(hopper("disturbances: {late: {push: base, impulse: 1, at: 2 s}}\n"
                           "uncertain: {disturbances.late.at: {uniform: [0.1 s, 0.3 s]}}\n"));
  EXPECT_THAT(drawn.warnings, ::testing::Each(::testing::Not(HasSubstr("the trace is over"))));
}

// Claim: `check` tells what is drawn, from where and to where.
TEST(Disturbance, TellsWhatIsDrawn) {
  const Scenario scenario = testing::read(
      hopper("disturbances: {shove: {push: base, impulse: 0.5, azimuth: 90 deg, at: {uniform: [0.1 s, 0.3 s]}, "
             "point: [0, 0, 1 cm]}}\n"
             "uncertain: {disturbances.shove.impulse: {uniform: [0.2, 1.6]}}\n"));
  const std::string text = disturbance_text(scenario.world->disturbances[0], scenario.space);
  EXPECT_THAT(text, ::testing::AllOf(HasSubstr("push of base at (0, 0, 0.01) m by "), HasSubstr("min=0.2, max=1.6"),
                                     HasSubstr("towards azimuth 1.5708 rad at "), HasSubstr("0.1"), HasSubstr("0.3")));
}

}  // namespace
}  // namespace graze
