// graze events through the command line: what it prints and refuses, and novelties against the nominal trace.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "jobs/campaign/nominal_traces.h"
#include "simulation/simulation.h"
#include "tests/jobs/striking_balls.h"

namespace graze {
namespace {

using PlainJson = nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Scenario curb(const std::vector<Override>& more = {}) {
  ScenarioOptions options;
  options.overrides = {{"time.end", "40 ms"}};
  options.overrides.insert(options.overrides.end(), more.begin(), more.end());
  return load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
}

const std::vector<std::string> kCurbPolicies = {"step/1cm", "step/4cm"};

// Claim: the nominal trace is that of the scenario with nothing uncertain, to the bit; neither the seed nor jitter nor
// distributions nor the other policies that are asked for change it, though they change every particle.
TEST(NominalTraces, AreThoseOfAScenarioWithoutUncertainty) {
  const std::vector<TraceRecord> got = nominal_traces(curb(), kCurbPolicies);
  ASSERT_EQ(got.size(), 2u);
  ASSERT_NE(got[0].outcome, Outcome::invalid) << got[0].invalid_reason;
  EXPECT_FALSE(got[0].phases.empty());
  const Simulation certain(curb({{"uncertain", "{}"}}));
  for (std::size_t p = 0; p < 2; ++p) {
    const TraceRecord plain = Simulator(certain, kCurbPolicies[p]).run(0, 1).front();
    EXPECT_EQ(got[p].q, plain.q);  // digests know the particle
    EXPECT_EQ(got[p].v, plain.v);
    EXPECT_EQ(got[p].margins, plain.margins);
    EXPECT_EQ(got[p].phases.size(), plain.phases.size());
  }
  Scenario other = curb();
  other.seed = 99;
  EXPECT_EQ(nominal_traces(other, {kCurbPolicies[1]}).front().digest, got[1].digest);
  const Simulation uncertain(curb());
  EXPECT_NE(Simulator(uncertain, kCurbPolicies[0]).run(0, 1).front().q, got[0].q);
  EXPECT_THROW(nominal_traces(curb(), {"none"}), InputError);
}

// Claim: against the nominal ball, which touches the ground alone, the block is a new contact, and its sequences are
// new; successes that strike nothing are no novelty. Of a directory and a packed file, twice, the same bytes.
TEST(EventsOfTheProgram, TellWhatTheNominalTraceHasNot) {
  const testing::StrikingBalls balls;
  const testing::Result text = balls.graze("events a.graze --policy still --reference nominal");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("New against the nominal trace (success at 0.250 s)"), HasSubstr("new contact"),
                              HasSubstr("ball-block")));
  EXPECT_EQ(balls.graze("events a.graze --policy still --reference nominal").out, text.out);
  const testing::Result json = balls.graze("events a.graze --reference nominal --json");
  const PlainJson data = PlainJson::parse(json.out);
  EXPECT_EQ(data["reference"], "nominal");
  for (const PlainJson& policy : data["policies"]) {
    EXPECT_EQ(policy["reference_traces"], 1);
    EXPECT_EQ(policy["nominal"]["outcome"], "success");
    ASSERT_GE(policy["novelties"].size(), 2u);
    EXPECT_EQ(policy["novelties"][0]["what"], "new contact");
    EXPECT_EQ(policy["novelties"][0]["contact"], "ball-block");
    const std::uint64_t all = policy["outcomes"]["n"], strike = policy["novelties"][0]["outcomes"]["n"];
    EXPECT_GT(strike, 0u);
    EXPECT_LT(strike, all);
    EXPECT_EQ(policy["novelties"][1]["what"], "new sequence");
    EXPECT_EQ(policy["novelties"][1]["outcomes"]["n"], strike) << "those that do not strike do as the nominal ball";
  }
  ASSERT_EQ(balls.graze("pack a.graze").code, 0);
  PlainJson packed = PlainJson::parse(balls.graze("events a.h5 --reference nominal --json").out);
  packed["archive"] = data["archive"];
  EXPECT_EQ(packed, data);
}

// Claim: what decides which way a ball goes stands in text, JSON and CSV.
TEST(EventsOfTheProgram, NameTheParameterThatDecides) {
  const testing::StrikingBalls balls;
  const testing::Result text = balls.graze("events a.graze --policy still");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("more often where initial.base.x is larger (AUC 1.00"));
  const PlainJson data = PlainJson::parse(balls.graze("events a.graze --policy still --json").out);
  EXPECT_EQ(data["policies"][0]["bifurcations"][0]["causes"][0]["effects"][0]["parameter"], "initial.base.x");
  EXPECT_THAT(balls.graze("events a.graze --csv").out, StartsWith("policy,traces,success,"));
  EXPECT_THAT(balls.graze("events a.graze --csv --table branches").out,
              AllOf(StartsWith("policy,bifurcation,branch,node,"), HasSubstr("where initial.base.x is larger")));
  EXPECT_THAT(balls.graze("events a.graze --csv --table causes").out,
              AllOf(StartsWith("policy,bifurcation,branch,parameter,"), HasSubstr(",initial.base.x,rank-sum,")));
}

TEST(EventsOfTheProgram, RefuseWhatCannotBeMeant) {
  const testing::StrikingBalls balls("-n 4");
  const auto refused = [&](const std::string& arguments, const std::string& part) {
    const testing::Result run = balls.graze("events " + arguments);
    EXPECT_EQ(run.code, 2) << arguments;
    EXPECT_THAT(run.err, HasSubstr(part)) << arguments;
  };
  refused("a.graze --table causes", "--table causes: is for --csv");
  refused("a.graze --csv --table cause", "--table");
  refused("a.graze --csv --json", "--csv");
  refused("a.graze --reference nominl", "nominl");
  refused("a.graze --policy stil --reference nominal", "nearest: still");
  refused("nowhere.graze --reference nominal", "nowhere.graze");
}

}  // namespace
}  // namespace graze
