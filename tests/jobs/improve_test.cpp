// Claim: `graze improve` changes a robot until its limits hold, within its bounds, tells kinks, goes on where it was
// interrupted, and writes the robot that it has found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "archive/hdf5/hdf5.h"
#include "jobs/campaign/design_trials.h"
#include "jobs/campaign/nominal_traces.h"
#include "jobs/cli/improve_picture.h"
#include "simulation/block_run.h"
#include "tests/jobs/swing_session.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using PlainJson = nlohmann::json;

using Improve = testing::SwingSession;

// The session's slope, (predicted - before) / change, is that of a difference of sixth order on a speed that rises
// until the end of the trace, a smooth function of the length: within 1e-5.
TEST_F(Improve, SlopesAreDerivatives) {
  write("design: {variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 cm], step: 0.2 mm}}}\n");
  const PlainJson step = history("--max-steps 1 -o one", 4)["state"]["steps"][0];
  const double change = step["after"][0].get<double>() - step["before"][0].get<double>();
  const double slope = (step["predicted"][0].get<double>() - step["margins_before"][0].get<double>()) / change;
  const Scenario own = scenario();
  const DesignRobots robots(own);
  std::vector<DesignValues> around;
  constexpr double kStep = 0.01;  // m
  for (const int k : {-3, -2, -1, 1, 2, 3}) around.push_back({0.3 + k * kStep});
  TrialQuestion question;
  question.policy = "free";
  const std::vector<DesignMargins> at = try_designs(robots, around, question);
  const auto margin = [&](std::size_t i) { return at[i].margins.front(); };
  const double sixth =
      (45 * (margin(3) - margin(2)) - 9 * (margin(4) - margin(1)) + (margin(5) - margin(0))) / (60 * kStep);
  EXPECT_NEAR(slope / sixth, 1, 1e-5);
  EXPECT_TRUE(step["kinks"].empty());
}

// A rod that is longer moves no slower than its twin, one that is shorter is the fastest: the worst of both has no
// slope in the length of one.
TEST_F(Improve, KinksAreTold) {
  write(
      "design: {variables: {left: {of: robot.link.left_rod.length, within: [10 cm, 60 cm]}, "
      "right: {of: robot.link.right_rod.length, within: [10 cm, 60 cm]}, "
      "both: {of: robot.link.*_rod.com.z, factor: [0.5, 2]}}}\n");
  const PlainJson step = history("--max-steps 1 -o one", 4)["state"]["steps"][0];
  ASSERT_EQ(step["kinks"].size(), 2u);
  EXPECT_EQ(step["kinks"][0]["variable"], 0);
  EXPECT_EQ(step["kinks"][1]["variable"], 1);
  EXPECT_EQ(step["kinks"][0]["contacts"], false);
  EXPECT_EQ(step["before"][0], step["after"][0]) << "the slope on the better side is 0";
  EXPECT_THAT(graze("improve swing.yaml --max-steps 1 -o again").out,
              HasSubstr("kink: 'slow' has no slope in left, right"));
}

// A ball that comes to touch the ground at the very end of its trace: with a larger radius it does, with a smaller one
// not. It falls by g h^2 n (n + 1) / 2 in n steps.
TEST_F(Improve, ContactChangesAreTold) {
  testing::write_file(folder / "ball.urdf",
                      "<robot name=\"b\"><link name=\"ball\"><collision><geometry><sphere radius=\"0.05\"/></geometry>"
                      "</collision></link></robot>");
  testing::write_file(
      folder / "swing.yaml",
      "graze: 1\nrobot: {urdf: ball.urdf, initial: {position: [0, 0, 0.06250775]}}\n"
      "environment: {ground: {plane: z}}\ntime: {end: 50 ms}\n"
      "policies: {still: {hold: {}, control: {torque: {}}}}\n"
      "task: {requirements: {high: {height: {link: ball, above: 0.1}}}}\n"
      "design: {variables: {radius: {of: robot.link.ball.radius, within: [2 cm, 9 cm], step: 3 mm}}}\n");
  const testing::Result run = graze("improve swing.yaml");
  EXPECT_EQ(run.code, 1) << "the only variable has no slope";
  EXPECT_THAT(run.out, HasSubstr("kinks, where there is no slope: 'high' in radius (contacts change)"));
}

