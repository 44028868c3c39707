// Claim: what controllers are given to read their settings with finds the numbers of the outermost map, and traces that
// come from another process are the traces that went in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "engine/library/settings_json.h"
#include "engine/settings/settings.h"
#include "graze/policy.hpp"
#include "jobs/workers/record_bytes.h"
#include "tests/message_of.h"

namespace graze {
namespace {

TEST(PolicyWrapper, RefusesWrongIndicesOfTheSetup) {
  const GrazeJoint hinge{};
  const char* const links[] = {"ball", "rod"};
  GrazeSetup given{};
  given.joints = 1;
  given.joint = &hinge;
  given.links = 2;
  given.link = links;
  const policy::Setup setup(given);
  EXPECT_EQ(&setup.joint(0), &hinge);
  EXPECT_EQ(setup.link(1), "rod");
  for (const int k : {-1, 1}) EXPECT_THROW(setup.joint(k), std::out_of_range);
  try {
    setup.link(2);
    ADD_FAILURE() << "there is none";
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "link(2): there are 2 links, counted from 0");
  }
}

TEST(PolicyHeader, FindsSettingsOfTheOutermostMap) {
  const std::string json = settings_json(
      Settings::parse("{gains: {kp: 1, 'kd\"': 2}, note: 'kp: \"kp\"', list: [3, kp], kp: 2.5e1, name: kd, "
                      "kd: -0.5, on: true, off: false, none: ~, text: 1 more}",
                      "test.yaml"));
  EXPECT_EQ(
      json,
      "{\"gains\": {\"kp\": 1, \"kd\\\"\": 2}, \"note\": \"kp: \\\"kp\\\"\", \"list\": [3, \"kp\"], \"kp\": 25.0, "
      "\"name\": \"kd\", \"kd\": -0.5, \"on\": true, \"off\": false, \"none\": null, \"text\": \"1 more\"}");
  GrazeSetup setup{};
  setup.settings = json.c_str();
  EXPECT_EQ(graze_setting(&setup, "kp", 7), 25);
  EXPECT_EQ(graze_setting(&setup, "kd", 7), -0.5);
  EXPECT_EQ(graze_setting(&setup, "on", 7), 1);
  EXPECT_EQ(graze_setting(&setup, "off", 7), 0);
  for (const char* other : {"k", "kpp", "none", ""}) EXPECT_EQ(graze_setting(&setup, other, 7), 7) << other;
  for (const char* other : {"gains", "list", "name", "text", "note"}) {
    EXPECT_TRUE(std::isnan(graze_setting(&setup, other, 7))) << other;
  }
  for (const char* broken : {"", "{", "{\"kp", "{\"kp\"", "{\"kp\":", "{\"kp\": tru", "{\"kp\\"}) {
    setup.settings = broken;
    EXPECT_EQ(graze_setting(&setup, "kp", 7), 7) << broken;
  }
}

// Claim: a setting of the outermost map that a controller does not know is found, and no other.
TEST(PolicyHeader, FindsSettingsThatNobodyKnows) {
  GrazeSetup setup{};
  const auto unknown = [&](const char* settings, const char* known) {
    setup.settings = settings;
    char found[6] = "none";
    return graze_unknown_setting(&setup, known, found, sizeof found) ? std::string(found) : "-";
  };
  constexpr const char* kBoth = "{\"kp\": 1, \"gains\": {\"ki\": 2}, \"list\": [\"kd\"]}";
  EXPECT_EQ(unknown(kBoth, "list kp gains"), "-");
  EXPECT_EQ(unknown(kBoth, "kp gain list"), "gains");
  EXPECT_EQ(unknown(kBoth, "  kp  gains "), "list");
  EXPECT_EQ(unknown(kBoth, ""), "kp");
  EXPECT_EQ(unknown("{\"k\": 1}", "kp"), "k") << "a part of a name is none";
  EXPECT_EQ(unknown("{\"stiffness\": 1}", "kp"), "stiff") << "cut";
  for (const char* none : {"{}", "", "{", "{\"kp", "{\"kp\""}) EXPECT_EQ(unknown(none, ""), "-") << none;
}

// Claim: a number with a unit, which a controller would take for a text, is refused with what to write.
TEST(PolicyHeader, SettingsAreNumbersInSi) {
  const auto told = [](const std::string& settings) {
    return testing::message_of([&] { settings_json(Settings::parse(settings, "test.yaml")); });
  };
  EXPECT_THAT(told("{a: {swing: 90 deg}}"),
              ::testing::AllOf(::testing::HasSubstr("test.yaml:1:"), ::testing::HasSubstr("write 1.5707963267")));
  EXPECT_THAT(told("{period: 500 ms}"), ::testing::HasSubstr("write 0.5"));
  EXPECT_THAT(told("{kp: 0x64}"), ::testing::HasSubstr("decimal"));
  for (const char* none : {".inf", "-.inf", ".nan", "1e400", "-1e400"}) {
    EXPECT_THAT(told("{a: [" + std::string(none) + "]}"),
                ::testing::AllOf(::testing::HasSubstr("test.yaml:1:6"), ::testing::HasSubstr("finite")))
        << none;
  }
  EXPECT_EQ(settings_json(Settings::parse("{info: infinite, nan: 1e300}", "test.yaml")),
            "{\"info\": \"infinite\", \"nan\": 1e+300}");
  EXPECT_EQ(settings_json(Settings::parse("{a: '20 deg', b: '1.0', c: \"true\", d: '.inf'}", "test.yaml")),
            "{\"a\": \"20 deg\", \"b\": \"1.0\", \"c\": \"true\", \"d\": \".inf\"}")
      << "what is quoted is a text";
}

// Claim: whole numbers and others stay what they are, which in Python are different types.
TEST(PolicyHeader, NumbersKeepTheirKind) {
  EXPECT_EQ(
      settings_json(Settings::parse("[1, 1.0, 1e3, -2., +3, 007, 0, -0.0, 2.5, 10000000000000001, -10000000000000001, "
                                    "123456789012345678901234567890, 1e16]",
                                    "test.yaml")),
      "[1, 1.0, 1000.0, -2.0, 3, 7, 0, -0.0, 2.5, 10000000000000001, -10000000000000001, "
      "123456789012345678901234567890, 1e+16]");
}

TraceRecord record() {
  TraceRecord out;
  out.particle = 7, out.outcome = Outcome::known_failure, out.violated = 1, out.end_time = 0.5;
  out.objective_margin = -1, out.margins = {1, -2}, out.first_violations = {0.25, 0.5};
  out.margin_parts = {3, 4}, out.violation_parts = {5, 6}, out.objective_culprit = {2, 9};
  out.q = {1, 2, 3}, out.v = {4, 5}, out.digest = 0x123456789abcdef0u;
  out.sequence = "foot-ground", out.invalid_reason = "none", out.stopped = true;
  out.solver.mean_sweeps = 4, out.solver.most_braked = 8;
  out.events.resize(2);
  out.events[1].time = 0.1, out.events[1].b = 3, out.events[1].impulse = 2, out.events[1].p_W = {1, 2, 3};
  out.phases.resize(1);
  out.phases[0].begin = 0.125, out.phases[0].roll = 0.5;
  out.telemetry.add({0.1, {1, 2, 3}, {4, 5}, {6}});
  out.telemetry.add({0.2, {7, 8, 9}, {1, 2}, {3}});
  return out;
}

TEST(RecordBytes, GiveBackWhatWentIn) {
  const TraceRecord in = record();
  const std::string bytes = bytes_of({TraceRecord(), in});
  const std::vector<TraceRecord> both = records_of(bytes, {0, 7});
  ASSERT_EQ(both.size(), 2u);
  const TraceRecord& out = both[1];
  EXPECT_EQ(bytes_of({out}), bytes_of({in}));
  EXPECT_EQ(out.particle, 7u);
  EXPECT_EQ(out.outcome, Outcome::known_failure);
  EXPECT_EQ(out.margins, in.margins);
  EXPECT_EQ(out.violation_parts, in.violation_parts);
  EXPECT_EQ(out.objective_culprit.part, 9);
  EXPECT_EQ(out.digest, in.digest);
  EXPECT_EQ(out.sequence, in.sequence);
  EXPECT_EQ(out.solver.most_braked, 8);
  EXPECT_EQ(out.events.at(1).p_W, in.events[1].p_W);
  EXPECT_EQ(out.phases.at(0).roll, 0.5);
  ASSERT_EQ(out.telemetry.size(), 2u);
  EXPECT_EQ(out.telemetry[1].q, (std::vector<double>{7, 8, 9}));
  EXPECT_EQ(out.telemetry[1].tau, (std::vector<double>{3}));
  EXPECT_THROW(records_of(bytes.substr(0, bytes.size() - 1), {0, 7}), std::runtime_error);
  EXPECT_THROW(records_of(bytes + "x", {0, 7}), std::runtime_error);
}

}  // namespace
}  // namespace graze
