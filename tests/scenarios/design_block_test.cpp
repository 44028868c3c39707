// Claim: `design` is read as what may be changed, and what cannot be meant is refused with its place.
#include "scenarios/design_block.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenarios/scenario.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Scenario with_design(const std::string& design) {
  return load_scenario(GRAZE_SOURCE_DIR "/data/scenarios/quadruped_trot.yaml", {{{"design", design}}, false});
}

std::string refusal(const std::string& design) {
  return with_design(design).redesign_problem;  // campaigns do not heed it
}

std::string refused_variables(const std::string& variables) { return refusal("{variables: {" + variables + "}}"); }

// A glob over four legs is one number; numbers that differ keep their ratio (RH's foot is larger than the others').
TEST(DesignBlock, SymmetriesAreOneVariable) {
  const Scenario scenario = with_design(
      "{variables: {shin: {of: robot.link.*_LEG_3.length, within: [5 cm, 20 cm]}, "
      "feet: {of: [robot.link.LF_FOOT.radius, robot.link.RH_FOOT.radius], factor: [0.5, 2], step: 0.1 mm}}}");
  ASSERT_TRUE(scenario.redesign);
  const DesignBlock& block = *scenario.redesign;
  ASSERT_EQ(block.variables.size(), 2u);
  const DesignVariable& shin = block.variables[0];
  EXPECT_EQ(shin.paths.size(), 4u);
  EXPECT_DOUBLE_EQ(shin.nominal, 0.1);
  EXPECT_DOUBLE_EQ(shin.lower, 0.05);
  EXPECT_NEAR(shin.step, 1e-3 * 0.15, 1e-15);
  const DesignVariable& feet = block.variables[1];
  EXPECT_GT(feet.share[1], 1);
  EXPECT_DOUBLE_EQ(feet.upper, 2 * feet.nominal);
  EXPECT_DOUBLE_EQ(feet.step, 1e-4);
}

// A sum counts every number that its variables stand for: a body and four shins.
TEST(DesignBlock, FixedTotals) {
  const std::string masses =
      "a: {of: robot.link.BODY0.mass, within: [0.8 kg, 2 kg]}, b: {of: robot.link.*_LEG_3.mass, factor: [0.5, 2]}, "
      "c: {of: robot.link.*_LEG_2.length, factor: [0.5, 2]}";
  const Scenario scenario = with_design("{variables: {" + masses + "}, fixed: [{sum: [a, b]}]}");
  ASSERT_TRUE(scenario.redesign) << scenario.redesign_problem;
  const DesignBlock& block = *scenario.redesign;
  ASSERT_EQ(block.fixed.size(), 1u);
  EXPECT_EQ(block.fixed[0].variables, (std::vector<int>{0, 1}));
  EXPECT_EQ(block.fixed[0].weights[0], 1);
  EXPECT_NEAR(block.fixed[0].weights[1], 4, 1e-9);
  EXPECT_NEAR(total_at(block.fixed[0], {1, 0.5, 7}), 3, 1e-9);
  EXPECT_EQ(total_name(block.fixed[0], block.variables), "a + b");
  const auto refused = [&](const std::string& fixed) {
    return refusal("{variables: {" + masses + "}, fixed: " + fixed + "}");
  };
  EXPECT_THAT(refused("[{sum: [a, bb]}]"), HasSubstr("bb: no design variable of that name; nearest: b"));
  EXPECT_THAT(refused("[{sum: a}]"), HasSubstr("'a' alone could not change any more"));
  EXPECT_THAT(refused("[{sum: [a, c]}]"), HasSubstr("'a' is in kg and 'c' in m: they have no sum"));
  EXPECT_THAT(refused("[{sum: [a, b]}, {sum: [b, c]}]"), HasSubstr("'b' is in another sum already"));
  EXPECT_THAT(refused("[{sums: [a, b]}]"), HasSubstr("sum"));
  EXPECT_THAT(refused("{sum: [a, b]}"), HasSubstr("list"));
}