// With a window a step sees from the first violation on for that time and no longer: what comes later does not count
// yet.
TEST_F(Improve, LooksAtAWindow) {
  write("design: {window: 10 ms, variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 cm]}}}\n");
  const PlainJson steps = history("-o window")["state"]["steps"];
  double last = 0;
  for (const PlainJson& step : steps) {
    if (!step["to"].is_null()) {
      EXPECT_NEAR(step["to"].get<double>() - step["from"].get<double>(), 0.01, 1e-12);
    }
    EXPECT_GE(step["from"], 0);
    last = std::max(last, step["from"].get<double>());
  }
  EXPECT_GT(last, 0.05) << "the speed is exceeded late only";
  EXPECT_EQ(history("-o window")["state"]["end"], "reached all");
}

// Differences of a window may begin where it does, in the recorded state: what came before does not count, the rest is
// as it was, also in shared blocks.
TEST_F(Improve, WindowsBeginInRecordedStates) {
  write(
      "design: {window: 20 ms, begin: recorded, variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 "
      "cm]}, tall: {of: robot.joint.*.origin.z, factor: [0.5, 2]}}}\n");
  const Scenario own = scenario();
  const DesignRobots robots(own);
  TrialQuestion question;
  question.policy = "free";
  question.from = 0.065, question.to = 0.085;
  const DesignMargins whole = try_designs(robots, {robots.initial()}, question).front();
  EXPECT_GT(whole.so_far.front(), -3);
  question.begin = recorded_beginning(robots, robots.initial(), question);
  ASSERT_TRUE(question.begin);
  EXPECT_NEAR(question.begin->time, 0.06, 1e-12) << "control steps are 10 ms apart";
  const std::vector<DesignValues> designs = {robots.initial(), {0.31, 0.5}, {0.29, 0.5}};
  const std::vector<DesignMargins> alone = try_designs(robots, designs, question);
  const std::vector<DesignMargins> shared = try_beside(robots, robots.initial(), designs, question);
  EXPECT_EQ(alone[0].margins, whole.margins) << "nothing is forgotten where nothing touches";
  for (std::size_t i = 0; i < designs.size(); ++i) {
    EXPECT_NEAR(shared[i].margins.front(), alone[i].margins.front(), 1e-11);
  }
  const double speed = alone[0].margins.front();
  EXPECT_NEAR(alone[1].margins.front() - speed, 0, 0.1) << "both come with the recorded speed";
  EXPECT_GT(alone[1].margins.front(), speed) << "but a longer rod gains less in 20 ms";
  TrialQuestion start = question;
  start.from = 0.005;
  EXPECT_FALSE(recorded_beginning(robots, robots.initial(), start));
  EXPECT_EQ(history("-o recorded")["state"]["end"], "reached all");
  EXPECT_THAT(graze("check swing.yaml --set design.begin=end").err, HasSubstr("start"));
  write("design: {begin: recorded, variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 cm]}}}\n");
  EXPECT_THAT(graze("check swing.yaml").err, HasSubstr("window: 0.1 s"));
}

// Settings of policies and gears of drives are variables, too, and stand in the scenario that is written.
TEST_F(Improve, ChangesPoliciesAndGears) {
  testing::write_file(folder / "swing.yaml", R"(graze: 1
robot: {urdf: twins.urdf, base: fixed}
actuators: {gear: 10, rotor_inertia: 1e-5}
time: {end: 0.2 s, step: 1 ms, control: 1 ms}
policies:
  swing:
    joint_trajectory: {sinusoid: {amplitude: 0.3, frequency: 10}}
    control: {joint_pd: {kp: 2, kd: 0.1}}
task: {requirements: {slow: {joint_speed: {joints: "*", below: 1 rad/s}}}}
design:
  variables:
    gain: {of: policies.swing.control.joint_pd.kp, within: [0.1, 4]}
    gears: {of: "robot.joint.*.gear", within: [5, 50]}
)");
  const PlainJson found = history("-o both");
  EXPECT_EQ(found["state"]["end"], "reached all");
  const Scenario improved = load_scenario((folder / "both/improved.yaml").string());
  const PlainJson design = found["state"]["design"];
  EXPECT_NEAR(improved.redesign->variables[0].nominal, design[0].get<double>(), 1e-12);
  EXPECT_NEAR(improved.redesign->variables[1].nominal, design[1].get<double>(), 1e-12);
  EXPECT_NE(design[0], found["variables"][0]["initial"]);
  EXPECT_NE(design[1], found["variables"][1]["initial"]);
  EXPECT_EQ(nominal_traces(improved, {"swing"}).front().outcome, Outcome::success);
}

