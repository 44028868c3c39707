// Kinds of unknown failures that were planted: how many there are, who is in them, what would have caught them.
#include "analysis/unknown_failures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "scenarios/task.h"
#include "tests/analysis/planted_archive.h"
#include "tests/engine/bullet/worlds.h"

namespace graze {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

/// `kind(i)`: 0: trace i succeeds; 1: the base lies low and far to one side; 2: LF_FOOT strikes the curb.
template <class Kind>
UnknownFailures planted(std::uint32_t traces, const Kind& kind,
                        const std::string& objective = "tilt of body below 1 rad") {
  const synthetic::Folder folder;
  CampaignInfo info = synthetic::info();
  info.policies = {"walk"};
  info.particles = traces;
  info.q_names = {"base.qw", "base.qx", "base.qy", "base.qz", "base.x", "base.y", "base.z", "hip", "knee"};
  info.links = {"body"};
  info.leaves = {{"", "no contact between LF_FOOT and ground", "m"}, {"", objective, "m"}};
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.01);
  planted::write(folder / "a.graze", info, [&](std::uint32_t i) {
    const int what = kind(i);
    TraceRecord record = planted::plain_trace(info, 0, i, what == 0 ? Outcome::success : Outcome::unknown_failure);
    for (double& margin : record.margins) margin = 1 + noise(random);
    record.q = {1, 0, 0, 0, 0.5 + noise(random), noise(random), 0.3 + noise(random), noise(random), noise(random)};
    if (what == 1) record.q[5] = 0.4 + noise(random), record.q[6] = 0.1 + noise(random);
    if (what == 2) record.q[7] = 0.5 + noise(random);
    ContactPhase touch;
    touch.a = 0;
    touch.b = 2;
    touch.end = 0.1;
    touch.impulse = 1 + noise(random);
    record.phases.push_back(touch);
    if (what == 2) {
      touch.b = 1;
      record.phases.push_back(touch);
    }
    return record;
  });
  return unknown_failures(Archive(folder / "a.graze"), "walk");
}

TEST(UnknownFailures, AreDividedIntoThePlantedKinds) {
  const UnknownFailures got = planted(200, [](std::uint32_t i) { return i % 10 < 5 ? 0 : i % 10 < 8 ? 1 : 2; });
  EXPECT_EQ(got.traces, 100u);
  EXPECT_EQ(got.successes, 100u);
  ASSERT_THAT(got.kinds, SizeIs(2));
  EXPECT_GT(got.silhouette, 0.5);
  EXPECT_EQ(got.kinds[0].traces, 60u);
  for (const std::uint32_t particle : got.kinds[0].particles) EXPECT_LT(particle % 10, 8u);
  for (const std::uint32_t particle : got.kinds[1].particles) EXPECT_GE(particle % 10, 8u);
  EXPECT_THAT(got.kinds[0].traits[0].name, AnyOf("base.y", "base.z"));
  ASSERT_FALSE(got.kinds[0].witnesses.empty());
  EXPECT_THAT(got.kinds[0].witnesses[0].yaml,
              AnyOf(HasSubstr("position: {link: body, y: {below: 0."), HasSubstr("height: {link: body, above: 0.")));
  EXPECT_EQ(got.kinds[0].witnesses[0].caught, got.kinds[0].witnesses[0].of);
  EXPECT_EQ(got.kinds[0].witnesses[0].alarms, 0u);
  ASSERT_FALSE(got.kinds[1].witnesses.empty());
  EXPECT_THAT(got.kinds[1].witnesses[0].yaml, StartsWith("no_contact: ["));
  const std::string text = format_unknown_failures({got}, "a.graze", true);
  EXPECT_THAT(text, HasSubstr("walk: 100 unknown failures, 2 kinds"));
  EXPECT_THAT(text, HasSubstr("typical: graze replay a.graze --particle "));
  EXPECT_THAT(unknown_failures_json({got}, "a.graze", true), HasSubstr("\"requirement\": \"no_contact: ["));
}

// What is proposed can be written under task.requirements as it stands.
TEST(UnknownFailures, ProposeWhatAScenarioTakes) {
  const UnknownFailures got = planted(200, [](std::uint32_t i) { return i % 10 < 5 ? 0 : 1; });
  ASSERT_THAT(got.kinds, SizeIs(1));
  const Model model = compile(test::free_body(test::sphere(0.1), 1));
  int places = 0;
  for (const ProposedWitness& one : got.kinds[0].witnesses) {
    if (!one.yaml.starts_with("position: ") && !one.yaml.starts_with("height: ")) continue;
    ++places;
    const Task task = read_task(Settings::parse("requirements: {made: {" + one.yaml + "}}", "task.yaml"), model);
    EXPECT_THAT(task.requirements, SizeIs(1)) << one.yaml;
  }
  EXPECT_GT(places, 0);
}

