// Claim: `graze steps` tells the largest step that a scenario bears, and how wrong and how dear each is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "jobs/campaign/step_study.h"
#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// The shipped pendulum swung to and fro, without gravity, by a servo and by the torques of the same law.
class Steps : public ::testing::Test, public testing::BallCampaign {
 protected:
  Steps() {
    testing::write_file(
        folder / "swing.yaml",
        std::string("graze: 1\nrobot: {urdf: ") + GRAZE_SOURCE_DIR +
            "/data/robots/pendulum.urdf, base: fixed}\n"
            "gravity: 0\n"
            "time: {end: 1 s, step: 1 ms, control: 1 ms}\n"
            "policies:\n"
            "  servo:\n"
            "    joint_trajectory: &swing {sinusoid: {amplitude: 0.02, frequency: 3}}\n"
            "    control: {joint_pd: {kp: 20, kd: 10}}\n"
            "  torque: {joint_trajectory: *swing, control: {joint_pd: {kp: 20, kd: 10, implicit: false}}}\n"
            "task: {requirements: {strong: {torque_limits: {joints: hinge}}}}\n");
  }
  nlohmann::json study(const std::string& options) const {
    const testing::Result run = graze("steps swing.yaml --json " + options);
    EXPECT_EQ(run.code, 0) << run.err;
    return nlohmann::json::parse(run.out);
  }
};

// The pendulum's inertia about its hinge is I = 0.0172 kg m^2. A damper that is held for a step of h multiplies the
// joint's speed by 1 - h kd / I: with kd = 10 it swings up from h = 2 I / kd = 3.4 ms on. As a servo it never does.
TEST_F(Steps, FindTheStepThatAnExplicitDamperBears) {
  const nlohmann::json found = study("--steps 1ms,2ms,3ms,4ms,5ms -n 2");
  ASSERT_EQ(found["policies"].size(), 2u);
  EXPECT_EQ(found["link"], "ball");
  EXPECT_EQ(found["policies"][0]["policy"], "servo");
  EXPECT_DOUBLE_EQ(found["policies"][0]["largest_stable_step"], 0.005);
  EXPECT_DOUBLE_EQ(found["policies"][1]["largest_stable_step"], 0.003);
  const nlohmann::json& rows = found["policies"][1]["rows"];
  EXPECT_EQ(rows[3]["outcomes"]["known failure"], 2);
  EXPECT_EQ(rows[3]["same"], 0);
  for (const nlohmann::json& row : rows) {
    EXPECT_DOUBLE_EQ(row["control"], row["step"]) << "as the scenario's, or longer with the step";
    EXPECT_GT(row["cost"], 0);
  }
}

// Semi-implicit Euler is of first order: half the step is half the error, and none is left at the reference's step.
TEST_F(Steps, ErrorsFallWithTheStep) {
  const nlohmann::json found = study("--policy servo --steps 1ms,2ms,4ms --reference 0.05ms --set time.control='4 ms'");
  const nlohmann::json& rows = found["policies"][0]["rows"];
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(rows[i + 1]["joint_error"].get<double>() / rows[i]["joint_error"].get<double>(), 2.05, 0.2);
    EXPECT_NEAR(rows[i + 1]["link_error"].get<double>() / rows[i]["link_error"].get<double>(), 2.05, 0.2);
  }
  // The link is 0.3 m from the joint.
  EXPECT_NEAR(rows[0]["link_error"].get<double>(), 0.3 * rows[0]["joint_error"].get<double>(), 1e-9);
  const nlohmann::json same = study("--policy servo --steps 1ms --reference 1ms");
  EXPECT_EQ(same["policies"][0]["rows"][0]["joint_error"], 0);
  EXPECT_EQ(same["policies"][0]["rows"][0]["link_error"], 0);
}

// A step is judged beside a smaller one, and within a trace; what could not be compared is not called stable.
TEST_F(Steps, JudgeNothingThatCannotBeSeen) {
  const auto refused = [&](const std::string& options) {
    const testing::Result run = graze("steps swing.yaml " + options);
    EXPECT_EQ(run.code, 2) << options;
    return run.err;
  };
  EXPECT_THAT(
      refused("--steps 1ms --reference 2ms"),
      AllOf(HasSubstr("--reference 2ms: is longer than the smallest step, 1 ms"), HasSubstr("--reference 0.5ms")));
  EXPECT_THAT(refused("--steps 60ms --set time.end='50 ms'"),
              HasSubstr("--steps 60ms: longer than a trace, which ends at 0.05 s"));
  EXPECT_THAT(refused("--steps 1ms,,2ms"), HasSubstr("between two commas"));
  EXPECT_THAT(
      refused("-n 10000 --set time.end='10 s' --steps 20ms,21ms,22ms,23ms,24ms,25ms,26ms --set time.step='10 ms' --set "
              "time.control='10 ms'"),
      HasSubstr("bytes for what the runs are compared by"));
  EXPECT_THAT(refused("--link nobody"), HasSubstr("--link nobody: no link"));
}