// Both steps come to robots whose limits hold at every angle, never leave the bounds, and know what is of no use.
TEST_F(Improve, ReachesEveryTaskWithinTheBounds) {
  for (const std::string step : {"plain", "damped"}) {
    const PlainJson found = history("--step " + step + " -o " + step);
    EXPECT_EQ(found["state"]["end"], "reached all");
    ASSERT_EQ(found["state"]["reached"].size(), 3u);
    EXPECT_GE(found["state"]["reached"][2]["margins"][0], 0);
    EXPECT_EQ(found["state"]["idle"], PlainJson({2})) << "a motor that does nothing moves no limit";
    EXPECT_GE(found["state"]["steps"].size(), 2u);
    for (const PlainJson& one : found["state"]["steps"]) {
      EXPECT_LT(one["lack_after"], one["lack_before"]);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_GE(one["after"][i], found["variables"][i]["lower"]);
        EXPECT_LE(one["after"][i], found["variables"][i]["upper"]);
      }
    }
  }
}

// What is written is the robot that was found: its nominal trace has the session's margins, bit for bit, and both rods
// are equal.
TEST_F(Improve, WritesTheRobotThatItFound) {
  const PlainJson found = history("-o better");
  const Scenario improved = load_scenario((folder / "better/improved.yaml").string());
  const TraceRecord trace = nominal_traces(improved, {"free"}).front();
  EXPECT_EQ(trace.outcome, Outcome::success);
  EXPECT_EQ(trace.margins[0], found["state"]["reached"][2]["margins"][0].get<double>());
  const ParameterTable table(*improved.world);
  EXPECT_EQ(table.find("robot.link.left_rod.length")->nominal, table.find("robot.link.right_rod.length")->nominal);
  EXPECT_NEAR(table.find("robot.link.left_rod.length")->nominal, found["state"]["design"][0].get<double>(), 1e-15);
  EXPECT_EQ(nominal_traces(load_scenario((folder / "better/before.yaml").string()), {"free"}).front().outcome,
            Outcome::known_failure);
}

