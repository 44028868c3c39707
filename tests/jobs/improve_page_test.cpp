// Claim: the page of a redesign tells what failed, what was changed and what the robot does now, with the numbers of
// the session; its plots have the limits and the trajectories of both robots, and the proposals that were rolled back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "archive/hdf5/hdf5.h"
#include "jobs/campaign/improvement_history.h"
#include "jobs/campaign/improvement_page.h"
#include "tests/jobs/swing_session.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using PageJson = nlohmann::ordered_json;

struct ImprovePage : testing::SwingSession {
  PageJson page(const std::string& session) const {
    const testing::Result run = graze("report " + session + " --json");
    EXPECT_EQ(run.code, 0) << run.err;
    return PageJson::parse(run.out);
  }

  /// By hand: one design step, one proposal rolled back, and one that ended the session.
  Redesign made() const {
    Redesign out;
    out.scenario = scenario();
    out.question.options.policy = "free";
    ImproveStep step;
    step.before = {0.3, 0.004, 1}, step.after = {0.45, 0.004, 1.3};
    step.margins_before = {-0.4}, step.predicted = {0.1}, step.margins_after = {0.2};
    step.progress_before = 0.5, step.progress_after = 1;
    step.rolled_back = 1, step.refused = {{0.5, 0.25, 2}};
    out.state.steps = {step};
    out.state.scales = {0.4};
    out.state.design = out.improved = step.after;
    out.state.reached = {{0, 1, step.after, {0.2}, 1}};
    out.state.level = 1, out.state.end = ImproveEnd::stuck, out.state.why = "nothing helps";
    out.state.refused = {{0.5, 0.75, 3}, {0.25, std::nan(""), std::nan("")}};
    for (DesignTrace* trace : {&out.traces.before, &out.traces.improved}) {
      const bool first = trace == &out.traces.before;
      trace->record.outcome = first ? Outcome::known_failure : Outcome::success;
      trace->record.violated = first ? 0 : -1;
      trace->record.margins = {first ? -0.4 : 0.2};
      trace->record.first_violations = {first ? 0.05 : std::nan("")};
      trace->time = {0.01, 0.02};
      trace->drives = {{"left", false, 1, 20, {5, 10}, {0.7, first ? -0.6 : -0.4}, {0.7, first ? -0.6 : -0.4}}};
      trace->frames.time = {0};
    }
    return out;
  }
};

const PageJson& section(const PageJson& page, const std::string& id) {
  for (const PageJson& one : page["sections"]) {
    if (one["id"] == id) return one;
  }
  throw std::runtime_error("no section " + id);
}

