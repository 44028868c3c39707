// Claim: `graze predict` tells what becomes of the nominal robot from a moment on, says what it cannot do, and makes
// the same prediction again from its number of particles.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/jobs/program.h"

namespace graze {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// A ball in the air whose height is read to 1 cm, and two names for doing nothing about it.
struct Predict : ::testing::Test {
  Predict() { testing::write_ball(folder); }
  testing::Result predict(const std::string& options) const {
    return testing::graze(folder.path(),
                          "predict ball.yaml --set 'policies.again={hold: {}, control: {torque: {}}}' " + options);
  }
  nlohmann::json told(const std::string& options, bool hurried = false) const {
    const testing::Result run =
        predict("--json --set 'uncertain.sensor.estimate.z={jitter: {normal: {std: 1 cm}}}' " + options);
    EXPECT_TRUE(run.code == 0 || (hurried && run.code == 4)) << run.err;
    return nlohmann::json::parse(run.out);
  }
  testing::TemporaryFolder folder;
};

TEST_F(Predict, TellsWhatBecomesOfTheRobot) {
  const nlohmann::json out = told("--at 20ms --horizon 10ms -n 800");
  EXPECT_EQ(out["particles"], 800);
  EXPECT_EQ(out["candidates"].size(), 2u);
  EXPECT_EQ(out["best"], "still");
  EXPECT_TRUE(out["controllers_remember"]);
  EXPECT_EQ(out["against_next"]["policy"], "again");
  EXPECT_EQ(out["against_next"]["p_value"], 1.0) << "the same particles under the same policy";
  const nlohmann::json& one = out["candidates"][0];
  EXPECT_EQ(one["success"], out["candidates"][1]["success"]);
  EXPECT_NEAR(one["lasted"]["mean"], 0.01, 1e-12);
  // Heights scatter as they were read: four standard errors of 800 particles are 10 %.
  EXPECT_NEAR(one["place"], 0.01, 0.001);
  EXPECT_NEAR(told("--at 20ms --horizon 10ms -n 800 --widen 0.5")["candidates"][0]["place"], 0.005, 0.0005);
  EXPECT_NEAR(told("--at 20ms --horizon 10ms -n 800 --widen 0")["candidates"][0]["place"], 0, 1e-12);
}

TEST_F(Predict, MakesTheSamePredictionAgain) {
  nlohmann::json hurried;
  std::uint64_t particles = 0;
  for (int deadline = 50; particles == 0 && deadline < 100'000; deadline *= 4) {  // ms; the machine may be busy
    hurried = told("--at 20ms --threads 3 --seed 5 --deadline " + std::to_string(deadline) + "ms", true);
    particles = hurried["particles"];
  }
  ASSERT_GT(particles, 0u);
  nlohmann::json again = told("--at 20ms --threads 1 --seed 5 -n " + std::to_string(particles));
  EXPECT_EQ(hurried["candidates"], again["candidates"]);
  EXPECT_EQ(hurried["best"], again["best"]);
  EXPECT_NE(told("--at 20ms --seed 6 -n " + std::to_string(particles))["candidates"], again["candidates"]);
}

TEST_F(Predict, TellsWhyTracesAreInvalid) {
  std::string text = testing::ball_scenario();
  text.replace(text.find("{normal: {std: 2%}}"), 19, "{choice: [200, 1e-323]}");  // the second has no mass
  testing::write_file(folder / "ball.yaml", text);
  const testing::Result run = predict("--at 20ms -n 20");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, ContainsRegex("\nstill: [0-9]+ invalid, the first: .*mass 0"));
  const nlohmann::json out = told("--at 20ms -n 20");
  EXPECT_THAT(out["candidates"][0]["invalid_reason"].get<std::string>(), HasSubstr("mass 0"));
  testing::write_ball(folder);
  EXPECT_TRUE(told("--at 20ms -n 4")["candidates"][0]["invalid_reason"].is_null());
}

TEST_F(Predict, FollowsCandidatesOfOneKindOnly) {
  const testing::Result run =
      predict("--at 20ms --deadline 10ms --follow --set 'policies.other={hold: {}, control: {joint_pd: {kp: 1}}}'");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("--follow: a trace under still (hold, control torque) cannot go on under other "
                                 "(hold, control joint_pd), which may be the best; choose --candidates of one kind"));
}