// The history for NumPy is that of improve.json; a picture is drawn of it.
TEST_F(Improve, WritesAHistoryAndAPicture) {
  const PlainJson state = history("-o better --step damped --plot better.svg")["state"];
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::open_for_reading(folder / "better/history.h5");
  EXPECT_EQ(hdf5::read_strings(file.id(), "variables/name"), (std::vector<std::string>{"rods", "thick", "motor"}));
  EXPECT_EQ(hdf5::read_strings(file.id(), "limits/name"), (std::vector<std::string>{"slow"}));
  const auto design =
      hdf5::read_column<double>(file.id(), "steps", {.name = "design_after", .matrix = true, .width = 3}, 1 << 20);
  const auto task =
      hdf5::read_column<std::uint32_t>(file.id(), "steps", {.name = "task", .type = hdf5::Type::u32}, 1 << 20);
  ASSERT_EQ(task.size(), state["steps"].size());
  for (std::size_t k = 0; k < task.size(); ++k) {
    EXPECT_EQ(task[k], state["steps"][k]["level"].get<std::uint32_t>());
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(design[3 * k + i], state["steps"][k]["after"][i].get<double>());
  }
  EXPECT_THAT(testing::read_file(folder / "better.svg"), AllOf(HasSubstr("<svg"), HasSubstr("tasks done")));
  EXPECT_EQ(graze("improve swing.yaml -o other --plot better.svg").code, 2) << "a file is in the way";
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

// The line of progress never goes back, though steps go on after a task was done.
TEST_F(Improve, ProgressIsDrawnStepByStep) {
  const Scenario scenario = load_scenario((folder / "swing.yaml").string());
  const std::size_t variables = scenario.redesign->variables.size();
  ImproveState state;
  state.steps.resize(3);
  for (ImproveStep& step : state.steps) step.before = step.after = DesignValues(variables);
  state.reached.push_back({0, 1, {}, {}, 1});
  const auto drawn = [&] { return improve_figure(scenario, state).panels.front().series.front(); };
  EXPECT_THAT(drawn().x, ::testing::ElementsAre(0, 1, 1, 2, 2, 3));
  state.reached.push_back({1, 3, {}, {}, 1});
  EXPECT_THAT(drawn().x, ::testing::ElementsAre(0, 1, 1, 2, 2, 3, 3));
  EXPECT_EQ(drawn().y.back(), 2);
}

// An interrupted session goes on to the bytes of the uninterrupted one, whatever the threads.
TEST_F(Improve, GoesOnWhereItWasInterrupted) {
  history("-o whole --threads 1");
  history("-o parts --threads 2 --max-steps 1", 4);
  history("-o parts --threads 2 --max-steps 2", 4);
  EXPECT_THAT(graze("improve swing.yaml -o parts").out, HasSubstr("goes on after 2 steps"));
  EXPECT_EQ(testing::read_file(folder / "parts/improve.json"), testing::read_file(folder / "whole/improve.json"));
  EXPECT_EQ(testing::read_file(folder / "parts/improved.urdf"), testing::read_file(folder / "whole/improved.urdf"));
  const testing::Result other = graze("improve swing.yaml -o parts --step damped");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.err, AllOf(HasSubstr("its step is \"plain\""), HasSubstr("--force")));
}

// What was changed by another hand is not gone on with.
TEST_F(Improve, HistoryIsSealed) {
  history("-o parts --max-steps 1", 4);
  std::string text = testing::read_file(folder / "parts/improve.json");
  const std::size_t at = text.find("\"design\": [");
  ASSERT_NE(at, std::string::npos);
  char& digit = text[text.find_first_of("123456789", at)];
  digit = digit == '8' ? '7' : '8';
  testing::write_file(folder / "parts/improve.json", text);
  const testing::Result changed = graze("improve swing.yaml -o parts");
  EXPECT_EQ(changed.code, 2);
  EXPECT_THAT(changed.err, HasSubstr("improve.json: is damaged: it is not as it was written"));
}

// The scenario that is written includes the first one, whatever its name.
TEST_F(Improve, QuotesNames) {
  std::filesystem::rename(folder / "swing.yaml", folder / "it's.yaml");
  EXPECT_EQ(graze("improve \"it's.yaml\" -o s --max-steps 1").code, 4);
  EXPECT_EQ(graze("check s/improved.yaml").code, 0);
}

// On particles a quantile of the margins is raised; others than these judge. What --set names is found from DIR, too.
TEST_F(Improve, RaisesAQuantileOfParticles) {
  const testing::Result run = graze("improve swing.yaml --set robot.urdf=twins.urdf -n 8 --verdict 60 -o many");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("Verdict on 60 particles"), HasSubstr("the new design is better")));
  const PlainJson state = PlainJson::parse(testing::read_file(folder / "many/improve.json"))["state"];
  EXPECT_LT(state["steps"][0]["success_before"], 1);
  EXPECT_GT(state["reached"][2]["success"], 0.8);
  // Compared as anybody would compare them.
  EXPECT_EQ(graze("compare many/before.graze many/improved.graze").code, 0);
}

// Of a campaign, the particles that failed most are improved on.
TEST_F(Improve, BeginsAtTheFailuresOfACampaign) {
  ASSERT_EQ(graze("run swing.yaml -n 40 -o first.graze --quiet").code, 0);
  const testing::Result run = graze("improve swing.yaml --from first.graze -n 5 --verdict 20 -o from");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("of 40 traces failed by 'slow' first"));
  const PlainJson asked = PlainJson::parse(testing::read_file(folder / "from/improve.json"))["question"];
  EXPECT_EQ(asked["particles"].size(), 5u);
  EXPECT_EQ(graze("improve swing.yaml --from nowhere.h5").code, 2);
}