// Margins are those of the session, and both robots are there in three dimensions. The page of a folder is that of the
// session's end, and what would be overwritten stays.
TEST_F(ImprovePage, HasTheNumbersOfTheSession) {
  const nlohmann::json state = history("-o better --step damped --report better.html")["state"];
  const PageJson data = page("better");
  const PageJson& row = section(data, "limits")["widgets"][0]["rows"][0];
  EXPECT_EQ(row[0], "slow");
  EXPECT_LT(row[2]["value"].get<double>(), 0);
  EXPECT_NEAR(row[4]["value"].get<double>(), state["reached"].back()["margins"][0].get<double>(), 1e-5);
  EXPECT_EQ(row[5], "holds now");
  ASSERT_EQ(data["trajectories"].size(), 2u);
  const auto size = [&](int robot) { return data["trajectories"][robot]["bodies"]["shapes"][0][1].get<double>(); };
  EXPECT_NEAR(size(1) / size(0), state["reached"].back()["design"][0].get<double>() / 0.3, 1e-5) << "a longer rod";
  EXPECT_TRUE(data["notes"].empty());
  EXPECT_EQ(graze("report better -o again.html").code, 0);
  const std::string html = testing::read_file(folder / "better.html");
  EXPECT_GT(html.size(), 100'000u);
  EXPECT_TRUE(html == testing::read_file(folder / "again.html"));
  EXPECT_EQ(graze("report better -o again.html").code, 2) << "a file is in the way";
  EXPECT_EQ(graze("improve swing.yaml -o other --report again.html").code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

// The history has what the drives did: the fastest joint of the improved robot leaves the margin that the session
// tells.
TEST_F(ImprovePage, HistoryHasTorquesAndSpeeds) {
  const nlohmann::json state = history("-o better --step damped")["state"];
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::open_for_reading(folder / "better/history.h5");
  EXPECT_EQ(hdf5::read_strings(file.id(), "traces/before/joint"), (std::vector<std::string>{"left", "right"}));
  const hdf5::Spec both = {.name = "speed", .matrix = true, .width = 2};
  double fastest = 0;
  for (const double v : hdf5::read_column<double>(file.id(), "traces/improved", both, 1 << 20)) {
    fastest = std::max(fastest, std::abs(v));
  }
  EXPECT_NEAR(3.4 - fastest, state["reached"].back()["margins"][0].get<double>(), 1e-12);
  EXPECT_EQ(hdf5::read_column<double>(file.id(), "traces/before", {.name = "time"}, 1 << 20).size(), 100u);
}

// Figure 39: the proposals that were rolled back stand where the step that was made instead ends, as far as they came.
TEST_F(ImprovePage, RolledBackProposalsAreKept) {
  const Redesign redesign = made();
  const PageJson data = redesign_page(redesign, NumberForm::plain);
  const PageJson& lines = section(data, "progress")["widgets"][0]["lines"];
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["y"], PageJson::parse("[0.5, 1.0, 1.0]"));
  EXPECT_EQ(lines[1]["x"], PageJson::parse("[1.0, 2.0, 2.0]"));
  EXPECT_EQ(lines[1]["y"], PageJson::parse("[0.25, 1.75, 1.0]")) << "one could not be simulated";
  write_history(folder.path(), redesign.scenario, redesign.state, redesign.traces);
  const hdf5::Lock lock;
  const hdf5::Handle file = hdf5::open_for_reading(folder / kHistoryFile);
  EXPECT_EQ(hdf5::read_column<std::uint32_t>(file.id(), "refused", {.name = "step", .type = hdf5::Type::u32}, 1 << 20),
            (std::vector<std::uint32_t>{0, 1, 1}));
  EXPECT_EQ(hdf5::read_column<double>(file.id(), "refused", {.name = "lack"}, 1 << 20)[1], 3);
}

// A session whose first proposal is too large keeps it, and so does its file.
TEST_F(ImprovePage, SessionsTellWhatTheyRolledBack) {
  testing::write_file(folder / "swing.yaml",
                      "include: " GRAZE_SOURCE_DIR
                      "/data/scenarios/quadruped_trot.yaml\ntime: {end: 0.3 s}\n"
                      "task: !replace {requirements: {firm: {tilt: {link: BODY0, below: 0.02 rad}}}}\n"
                      "design:\n  variables:\n"
                      "    lift: {of: policies.trot.gait.step_height, within: [1 cm, 6 cm]}\n"
                      "    body: {of: robot.link.BODY0.mass, within: [0.8 kg, 2 kg], step: 5 g}\n");
  const nlohmann::json state = history("-o better --step damped --max-steps 1", 4)["state"];
  std::size_t refused = state["refused"].size(), told = state["refused"].size();
  for (const auto& step : state["steps"]) {
    refused += step["refused"].size();
    told += step["rolled_back"].get<std::size_t>();
    for (const auto& one : step["refused"]) {
      EXPECT_GT(one["size"].get<double>(), step["size"].get<double>());
      EXPECT_GE(one["lack"].get<double>(), step["lack_before"].get<double>() * (1 - 1e-6)) << "it was no better";
    }
  }
  EXPECT_EQ(refused, told);
  EXPECT_GT(refused, 0u);
  const Scenario own = scenario();
  const ImproveSession kept = read_session(folder / "better", own);
  ASSERT_EQ(kept.state.steps.size(), 1u);
  ASSERT_EQ(kept.state.steps[0].refused.size(), refused);
  EXPECT_EQ(kept.state.steps[0].refused[0].lack, state["steps"][0]["refused"][0]["lack"].get<double>());
}

// What failed, what was changed by how much, what the robot does now; and what particles say, or that none were asked.
TEST_F(ImprovePage, TellsItInWords) {
  Redesign redesign = made();
  RedesignWords words = redesign_words(redesign);
  EXPECT_THAT(words.failed, AllOf(HasSubstr("the robot did none of 3 tasks"), HasSubstr("task 1 of 3"),
                                  HasSubstr("violates 1 of 1 limits: slow by 0.4 rad/s")));
  EXPECT_THAT(words.changed, AllOf(HasSubstr("1 design step (3 proposals were rolled back) changed 2 of 3 variables"),
                                   HasSubstr("rods from 0.3 to 0.45 m"), Not(HasSubstr("thick"))));
  EXPECT_THAT(words.now, AllOf(HasSubstr("does 1 of 3 tasks"), HasSubstr("slow with 0.2 rad/s to spare"),
                               HasSubstr("stuck in task 2 of 3"), HasSubstr("nothing helps")));
  EXPECT_THAT(words.verdict, HasSubstr("No particles were run"));
  redesign.state.reached[0].steps = 0;
  EXPECT_THAT(redesign_words(redesign).now,
              HasSubstr("1 more design step was made for a task that was not done, and is not in it"));
  PolicyComparison pair;
  pair.n_a = pair.n_b = 200, pair.success_a = 10, pair.success_b = 16;
  pair.difference = 0.03, pair.interval = {-0.005, 0.07}, pair.p_value = 0.07;
  redesign.verdict = pair;
  EXPECT_THAT(redesign_words(redesign).verdict, AllOf(HasSubstr("10 of 200 (2.7 to 9.0 %) succeed before"),
                                                      HasSubstr("p = 0.07"), HasSubstr("not shown to be better")));
  redesign.verdict->interval.low = 0.001;
  EXPECT_THAT(redesign_words(redesign).verdict, HasSubstr("not shown to be better")) << "the test says otherwise";
  redesign.verdict->p_value = 0.04;
  EXPECT_THAT(redesign_words(redesign).verdict, HasSubstr("the new design is better"));
}

// Figure 45: a torque of 0.6 N m at 10 rad/s is within a rectangle of 1 N m and 20 rad/s, and within the motor's line
// where it brakes, but outside of a line in all four quadrants by 0.1 N m.
TEST_F(ImprovePage, TorqueSpeedPlanesTellInsideFromOutside) {
  Redesign redesign = made();
  const auto plot = [&] { return torque_speed_plot(redesign, 0, {}, NumberForm::plain); };
  EXPECT_EQ(plot()["note"], "First inside, 0.3 N m to spare; improved inside, 0.3 N m to spare.");
  EXPECT_EQ(plot()["lines"][1]["x"], PageJson::parse("[5.0, 10.0]"));
  EXPECT_EQ(plot()["lines"][1]["y"], PageJson::parse("[0.7, -0.6]"));
  redesign.scenario.torque_speed = true;
  EXPECT_EQ(plot()["note"], "First inside, 0.05 N m to spare; improved inside, 0.05 N m to spare.");
  redesign.scenario.task.requirements[0].kind = "torque_speed";
  EXPECT_EQ(plot()["note"], "First outside by 0.1 N m; improved inside, 0.05 N m to spare.");
  EXPECT_EQ(plot()["lines"][0]["x"], PageJson::parse("[-20.0, 0.0, 20.0, 0.0, -20.0]"));
  EXPECT_EQ(torque_speed_plot(redesign, 0, {0, 0.015}, NumberForm::plain)["lines"][1]["x"], PageJson::parse("[5.0]"))
      << "what is not judged is not drawn";
  redesign.scenario.torque_speed = false;
  redesign.scenario.task.requirements[0].kind = "";
  redesign.traces.improved.drives[0].velocity = 8;
  EXPECT_THAT(plot()["note"].get<std::string>(), HasSubstr("0.3 N m to spare, but too fast by 2 rad/s."));
  EXPECT_EQ(plot()["lines"].size(), 4u) << "each robot has a limit of its own";
}

// What is drawn against limits of torque is what was asked for, while these limits count; others' windows do not
// matter.
TEST_F(ImprovePage, TorquesAreThoseThatAreJudged) {
  Redesign redesign = made();
  redesign.traces.before.drives[0].asked = {0.7, -1.5};
  const auto plot = [&] { return torque_speed_plot(redesign, 0, {}, NumberForm::plain); };
  EXPECT_THAT(plot()["note"].get<std::string>(), HasSubstr("First outside by 0.5 N m"));
  std::vector<Requirement>& all = redesign.scenario.task.requirements;
  all[0].kind = "torque_speed";
  EXPECT_THAT(plot()["note"].get<std::string>(), HasSubstr("First outside by 0.1 N m"))
      << "the line judges what it got";
  EXPECT_FALSE(window_of_motors(redesign.scenario).to < 1e9) << "no window of its own";
  all[0].kind = "torque_limits";
  all[0].window = {0.3, 0.5};
  EXPECT_EQ(window_of_motors(redesign.scenario).from, 0.3);
  EXPECT_EQ(window_of_motors(redesign.scenario).to, 0.5);
  all[0].kind = "height";
  EXPECT_EQ(window_of_motors(redesign.scenario).from, 0);
}

// A session that has no robots yet has no page; one whose scenario was changed says so.
TEST_F(ImprovePage, ChangedSessionsAreTold) {
  EXPECT_EQ(graze("improve swing.yaml -o better --step damped").code, 0);
  EXPECT_THAT(graze("report better --policy free --json").err, HasSubstr("is about one policy"));
  write("design: {variables: {rods: {of: robot.link.*_rod.length, within: [10 cm, 60 cm]}}}\n");
  EXPECT_THAT(graze("report better --json").err, HasSubstr("design variables or limits are no longer"));
  write(std::string("gravity: 5\n") + testing::kBothRods);
  EXPECT_THAT(graze("report better --json").out, HasSubstr("have changed since"));
  std::filesystem::remove(folder / "better/improved.yaml");
  EXPECT_THAT(graze("report better --json").err, HasSubstr("has not come to an end"));
}

}  // namespace
}  // namespace graze
