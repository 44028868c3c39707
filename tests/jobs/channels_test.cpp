// Claim: check tells which policy reads which channel, and that is so: an error 100,000 times as large on a channel
// that a policy does not read changes no bit of its traces, and a larger one on each that it reads changes them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenarios/channel_readers.h"
#include "tests/jobs/program.h"
#include "tests/jobs/traces.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Optional;

using ByTrace = std::map<testing::Traces::key_type, std::uint64_t>;

ByTrace digests_of(const Scenario& scenario) {
  ByTrace out;
  for (const auto& [key, trace] : testing::simulate(scenario, 2, 5, 1)) out[key] = trace.digest;
  return out;
}

/// The scenario with normal jitter of this size on some channels.
template <class Chosen>
Scenario louder(const Scenario& scenario, double factor, const Chosen& chosen) {
  Scenario out = scenario;
  for (UncertainParameter& parameter : out.space.parameters) {
    if (!parameter.jitter || !chosen(parameter.name)) continue;
    parameter.jitter = Distribution::normal(0, factor * parameter.jitter->quantile(0.8413447460685429));
  }
  return out;
}

Scenario curb_without_lag(const std::vector<Override>& overrides) {
  ScenarioOptions options;
  options.overrides = {{"time.end", "60 ms"}, {"control.lag", "0"}, {"uncertain.control.lag", "0"}};
  options.overrides.insert(options.overrides.end(), overrides.begin(), overrides.end());
  Scenario out = load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
  out.policies.erase(out.policies.begin() + 1, out.policies.end());
  return out;
}

/// Holds what ChannelReaders says against what the traces do. `listed`: the beginning of channels that count as read by
/// every policy and yet have no effect under this one.
void expect_readers_are_true(const Scenario& scenario, int idle_wanted, const std::string& listed = "none") {
  ASSERT_EQ(scenario.policies.size(), 1u);
  const ChannelReaders readers(scenario);
  const ByTrace as_is = digests_of(scenario);
  int idle = 0;
  for (const UncertainParameter& parameter : scenario.space.parameters) idle += readers.idle(parameter.name);
  EXPECT_EQ(idle, idle_wanted);
  EXPECT_EQ(digests_of(louder(scenario, 1e5, [&](const std::string& name) { return readers.idle(name); })), as_is);
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    const auto policies = readers.of(parameter.name);
    if (!policies || policies->empty() || !parameter.jitter || parameter.name.starts_with(listed)) continue;
    const ByTrace other =
        digests_of(louder(scenario, 3, [&](const std::string& name) { return name == parameter.name; }));
    for (const auto& [key, digest] : other) EXPECT_NE(digest, as_is.at(key)) << parameter.name;
  }
}

TEST(Channels, OfTheCurbAreReadAsCheckSays) {
  const Scenario scenario = curb_without_lag({});
  expect_readers_are_true(scenario, 40);
  const ChannelReaders readers(scenario);
  EXPECT_THAT(readers.of("sensor.magnetometer.roll"), Optional(ElementsAre("step/1cm")));
  EXPECT_THAT(readers.of("sensor.imu.linear.x"), Optional(IsEmpty()));
  EXPECT_EQ(readers.of("robot.link.BODY0.density"), std::nullopt) << "no channel";
}

// Servos without a damper do not look at the encoders' velocity, and without gains at nothing.
TEST(Channels, OfServosAreReadAsCheckSays) {
  const std::string servo = "{rest: {hold: {}, control: {joint_pd: {kp: 20";
  expect_readers_are_true(curb_without_lag({{"policies", "" + servo + ", kd: 0.1}}}}"}}), 42);
  expect_readers_are_true(curb_without_lag({{"policies", "" + servo + "}}}}"}}), 54);
  expect_readers_are_true(curb_without_lag({{"policies", "{rest: {hold: {}, control: {torque: {}}}}"}}), 66);
  expect_readers_are_true(curb_without_lag({{"policies", "{rest: {hold: {}, control: {prescribed: {}}}}"}}), 54,
                          "actuator.torque.");
}

// Claim: a gait that listens to its feet sees their flags err, one that goes by timing alone does not.
TEST(Channels, AGaitSeesItsContactFlagsErr) {
  for (const bool recovery : {true, false}) {
    const Override listening = {"policies.step.gait.recovery", recovery ? "true" : "false"};
    const Override end = {"time.end", "0.4 s"};
    const Override missed = {"uncertain.sensor.contact.*_FOOT.missed", "30 %"};
    const Scenario deaf = curb_without_lag({listening, end, missed});
    EXPECT_EQ(ChannelReaders(deaf).idle("sensor.contact.LF_FOOT.missed"), !recovery);
    EXPECT_EQ(digests_of(deaf) == digests_of(curb_without_lag({listening, end})), !recovery);
  }
}

TEST(Channels, CheckMarksTheIdle) {
  const testing::TemporaryFolder folder;
  const std::string file = testing::data("scenarios/quadruped_curb.yaml");
  const testing::Result text = testing::graze(folder.path(), "check '" + file + "'");
  EXPECT_THAT(text.out, ::testing::HasSubstr("; 40 of them (40 at each control step) idle"));
  EXPECT_THAT(text.out, ::testing::ContainsRegex("sensor.gps.x +m .* nobody \\(idle\\)"));
  EXPECT_THAT(text.out, ::testing::ContainsRegex("sensor.magnetometer.roll +rad .* all"));
}

}  // namespace
}  // namespace graze