// What failed in the campaign fails here, whatever the design of its particles.
TEST_F(Improve, ParticlesOfACampaignAreThoseThatFailed) {
  const std::string latin = " --set sampling.design=latin_hypercube ";
  ASSERT_EQ(graze("run swing.yaml -n 24 --seed 5 -o first.graze --quiet" + latin).code, 0);
  const PlainJson step =
      history(latin + "--from first.graze -n 4 --verdict 1 --max-steps 1 -o from", 4)["state"]["steps"][0];
  EXPECT_EQ(step["success_before"].get<double>(), 0);
  const testing::Result other = graze("improve swing.yaml --from first.graze -o other");
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(
      other.err,
      AllOf(HasSubstr("is a campaign of another scenario: sampling.design is latin_hypercube there and random here")));
  EXPECT_THAT(graze("improve swing.yaml --from first.graze --seed 3").err, HasSubstr("--seed"));
}

// A number that particles draw for themselves makes no task for them.
TEST_F(Improve, TaskOfWhatIsDrawnIsRefused) {
  const std::string usable =
      "improve swing.yaml --set contact.friction=0.8 "
      "--set 'uncertain.contact.friction={uniform: [0.5, 1]}' --set 'design.task={path: contact.friction, values: "
      "[0.8, 0.4]}' ";
  const testing::Result run = graze(usable + "-n 4 -o drawn");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("each particle draws its own value"), HasSubstr("uncertain.contact.friction")));
  EXPECT_THAT(graze(usable + "--max-steps 1 -o nominal").err, HasSubstr("the nominal robot alone heeds the task"));
}

// What is doubtful at a task is told; campaigns do not heed a design that cannot be.
TEST_F(Improve, TasksAreReadLikeScenarios) {
  const std::string told = graze("improve swing.yaml --set 'design.task.values=[70, 90]' --max-steps 0").err;
  EXPECT_THAT(told, AllOf(HasSubstr("robot.initial.joints.*=70: "), HasSubstr("did you mean 70 deg?")));
  const testing::Result wrong = graze("improve swing.yaml --set 'design.task.values=[70 deg, 70 kg]' -o wrong");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("design.task.values, 2 of 2 (70 kg): "));
  testing::write_file(folder / "other.urdf", testing::read_file(folder / "twins.urdf"));
  EXPECT_EQ(graze("improve swing.yaml --set 'design.task={path: robot.urdf, values: [twins.urdf, other.urdf]}' "
                  "--max-steps 1 -o urdf")
                .code,
            4);
  EXPECT_EQ(graze("check urdf/before.yaml").code, 0) << "its robot is in the working directory, not beside it";
  const std::string outside = " --set 'design.variables.rods.within=[1, 2]'";
  EXPECT_EQ(graze("run swing.yaml -n 2 --quiet -o run.graze" + outside).code, 0);
  EXPECT_THAT(graze("check swing.yaml" + outside).err, HasSubstr("own 0.3 m lies outside of 1 … 2 m"));
  EXPECT_EQ(graze("improve swing.yaml" + outside).code, 2);
}