TEST_F(Predict, PrintsTables) {
  const testing::Result run = predict("--at 20ms -n 16 --candidates 'st*,again' --repeat 3");
  EXPECT_EQ(run.code, 0) << run.err;
  for (const char* word :
       {"Ball: from 0.02 s on, for 0.03 s", "under still, and with what its controller remembers", "Best: still.",
        "16 particles of each candidate in", "3 calls: 16 particles in the median"}) {
    EXPECT_THAT(run.out, HasSubstr(word));
  }
  const testing::Result none = predict("--at 20ms --deadline 2ms --set time.end='100 s' --set gravity=0 --afresh");
  EXPECT_EQ(none.code, 4) << none.out;
  EXPECT_THAT(none.out, HasSubstr("No verdict: no block of particles came to its end in time."));
  EXPECT_THAT(none.out, HasSubstr("controllers start afresh"));
}

// Trackers that remember forces for longer, impulses or sums of errors cannot go on from each other's memory.
TEST_F(Predict, StartsAfreshWhereTrackersRememberOtherThings) {
  for (const char* pair : {"contacts: {delay: 1 ms}, model: sensed", "model: none", "ki: 5"}) {
    const std::string policies = fmt::format(
        "!replace {{a: {{hold: {{}}, control: {{inverse_dynamics: {{kp: 500, kd: 40}}}}}}, b: {{hold: {{}}, control: "
        "{{inverse_dynamics: {{kp: 500, kd: 40, {}}}}}}}}}",
        pair);
    const testing::Result run = testing::graze(
        folder.path(), "predict drop_and_stand --at 20ms --horizon 10ms -n 8 --set 'policies=" + policies + "'");
    EXPECT_EQ(run.code, 0) << pair << run.err;
    EXPECT_THAT(run.out, HasSubstr("controllers start afresh")) << pair;
  }
}

// The ball falls under one policy as under the other: it ends as its whole trace does.
TEST_F(Predict, LetsTheRobotGoOnUnderTheBest) {
  const std::string half = "--set time.end='1 s' --at 20ms --deadline 500ms -n 8";
  const nlohmann::json out = told(half + " --follow");
  EXPECT_NEAR(out["followed"]["verdict"], 0.52, 1e-12);
  EXPECT_EQ(out["followed"]["ends"], "success");
  EXPECT_NEAR(out["followed"]["end_time"], 1, 1e-12);
  EXPECT_THAT(predict(half + " --follow").out,
              HasSubstr("until the verdict was there, at 0.52 s, and under the best from "
                        "then on: success at 1 s."));
  EXPECT_TRUE(told(half)["followed"].is_null());
  EXPECT_TRUE(told("--at 20ms --deadline 1s -n 8 --follow")["followed"]["ends"].is_null()) << "it had ended by then";
}

TEST_F(Predict, SaysWhatIsWrong) {
  const auto refused = [&](const std::string& options) {
    const testing::Result run = predict(options);
    EXPECT_EQ(run.code, 2) << options;
    return run.err;
  };
  EXPECT_THAT(refused("--at 20ms"), HasSubstr("say when it shall be done, --deadline 100ms, or how many"));
  EXPECT_THAT(refused("-n 8"), HasSubstr("--at"));
  EXPECT_THAT(refused("--at 60ms -n 8"),
              HasSubstr("--at: 0.06 s: no prediction can begin there; the scenario's traces end at 0.05 s"));
  EXPECT_THAT(refused("--at 20ms -n 8 --horizon 40ms"), HasSubstr("a horizon of 0.04 s from 0.02 s on"));
  EXPECT_THAT(refused("--at 20ms -n 8 --candidates stil"), HasSubstr("--candidates stil: no policy of that name in"));
  EXPECT_THAT(refused("--at 20ms -n 8 --candidates still,"), HasSubstr("nothing stands before, behind or between"));
  EXPECT_THAT(refused("--at 20ms -n 8 --candidates '{still,again'"), HasSubstr("a brace is not closed"));
  EXPECT_THAT(refused("--at 20ms -n 8 --under agian"), HasSubstr("policies: agian: no such policy; nearest: again"));
  EXPECT_THAT(refused("--at 20ms -n 8 --widen -2"), HasSubstr("--widen"));
  EXPECT_THAT(
      refused("--at 49ms -n 8 --set 'task.requirements.high.height.above=0.19'"),
      HasSubstr(
          "the nominal robot does not come so far under still: its trace ends at 0.045 s (known failure of 'high')"));
}

}  // namespace
}  // namespace graze