// Claim: what the objective judges already is told apart from what is new, and stands behind it.
TEST(UnknownFailures, ProposeLastWhatTheObjectiveHas) {
  const auto kind = [](std::uint32_t i) { return i % 10 < 5 ? 0 : 1; };
  const auto restated = [&](const std::string& objective) {
    const UnknownFailures got = planted(200, kind, objective);
    std::string out;
    for (const ProposedWitness& one : got.kinds.at(0).witnesses) {
      out += one.yaml.substr(0, one.yaml.find(':')) + (one.in_objective ? "! " : " ");
    }
    const std::string text = format_unknown_failures({got}, "a", true);
    EXPECT_EQ(out.find('!') != std::string::npos,
              text.find("the objective judges this already\n") != std::string::npos);
    const std::string json = unknown_failures_json({got}, "a", true);
    EXPECT_EQ(out.find('!') != std::string::npos, json.find("\"in_objective\": true") != std::string::npos);
    return out;
  };
  EXPECT_EQ(restated("tilt of body below 1 rad"), "position height ");
  EXPECT_EQ(restated("body y > -0.1 m and y < 0.2 m"), "height position! ");
  EXPECT_EQ(restated("bo* x > 0 m, y < 0.2 m and z > 0.2 m"), "position! height! ");
  EXPECT_EQ(restated("{body,head} z > 0.2 m"), "position height! ");
  EXPECT_EQ(restated("head y < 0.2 m"), "position height ") << "another link";
  EXPECT_EQ(restated("body y < 0.2 m, from 1 to 2 s"), "position height ") << "not at the end";
  const auto struck = [](std::uint32_t i) { return i % 10 < 5 ? 0 : 2; };
  const auto strike = [&](const std::string& objective) {
    std::vector<std::string> out;
    const UnknownFailures got = planted(200, struck, objective);
    for (const ProposedWitness& one : got.kinds.at(0).witnesses) {
      if (one.in_objective) out.push_back(one.yaml.substr(0, one.yaml.find(':')));
    }
    return out;
  };
  EXPECT_THAT(strike("no contact between *_FOOT and curb"), ::testing::ElementsAre("no_contact"));
  EXPECT_THAT(strike("impulse between curb and LF_FOOT below 1 N s"), ::testing::ElementsAre("contact_impulse"));
  EXPECT_THAT(strike("no contact between RF_FOOT and curb"), IsEmpty());
}

// Of what is rare nothing can be learned and tried; that is said, and is something else than having found nothing.
TEST(UnknownFailures, OfFewTracesAreNotJudged) {
  const UnknownFailures got = planted(60, [](std::uint32_t i) { return i % 10 == 0 ? 1 : 0; });
  ASSERT_THAT(got.kinds, SizeIs(1));
  EXPECT_FALSE(got.kinds[0].tried);
  const std::string text = format_unknown_failures({got}, "a", false);
  EXPECT_THAT(text, StartsWith("INCOMPLETE: "));
  EXPECT_THAT(text, HasSubstr("too few traces to choose a requirement on and to try it"));
  EXPECT_THAT(text, Not(HasSubstr("no simple requirement")));
}

// Claim: failures that differ by nothing but noise are of one kind, and no requirement is proposed that would catch
// them.
TEST(UnknownFailures, ThatAreLikeTheSuccessesAreOfOneKind) {
  const UnknownFailures got = planted(200, [](std::uint32_t i) { return i % 4 < 2 ? 0 : 3; });
  ASSERT_THAT(got.kinds, SizeIs(1));
  EXPECT_EQ(got.silhouette, 0);
  EXPECT_THAT(got.kinds[0].witnesses, IsEmpty());
  EXPECT_THAT(format_unknown_failures({got}, "a", true),
              HasSubstr("no simple requirement tells it from the successes"));
}

TEST(UnknownFailures, WithoutSuccessesHaveNoRequirementProposed) {
  const UnknownFailures got = planted(20, [](std::uint32_t i) { return 1 + static_cast<int>(i % 2); });
  EXPECT_THAT(got.kinds, SizeIs(2));
  EXPECT_THAT(got.kinds[0].witnesses, IsEmpty());
  EXPECT_THAT(format_unknown_failures({got}, "a", true), Not(HasSubstr("would have caught")));
  EXPECT_THAT(planted(5, [](std::uint32_t) { return 0; }).kinds, IsEmpty());
}

}  // namespace
}  // namespace graze