// Fixed totals stay at every step, whatever the rule, while limits get better; the length of each leg, and the mass of
// all of them. An answer that would change one is refused.
TEST_F(Improve, KeepsFixedTotals) {
  testing::write_file(folder / "swing.yaml", "include: " + testing::data("scenarios/quadruped_design.yaml") +
                                                 "\ntime: {end: 0.6 s}\ndesign:\n  fixed: [{sum: [front_thigh, "
                                                 "front_shin]}, {sum: [hind_thigh, hind_shin]}, {sum: '*_mass'}]\n");
  for (const std::string rule : {"plain", "damped"}) {
    const PlainJson session = history("--max-steps 3 --step " + rule + " -o " + rule, 4);
    std::vector<std::size_t> front, masses;
    for (std::size_t i = 0; i < session["variables"].size(); ++i) {
      const std::string name = session["variables"][i]["name"];
      if (name == "front_thigh" || name == "front_shin") front.push_back(i);
      if (name.ends_with("_mass")) masses.push_back(i);
    }
    ASSERT_EQ(front.size(), 2u);
    ASSERT_EQ(masses.size(), 6u);
    const auto sum = [](const PlainJson& design, const std::vector<std::size_t>& of) {
      double out = 0;
      for (const std::size_t i : of) out += design[i].get<double>();
      return out;
    };
    ASSERT_EQ(session["state"]["steps"].size(), 3u);
    for (const PlainJson& step : session["state"]["steps"]) {
      EXPECT_NEAR(sum(step["after"], front), 0.212, 1e-12);
      EXPECT_NEAR(sum(step["after"], masses), sum(step["before"], masses), 1e-13);
      EXPECT_NE(step["after"][front[0]], step["before"][front[0]]);
      EXPECT_LT(step["lack_after"].get<double>(), step["lack_before"].get<double>());
    }
  }
  testing::write_file(folder / "answers.txt", "set front_shin 12 cm\naccept\n");
  EXPECT_THAT(graze("improve swing.yaml --answers answers.txt -o asked").err,
              HasSubstr("the sum of front_thigh + front_shin over all that they stand for would change from 0.424"));
}

// Beside a design, all designs share blocks: they have the margins that each has alone, read as a scenario of its own,
// but for the rounding of a file; a policy's setting goes alone.
TEST_F(Improve, NeighboursShareBlocks) {
  write(
      "design: {variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 cm]}, left: {of: "
      "robot.link.left_rod.mass, factor: [0.5, 2]}, tall: {of: robot.joint.right.origin.z, factor: [0.5, 2]}}}\n");
  const Scenario own = scenario();
  const DesignRobots robots(own);
  const DesignValues centre = {0.25, 0.12, 0.6};
  std::vector<DesignValues> beside;
  for (int i = 0; i < 9; ++i) {
    beside.push_back(centre);
    beside.back()[static_cast<std::size_t>(i % 3)] *= 1 + 0.01 * (i - 4);
  }
  beside.push_back({-1, 0.12, 0.6});  // no robot
  TrialQuestion question;
  question.policy = "free";
  const std::vector<DesignMargins> alone = try_designs(robots, beside, question);
  const std::vector<DesignMargins> shared = try_beside(robots, centre, beside, question);
  question.threads = 2;
  const std::vector<DesignMargins> threads = try_beside(robots, centre, beside, question);
  ASSERT_EQ(shared.size(), beside.size());
  for (std::size_t i = 0; i + 1 < beside.size(); ++i) {
    EXPECT_NEAR(shared[i].margins.front(), alone[i].margins.front(), 1e-11) << i;
    EXPECT_EQ(threads[i].margins, shared[i].margins);
    EXPECT_EQ(shared[i].contacts, alone[i].contacts);
    EXPECT_EQ(shared[i].progress, alone[i].progress);
  }
  EXPECT_NE(shared[0].margins, shared[3].margins);
  EXPECT_FALSE(shared.back().made);
  EXPECT_EQ(shared.back().problem, alone.back().problem);
}

// A damper from a list: the rods are as short as they may be, no step along the slopes helps, and of all combinations
// the first that lacks least is taken. The robot that is written has it.
TEST_F(Improve, ChoosesFromAList) {
  const std::string rods = "design: {variables: {rods: {of: robot.link.*_rod.length, within: [29 cm, 30 cm]}, ";
  const std::string motors = "motor: {of: robot.joint.*.effort, choose: [[1 N m], [2 N m]]}, ";
  const std::string damper = "damper: {of: [robot.joint.left.damping, robot.joint.right.damping], choose: ";
  write(rods + motors + damper + "[[0, 0], [0.002, 0.002], [0.02, 0.02], [0.02, 0.2], [0, 0.02]]}}}\n");
  const PlainJson session = history("--step damped -o chosen");
  const PlainJson& last = session["state"]["steps"].back();
  EXPECT_EQ(last["before"][2], 1);
  EXPECT_EQ(last["after"][2], 3) << "the next one lacks nothing either, and stands behind it";
  EXPECT_EQ(last["after"][1], 1) << "the other motor changes nothing";
  const Scenario improved = load_scenario((folder / "chosen/improved.yaml").string());
  EXPECT_EQ(ParameterTable(*improved.world).find("robot.joint.right.damping")->nominal, 0.02);
  EXPECT_EQ(nominal_traces(improved, {"free"}).front().outcome, Outcome::success);
  EXPECT_THAT(graze("improve swing.yaml --step damped -o chosen").out, HasSubstr("damper"));

  // None that is enough: the least lack is taken, once, and the session ends there.
  write(rods + damper + "[[0, 0], [0.001, 0.001], [0.002, 0.002]]}}}\n");
  const PlainJson stuck = history("--step damped -o stuck", 1)["state"];
  EXPECT_EQ(stuck["design"][1], 3);
  EXPECT_LT(stuck["steps"].back()["lack_after"].get<double>(), stuck["steps"].back()["lack_before"].get<double>());
  // None that helps: the first one stays.
  write(rods + damper + "[[0, 0], [-0.0, 0]]}}}\n");
  EXPECT_EQ(history("--step damped -o none", 1)["state"]["design"][1], 1);
}

