// Claim: a variable of `design` has the numbers that are written for it, in SI units, whatever form its bounds have;
// its values are all ones that the robot can have; what makes a task harder reads back as it was written.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "scenarios/design_block.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

const std::string kJudged =
    "task: {requirements: {up: {height: {link: base, above: -9}}, slow: {speed: {link: foot, below: 9}}}, "
    "measures: {low: {height: {link: base, below: 9}}}, objective: {tilt: {link: base, below: 1}}}\n";

/// Of the hopper, with a policy whose settings are numbers of several kinds.
Scenario designed(const std::string& design, const std::string& task = kJudged) {
  return testing::read(
      "graze: 1\nrobot: {urdf: robots/hopper.urdf}\nenvironment: {ground: {plane: z}}\ntime: {end: 2 s}\n"
      "policies:\n"
      "  swing:\n"
      "    joint_trajectory: {sinusoid: {amplitude: {hip: 10 deg, slide: 2}, frequency: 2}}\n"
      "    control: {joint_pd: {kp: {hip: 50, slide: 200 N/m}, kd: 0.5}}\n" +
      task + "design: " + design + "\n");
}

const DesignVariable& variable_of(const Scenario& scenario) {
  if (!scenario.redesign) throw std::runtime_error(scenario.redesign_problem);
  return scenario.redesign->variables.at(0);
}

std::string refused_variable(const std::string& variable) {
  return designed("{variables: {a: " + variable + "}}").redesign_problem;
}

TEST(DesignNumbers, BoundsAreTakenInAnyForm) {
  struct Case {
    const char* variable;
    double nominal, lower, upper, step;
    const char* unit;
  };
  const Case cases[] = {
      {"{of: robot.link.foot.radius, within: [1 cm, 50 mm]}", 0.03, 0.01, 0.05, 4e-5, "m"},
      {"{of: robot.link.foot.radius, within: [1, 5, cm], step: 0.1 mm}", 0.03, 0.01, 0.05, 1e-4, "m"},
      {"{of: robot.link.foot.radius, factor: [0.5, 150 %]}", 0.03, 0.015, 0.045, 3e-5, "m"},
      {"{of: robot.joint.hip.effort, factor: [1, 2]}", 10, 10, 20, 0.01, "N m"},
      {"{of: robot.joint.hip.effort, factor: [1, 2], step: 2.5}", 10, 10, 20, 2.5, "N m"},
      {"{of: robot.joint.slide.velocity, within: [0, 4]}", 2, 0, 4, 0.004, "m/s"},
      {"{of: robot.link.base.com.x, within: [-1 cm, 1 cm]}", 0, -0.01, 0.01, 2e-5, "m"},
      {"{of: policies.swing.joint_trajectory.sinusoid.amplitude.hip, within: [0 deg, 20 deg]}", std::numbers::pi / 18,
       0, std::numbers::pi / 9, std::numbers::pi / 9e3, "deg"},
      {"{of: policies.swing.joint_trajectory.sinusoid.amplitude.slide, within: [1 cm, 3]}", 2, 0.01, 3, 2.99e-3, ""},
      {"{of: policies.swing.control.joint_pd.kp.slide, factor: [0.5, 2]}", 200, 100, 400, 0.3, "N/m"},
      {"{of: policies.swing.control.joint_pd.kd, within: [0.1, 1]}", 0.5, 0.1, 1, 9e-4, ""},
  };
  for (const Case& one : cases) {
    const Scenario scenario = designed(std::string("{variables: {a: ") + one.variable + "}}");
    ASSERT_TRUE(scenario.redesign) << scenario.redesign_problem;
    const DesignVariable& variable = variable_of(scenario);
    EXPECT_DOUBLE_EQ(variable.nominal, one.nominal) << one.variable;
    EXPECT_NEAR(variable.lower, one.lower, 1e-15) << one.variable;
    EXPECT_NEAR(variable.upper, one.upper, 1e-12) << one.variable;
    EXPECT_NEAR(variable.step, one.step, 1e-12) << one.variable;
    EXPECT_EQ(variable.unit, one.unit) << one.variable;
    EXPECT_THAT(variable.share, ElementsAre(1));
  }
}