// Motors from a list: a value for each glob, one of them the robot's own.
TEST(DesignBlock, ChoicesFromAList) {
  const std::string of = "motor: {of: [robot.joint.*.effort, robot.link.BODY0.mass], choose: ";
  const Scenario plain = with_design("~");
  const World& world = *plain.world;
  const double effort = world.robot.joints.front().effort, mass = world.robot.links.front().inertia.mass;
  const std::string own = fmt::format("[{} N m, {} kg]", effort, mass);
  const Scenario scenario = with_design("{variables: {" + of + "[[1 N m, 500 g], " + own + ", [9 N m, 2 kg]]}}}");
  ASSERT_TRUE(scenario.redesign) << scenario.redesign_problem;
  const DesignVariable& motor = scenario.redesign->variables[0];
  EXPECT_EQ(motor.choices.size(), 3u);
  EXPECT_EQ(motor.nominal, 2);
  EXPECT_EQ(motor.lower, 1);
  EXPECT_EQ(motor.upper, 3);
  EXPECT_EQ(motor.at(0, 1), 1);
  EXPECT_EQ(motor.at(motor.paths.size() - 1, 1), 0.5);
  EXPECT_EQ(motor.at(0, 3), 9);
  const auto refused = [&](const std::string& rows) { return refused_variables(of + rows + "}"); };
  EXPECT_THAT(refused("[" + own + "]"), HasSubstr("two choices or more"));
  EXPECT_THAT(refused("[" + own + ", [1 N m]]"), HasSubstr("has 1 value; 'of' names 2"));
  EXPECT_THAT(refused("[[1 N m, 1 kg], [2 N m, 1 kg]]"), HasSubstr("none of the choices is the robot's own"));
  EXPECT_THAT(refused("[" + own + ", [-1 N m, 1 kg]]"), HasSubstr("must be >= 0"));
  EXPECT_THAT(refused("[" + own + ", [1 kg, 1 kg]]"), HasSubstr("does not fit"));
  EXPECT_THAT(refused("[" + own + ", [1 N m, 1 kg]], within: [1, 2]"), HasSubstr("within"));
  EXPECT_THAT(refused("[" + own + ", [1 N m, 1 kg]], step: 1"), HasSubstr("a choice has none"));
  EXPECT_THAT(refused_variables("kp: {of: policies.trot.control.operational_pd.kp, choose: [[1], [2]]}"),
              HasSubstr("settings of a policy"));
  EXPECT_THAT(refusal("{variables: {" + of + "[" + own +
                      ", [1 N m, 1 kg]]}, "
                      "a: {of: robot.link.*_LEG_3.mass, factor: [0.5, 2]}}, fixed: [{sum: [motor, a]}]}"),
              HasSubstr("'motor' is a choice, which has no sum"));
}

// All requirements, no measures, and the objective, unless limits are chosen.
TEST(DesignBlock, LimitsAreTheRequirements) {
  const std::string variable = "variables: {kp: {of: policies.trot.control.operational_pd.kp, factor: [0.5, 2]}}";
  const Scenario all = with_design("{" + variable + "}");
  EXPECT_EQ(all.redesign->limits, (std::vector<int>{0, 1}));
  EXPECT_TRUE(all.redesign->objective);
  const Scenario one = with_design("{" + variable + ", limits: upright}");
  EXPECT_EQ(one.redesign->limits, std::vector<int>{0});
  EXPECT_FALSE(one.redesign->objective);
  EXPECT_THAT(refusal("{" + variable + ", limits: uprigth}"), HasSubstr("nearest: upright"));
}

// A setting keeps the unit that it is written in.
TEST(DesignBlock, SettingsOfPolicies) {
  const Scenario scenario =
      with_design("{variables: {lift: {of: policies.trot.gait.step_height, within: [1 cm, 6 cm]}}}");
  const DesignVariable& lift = scenario.redesign->variables[0];
  EXPECT_TRUE(lift.of_policy);
  EXPECT_DOUBLE_EQ(lift.nominal, 0.03);
  EXPECT_EQ(lift.unit, "cm");
  EXPECT_DOUBLE_EQ(lift.scale, 0.01);
}

// A design that stands at its bound is read again, though its URDF has it up to rounding.
TEST(DesignBlock, BoundsAreTakenUpToRounding) {
  const Scenario scenario =
      with_design("{variables: {shin: {of: robot.link.LF_LEG_3.length, within: [5 cm, 0.0999999999999]}}}");
  EXPECT_EQ(scenario.redesign->variables[0].nominal, scenario.redesign->variables[0].upper);
}

TEST(DesignBlock, TasksBecomeHarder) {
  const std::string variable = "variables: {shin: {of: robot.link.*_LEG_3.length, factor: [0.5, 2]}}";
  const Scenario scenario =
      with_design("{" + variable + ", task: {path: policies.trot.gait.velocity, values: [[0.1, 0, 0], [0.2, 0, 0]]}}");
  EXPECT_EQ(scenario.redesign->task_values, (std::vector<std::string>{"[0.1, 0, 0]", "[0.2, 0, 0]"}));
  EXPECT_THAT(refusal("{" + variable + ", task: {path: policies.trot.gait.speed, values: [1, 2]}}"),
              AllOf(HasSubstr("design.task.path"), HasSubstr("no such setting")));
  EXPECT_THAT(refusal("{" + variable + ", task: {path: policies.trt.gait.duty, values: [1, 2]}}"),
              HasSubstr("no 'trt' in policies; nearest: trot"));
  EXPECT_THAT(refusal("{" + variable + ", task: {path: policies.trot.gait.speed, values: [1, 2]}}"),
              HasSubstr("no 'speed' in policies.trot.gait"));
}