// With answers a choice is set by its number. Lists that are none are refused with their place.
TEST_F(Improve, RefusesWhatCannotBeChosen) {
  const std::string begin = "design: {variables: {damper: {of: robot.joint.*.damping, choose: ";
  write(begin + "[[0], [0.02], [0.2]]}}}\n");
  const auto answered = [&](const std::string& answers) {
    testing::write_file(folder / "answers.txt", answers);
    return graze("improve swing.yaml --answers answers.txt --json --max-steps 1 -o by_hand");
  };
  EXPECT_THAT(answered("set damper 4\naccept\n").err, HasSubstr("3"));
  EXPECT_THAT(answered("set damper 1.5\naccept\n").err, HasSubstr("damper"));
  EXPECT_THAT(answered("set dampers 2\naccept\n").err, HasSubstr("damper"));
  EXPECT_EQ(answered("set damper 3\naccept\n").code, 4)
      << "it is done, but --max-steps has ended it before that is seen";
  EXPECT_EQ(PlainJson::parse(testing::read_file(folder / "by_hand/improve.json"))["state"]["design"][0], 3);
  const auto refused = [&](const std::string& list) {
    write(begin + list + "}}}\n");
    const std::string error = refusal("");
    EXPECT_THAT(error, HasSubstr("swing.yaml:")) << list;
    return error;
  };
  EXPECT_THAT(refused("[]"), HasSubstr("must be a list of two choices or more"));
  EXPECT_THAT(refused("[[0]]"), HasSubstr("must be a list of two choices or more"));
  EXPECT_THAT(refused("0.02"), HasSubstr("must be a list of two choices or more"));
  EXPECT_THAT(refused("[[0.01], [0.02]]"), HasSubstr("none of the choices is the robot's own, [0 "));
  EXPECT_THAT(refused("[[0, 1], [0.02]]"), HasSubstr("has 2 values; 'of' names 1"));
  EXPECT_THAT(refused("[[0], [large]]"), HasSubstr("large"));
  EXPECT_THAT(refused("[[0], [-1]]"), HasSubstr("must be >= 0"));
}

TEST_F(Improve, RefusesWhatItCannotDo) {
  EXPECT_THAT(refusal("--alpha 2"), HasSubstr("nearest right answer: 1"));
  EXPECT_THAT(refusal("--step damped --alpha 0.1"), HasSubstr("radius"));
  EXPECT_THAT(refusal("--policy fre"), HasSubstr("nearest: free"));
  EXPECT_THAT(refusal("--set design.task.values='[70 deg, 1 m]'"), HasSubstr("1 m"));
  EXPECT_THAT(refusal("-o twins.urdf"), HasSubstr("no folder"));
  write("design: {variables: {motor: {of: robot.joint.*.effort, factor: [0.5, 2]}}}\n");
  EXPECT_THAT(refusal(""), AllOf(HasSubstr("none of them (motor)"), HasSubstr("violated limit 'slow'")));
  write("");
  EXPECT_THAT(refusal(""), AllOf(HasSubstr("has no 'design'"), HasSubstr("docs/improve.md")));
}

}  // namespace
}  // namespace graze