// Numbers that move together keep their ratio, and every value within the bounds must be one that each of them can
// have.
TEST(DesignNumbers, MoveTogetherWithinWhatEachCanBe) {
  const Scenario scenario =
      designed("{variables: {mass: {of: \"robot.link.{base,thigh,foot}.mass\", within: [1 kg, 4 kg]}}}");
  EXPECT_THAT(variable_of(scenario).share, ElementsAre(1, 0.25, 0.05)) << "of 2 kg, 0.5 kg and 0.1 kg";
  EXPECT_THAT(variable_of(scenario).paths,
              ElementsAre("robot.link.base.mass", "robot.link.thigh.mass", "robot.link.foot.mass"));
  EXPECT_THAT(refused_variable("{of: [robot.link.base.com.x, robot.link.thigh.com.z], within: [-1 cm, 1 cm]}"), "");
  EXPECT_THAT(refused_variable("{of: robot.link.base.mass, within: [0, 4]}"), EndsWith("would be 0; it must be > 0"));
  EXPECT_THAT(refused_variable("{of: robot.joint.hip.damping, within: [-1, 4]}"),
              EndsWith("would be -1; it must be >= 0"));
  EXPECT_EQ(refused_variable("{of: robot.joint.hip.damping, within: [0, 4]}"), "") << "which may be 0";
  EXPECT_THAT(refused_variable("{of: robot.link.foot.radius, within: [1 cm, 2e6]}"),
              HasSubstr("robot.link.foot.radius would be 2e+06; it must be <= 1e+06"));
}

TEST(DesignNumbers, ThatCannotBeMeantAreRefused) {
  const std::pair<const char*, const char*> cases[] = {
      {"{of: [robot.link.foot.radius, policies.swing.control.joint_pd.kd], factor: [0.5, 2]}",
       "a number of the robot and a setting of a policy cannot be one variable; make it two"},
      {"{of: [policies.swing.control.joint_pd.kd, robot.link.foot.radius], factor: [0.5, 2]}",
       "a number of the robot and a setting of a policy cannot be one variable; make it two"},
      {"{of: robot.joint.wheel.effort, within: [1, 2]}",
       "robot.joint.wheel.effort: the robot has no such limit, so that there is nothing to change"},
      {"{of: robot.link.base.com.x, factor: [0.5, 2]}",
       "the robot's own value is 0, of which factors make nothing; use 'within'"},
      {"{of: [robot.link.foot.radius, robot.link.foot.radius], factor: [0.5, 2]}",
       "robot.link.foot.radius: is named twice"},
      {"{of: robot.link.foot.radius, within: [5 cm, 5 cm]}", "0.05 … 0.05: the first bound must be the smaller"},
      {"{of: robot.link.foot.radius, within: [4 cm, 5 cm]}",
       "the robot's own 0.03 m lies outside of 0.04 … 0.05 m; nearest right answer: [0.03 m, 0.05 m]"},
      {"{of: robot.link.foot.radius, within: [1 cm, 2 cm]}",
       "the robot's own 0.03 m lies outside of 0.01 … 0.02 m; nearest right answer: [0.01 m, 0.03 m]"},
      {"{of: policies.swing.joint_trajectory.sinusoid.amplitude.hip, within: [5, 20]}",
       "10 deg lies outside of 286.479 … 1145.92 deg; did you mean [5 deg, 20 deg]?"},
      {"{of: robot.link.foot.radius, factor: [0.5, 1.5], step: 1 cm}",
       "0.01: more than a quarter of the way from bound to bound, 0.03"},
      {"{of: policies.swing.control, factor: [0.5, 2]}",
       "policies.swing.control: is not a number ({joint_pd: {kp: {hip: 50, slide: 200 N/m}, kd: 0.5}})"},
      {"{of: policies.swing.control.joint_pd.kd.x, factor: [0.5, 2]}",
       "policies.swing.control.joint_pd.kd.x: the scenario has no such setting; policies.swing.control.joint_pd.kd has "
       "no parts"},
      {"{of: policies.swing.control.joint_pdd.kd, factor: [0.5, 2]}",
       "no 'joint_pdd' in policies.swing.control; nearest: joint_pd"},
      {"{of: policies.wing.x, factor: [0.5, 2]}", "no 'wing' in policies; nearest: swing"},
  };
  for (const auto& [variable, message] : cases) EXPECT_THAT(refused_variable(variable), EndsWith(message)) << variable;
  EXPECT_EQ(refused_variable("{of: robot.link.foot.radius, factor: [0.5, 1.5], step: 0.75 cm}"), "")
      << "just a quarter";
}