// A task of what a variable changes would be done by the variable.
TEST(DesignBlock, TaskIsNoVariable) {
  const std::string variable = "variables: {lift: {of: policies.trot.gait.step_height, within: [1 cm, 6 cm]}}";
  for (const char* path : {"policies.trot.gait.step_height", "policies.trot.gait"}) {
    EXPECT_THAT(refusal("{" + variable + ", task: {path: " + path + ", values: [3 cm, 5 cm]}}"),
                AllOf(HasSubstr("design.task.path"), HasSubstr("is what the variable 'lift' changes")))
        << path;
  }
  EXPECT_EQ(refusal("{" + variable + ", task: {path: policies.trot.gait.velocity, values: [[0.1, 0, 0]]}}"), "");
}

// Numbers of a policy's setting are told in its unit.
TEST(DesignBlock, BoundsAreToldInTheUnitOfTheSetting) {
  EXPECT_THAT(refused_variables("lift: {of: policies.trot.gait.step_height, within: [5 cm, 6 cm]}"),
              AllOf(HasSubstr("the policy's own"), HasSubstr("cm lies outside of 5 … 6 cm"), HasSubstr("cm, 6 cm]")));
  EXPECT_THAT(refused_variables("duty: {of: policies.trot.gait.duty, within: [40, 90]}"),
              AllOf(HasSubstr("did you mean [40 %, 90 %]?"), ::testing::Not(HasSubstr("nearest"))));
}

TEST(DesignBlock, RefusesWhatCannotBeMeant) {
  EXPECT_THAT(refused_variables("shin: {of: robot.link.*_LEG_9.length, factor: [0.5, 2]}"),
              AllOf(HasSubstr("matches no parameter"), HasSubstr("did you mean 'robot.link.")));
  EXPECT_THAT(
      refused_variables("a: {of: robot.link.*_LEG_3.length, factor: [0.5, 2]}, "
                        "b: {of: robot.link.LF_LEG_3.length, factor: [0.5, 2]}"),
      AllOf(HasSubstr("robot.link.LF_LEG_3.length"), HasSubstr("is moved by 'a' already"), HasSubstr("contradict")));
  EXPECT_THAT(refused_variables("shin: {of: robot.link.*_LEG_3.length, within: [15 cm, 20 cm]}"),
              AllOf(HasSubstr("own 0.1 m lies outside"), HasSubstr("[0.1 m, 0.2 m]")));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.mass, factor: [0.5, 2]}, "
                                "d: {of: robot.link.BODY0.density, factor: [0.5, 2]}"),
              HasSubstr("only one of them can be designed"));
  EXPECT_THAT(refused_variables("z: {of: robot.joint.LF_X_1.zero, within: [-1, 1]}"), HasSubstr("no matter of design"));
  EXPECT_THAT(refused_variables("m: {of: [robot.link.BODY0.mass, robot.link.BODY0.size.x], factor: [0.5, 2]}"),
              HasSubstr("cannot move together"));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.mass, within: [0, 2]}"), HasSubstr("must be > 0"));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.mass, factor: [2, 0.5]}"), HasSubstr("must be the smaller"));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.mass}"), HasSubstr("within"));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.mass, factor: [0.5, 2], step: 1}"), HasSubstr("quarter"));
  EXPECT_THAT(refused_variables("g: {of: policies.trot.gait.velocity, within: [0, 1]}"), HasSubstr("is not a number"));
  EXPECT_THAT(refused_variables("g: {of: policies.trot.gait.lift, within: [0, 1]}"), HasSubstr("no such setting"));
  EXPECT_THAT(refused_variables("m: {of: robot.link.BODY0.com.x, within: [-1e308, 1e308]}"), HasSubstr("finite"));
  EXPECT_THAT(refused_variables(""), HasSubstr("names no variable"));
  EXPECT_THAT(refusal("{variables: {m: {of: robot.link.BODY0.mass, factor: [0.5, 2]}}, limits: []}"),
              HasSubstr("design.limits: names none"));
}

}  // namespace
}  // namespace graze