// Prescribed motion is controlled at every step; what the scenario records does not matter.
TEST_F(Steps, ControlPrescribedMotionAtEachStep) {
  const nlohmann::json found = study(
      "--policy servo --steps 0.5ms,2ms --set policies.servo.control='!replace {prescribed: {}}' --set "
      "record.telemetry=all --set record.every=1 --set time.end='20 s'");
  EXPECT_DOUBLE_EQ(found["policies"][0]["reference"]["control"], 0.00025);
  for (const nlohmann::json& row : found["policies"][0]["rows"]) EXPECT_DOUBLE_EQ(row["control"], row["step"]);
  const nlohmann::json own = study(
      "--policy servo --steps 0.5ms,2ms --set policies.servo.control='!replace {prescribed: {}}' --set time.control='4 "
      "ms'");
  for (const nlohmann::json& row : own["policies"][0]["rows"])
    EXPECT_DOUBLE_EQ(row["control"], 0.004) << "as it was set";
}

// As the published study had it: the control period is the step, also below the scenario's.
TEST_F(Steps, MayControlAtEachStep) {
  const nlohmann::json found = study("--policy servo --steps 0.5ms,2ms --control-each-step");
  for (const nlohmann::json& row : found["policies"][0]["rows"]) EXPECT_DOUBLE_EQ(row["control"], row["step"]);
  EXPECT_DOUBLE_EQ(found["policies"][0]["reference"]["control"], 0.00025);
}

TEST_F(Steps, PrintATableWithAdvice) {
  const testing::Result run = graze("steps swing.yaml --policy torque --steps 2ms,4ms -n 1");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("torque\n"), HasSubstr("reference"), HasSubstr("1 differ   1 known failure"),
                             HasSubstr("Largest stable step: 2 ms. Beside the scenario's 1 ms it costs ")));
  const testing::Result csv = graze("steps swing.yaml --policy torque --steps 2ms,4ms -n 1 --csv");
  EXPECT_THAT(csv.out, AllOf(HasSubstr("policy,reference,step,"), HasSubstr("\ntorque,1,0.0005,0.001,1,1,1,0,0,"),
                             HasSubstr("\ntorque,0,0.004,0.004,1,1,0,")));
}

// Where the reference's own traces fail, as with a damper of 1000 N m s/rad that no step bears, the table says so.
TEST_F(Steps, DoubtAReferenceThatFails) {
  const testing::Result run =
      graze("steps swing.yaml --policy torque --steps 2ms -n 2 --set policies.torque.control.joint_pd.kd=1000");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("At the reference's 0.5 ms 2 of 2 traces do not succeed"));
}

TEST_F(Steps, RefuseWhatCannotBe) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"--steps 0", "--steps 0: a step is longer than 0"},
      {"--steps=-1ms", "--steps -1ms: a step is longer than 0; nearest right answer: --steps 1e-07"},
      {"--steps 2", "--steps 2: is 2 s, longer than any step of physics; did you mean --steps 2ms?"},
      {"--steps 0.3", "--steps 0.3: is 0.3 s, longer than any step of physics; did you mean --steps 0.3ms?"},
      {"--steps 1ms,,2ms", "--steps "},
      {"--steps fast", "--steps fast"},
      {"--reference 2s", "--reference 2s"},
      {"--link bal", "bal: no link or movable object of that name; nearest: ball"},
      {"--link post", "post: does not move"},
      {"--policy servos", "nearest: servo"},
      {"--steps 1us -n 1000", "at most 1e+09"},
      {"--json --csv", "--json"}};
  for (const auto& [options, message] : cases) {
    const testing::Result run = graze("steps swing.yaml " + options);
    EXPECT_EQ(run.code, 2) << options;
    EXPECT_THAT(run.err, HasSubstr(message)) << options;
  }
}

// The control period is kept where the step divides it, else it is the next multiple of the step.
TEST(StepTiming, KeepsTheControlPeriod) {
  const Timing own{5.0, 1e-3, 4e-3};
  for (const auto& [step, control] : {std::pair(5e-4, 4e-3), {2e-3, 4e-3}, {3e-3, 6e-3}, {1e-2, 1e-2}}) {
    const Timing timing = timing_at(own, step);
    EXPECT_DOUBLE_EQ(timing.step, step);
    EXPECT_NEAR(timing.control, control, 1e-15);
    EXPECT_NEAR(timing.end, 5, step);
    EXPECT_NEAR(timing.end / step, timing.steps(), 1e-9);
  }
}

// A step is stable only if all smaller ones are.
TEST(StepStudy, LargestStableStep) {
  StepStudy study;
  for (const int same : {2, 2, 1, 2}) {
    StepRow row;
    row.traces = 2;
    row.same = same;
    study.rows.push_back(row);
  }
  EXPECT_EQ(study.largest_stable(), &study.rows[1]);
  study.rows[0].same = 0;
  EXPECT_EQ(study.largest_stable(), nullptr);
}

}  // namespace
}  // namespace graze