// Both 0 and another number have no ratio; equal zeros stay equal.
TEST(DesignNumbers, OfNothingHaveNoRatio) {
  const auto with = [](const std::string& kp) {
    return testing::read(
        "graze: 1\nrobot: {urdf: robots/hopper.urdf}\npolicies: {p: {hold: {}, control: {joint_pd: {kp: {hip: 0, "
        "slide: " +
        kp + ", wheel: 0}}}}}\n" + kJudged +
        "design: {variables: {a: {of: [policies.p.control.joint_pd.kp.hip, policies.p.control.joint_pd.kp.slide], "
        "within: "
        "[-1, 1]}}}\n");
  };
  EXPECT_THAT(
      with("2").redesign_problem,
      EndsWith("policies.p.control.joint_pd.kp.hip is 0 and policies.p.control.joint_pd.kp.slide is 2: numbers that "
               "move together keep their ratio, and these have none"));
  EXPECT_THAT(variable_of(with("0")).share, ElementsAre(1, 1));
}

// Keys may hold dots: of those that begin a path the longest is followed, whatever order they stand in.
TEST(DesignNumbers, PathsFollowTheLongestKey) {
  const std::string longer = "a.b: {hold: {}, control: {joint_pd: {kp: 3}}}",
                    shorter = "a: {hold: {}, control: {joint_pd: {kp: 2}}}";
  for (const std::string& policies : {longer + ", " + shorter, shorter + ", " + longer}) {
    const auto nominal = [&](const std::string& policy) {
      return variable_of(testing::read("graze: 1\nrobot: {urdf: robots/hopper.urdf}\npolicies: {" + policies + "}\n" +
                                       kJudged + "design: {variables: {a: {of: policies." + policy +
                                       ".control.joint_pd.kp, factor: [0.5, 2]}}}\n"))
          .nominal;
    };
    EXPECT_EQ(nominal("a.b"), 3) << policies;
    EXPECT_EQ(nominal("a"), 2) << policies;
  }
}

TEST(DesignNumbers, LimitsAreChosenByGlobs) {
  const std::string variable = "variables: {a: {of: robot.link.foot.radius, factor: [0.5, 2]}}";
  const auto limits = [&](const std::string& globs) {
    const Scenario s = designed("{" + variable + ", limits: " + globs + "}");
    if (!s.redesign) return s.redesign_problem;
    return fmt::format("{}{}", fmt::join(s.redesign->limits, " "), s.redesign->objective ? " and the objective" : "");
  };
  EXPECT_EQ(limits("\"*\""), "0 1 2 and the objective");
  EXPECT_EQ(limits("[slow, up]"), "0 1") << "in the order of the task";
  EXPECT_EQ(limits("[\"*o*\"]"), "1 2 and the objective");
  EXPECT_EQ(limits("low"), "2") << "a measure, if it is named";
  EXPECT_EQ(limits("objective"), " and the objective");
  EXPECT_THAT(limits("[up, fast]"),
              EndsWith("limits[1]: fast: no requirement or measure of that name; there are: up, slow, low, "
                       "objective"));
  EXPECT_THAT(designed("{" + variable + "}", "").redesign_problem,
              EndsWith("the task has neither a requirement nor an objective, so there is no limit to keep"));
  const Scenario whole = designed("{" + variable + "}");
  EXPECT_THAT(whole.redesign->limits, ElementsAre(0, 1)) << "and no measure";
  EXPECT_EQ(whole.redesign->window, std::numeric_limits<double>::infinity());
  EXPECT_EQ(whole.redesign->quantile, 0.1);
  EXPECT_EQ(designed("{" + variable + ", window: 1.5 s, quantile: 20 %}").redesign->window, 1.5);
  EXPECT_EQ(designed("{" + variable + ", window: 1.5 s, quantile: 20 %}").redesign->quantile, 0.2);
  EXPECT_EQ(designed("{" + variable + ", window: 2.1 s}").redesign->window, std::numeric_limits<double>::infinity())
      << "longer than a trace";
  EXPECT_FALSE(testing::read(testing::hopper("design: ~\n")).redesign);
}

/// A random value of YAML with its text in one line.
std::string random_value(std::mt19937& random, int depth) {
  const int choice = static_cast<int>(random() % (depth > 0 ? 6 : 4));
  if (choice == 0) return std::to_string(static_cast<int>(random() % 1000));
  if (choice == 1) return fmt::format("{} cm", random() % 10);
  if (choice == 2) return "'it''s [one], {two}: # \"three\"'";
  if (choice == 3) return "~";
  std::string out;
  for (std::size_t i = 0, n = 1 + random() % 3; i < n; ++i) {
    out += (i ? ", " : "") + (choice == 5 ? fmt::format("k{}: ", i) : "") + random_value(random, depth - 1);
  }
  return choice == 4 ? "[" + out + "]" : "{" + out + "}";
}

bool same_tree(const Settings& a, const Settings& b) {
  if (a.is_null() || b.is_null()) return a.is_null() && b.is_null();
  if (a.is_scalar()) return b.is_scalar() && a.text() == b.text();
  if (a.is_list() != b.is_list() || a.is_map() != b.is_map()) return false;
  if (a.is_list()) {
    const auto x = a.items(), y = b.items();
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), same_tree);
  }
  const auto x = a.entries(), y = b.entries();
  return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                    [](const auto& p, const auto& q) { return p.first == q.first && same_tree(p.second, q.second); });
}

TEST(DesignNumbers, ValuesOfATaskReadBack) {
  std::mt19937 random(77);
  for (int i = 0; i < 40; ++i) {
    std::string list;
    for (int k = 0; k < 8; ++k) list += (k ? ", " : "") + random_value(random, 3);
    const Scenario s = designed(
        "{variables: {a: {of: robot.link.foot.radius, factor: [0.5, 2]}}, task: {path: "
        "policies.swing.joint_trajectory, values: [" +
        list + "]}}");
    ASSERT_TRUE(s.redesign) << s.redesign_problem;
    const std::vector<Settings> written = Settings::parse("v: [" + list + "]", "v.yaml").at("v").items();
    ASSERT_EQ(s.redesign->task_values.size(), written.size());
    for (std::size_t k = 0; k < written.size(); ++k) {
      const std::string& text = s.redesign->task_values[k];
      EXPECT_EQ(text.find('\n'), std::string::npos);
      EXPECT_TRUE(same_tree(Settings::parse("v: " + text, "v.yaml").at("v"), written[k])) << text;
    }
  }
}

TEST(DesignNumbers, TotalsNeedNumbersThatAddUp) {
  const auto fixed = [](const std::string& variables, const std::string& sums) {
    return designed("{variables: {" + variables + "}, fixed: " + sums + "}").redesign_problem;
  };
  const std::string two =
      "a: {of: robot.link.base.mass, factor: [0.5, 2]}, b: {of: robot.link.foot.mass, factor: [0.5, 2]}, "
      "c: {of: robot.link.thigh.mass, factor: [0.5, 2]}, d: {of: policies.swing.control.joint_pd.kd, factor: [0.5, 2]}";
  EXPECT_EQ(fixed(two, "[{sum: [a, b]}]"), "");
  EXPECT_EQ(fixed(two, "[{sum: \"{a,b,c}\"}]"), "");
  EXPECT_EQ(fixed(two, "[{sum: [a, b, a]}]"), "") << "named twice, it counts once";
  EXPECT_THAT(fixed(two, "[{sum: [a, d]}]"), EndsWith("'a' is in kg and 'd' in no unit: they have no sum"));
  EXPECT_THAT(fixed(two, "[{sum: [a, b]}, {sum: [c, b]}]"),
              EndsWith("fixed[1].sum[1]: 'b' is in another sum already; a variable belongs to one sum at most"));
  const Scenario s = designed("{variables: {" + two + "}, fixed: [{sum: [c, a]}]}");
  ASSERT_TRUE(s.redesign);
  EXPECT_THAT(s.redesign->fixed[0].variables, ElementsAre(0, 2));
  EXPECT_DOUBLE_EQ(total_at(s.redesign->fixed[0], {3, 100, 0.5, 100}), 3.5);
  EXPECT_EQ(total_name(s.redesign->fixed[0], s.redesign->variables), "a + c");
}

}  // namespace
}  // namespace graze
