// Pictures: what figures hold of planted numbers, and that scripts say it to gnuplot whatever names there are.
#include "analysis/plots.h"

#include <gmock/gmock.h>

#include <cmath>
#include <regex>

#include "analysis/explained_traces.h"
#include "analysis/plots_layout.h"
#include "analysis/plots_script.h"
#include "analysis/plots_text.h"
#include "archive/files/utf8.h"
#include "engine/settings/settings.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using Kind = PlotSeries::Kind;

Score planted_score() {
  Score out;
  out.requirements = {"upright", "free"};
  const auto add = [&](const std::string& policy, std::uint64_t success, std::vector<std::uint64_t> known,
                       std::uint64_t unknown, std::uint64_t invalid, Interval interval) {
    PolicyScore& one = out.policies.emplace_back();
    one.policy = policy;
    one.success = success;
    one.known = known[0] + known[1];
    one.unknown = unknown;
    one.invalid = invalid;
    one.n = success + one.known + unknown;
    one.by_requirement = std::move(known);
    one.rate = static_cast<double>(success) / static_cast<double>(one.n);
    one.interval = interval;
  };
  add("step/1cm", 4, {3, 2}, 1, 2, {0.1, 0.7});
  add("step/2cm", 20, {0, 0}, 0, 0, {0.8, 1});
  add("hold", 0, {5, 0}, 0, 0, {0, 0.5});
  return out;
}

std::vector<PlotSeries> of_kind(const PlotPanel& panel, Kind kind) {
  std::vector<PlotSeries> out;
  for (const PlotSeries& one : panel.series) {
    if (one.kind == kind) out.push_back(one);
  }
  return out;
}

// Claim: policies of a family are one curve over their parameter with the score's rates and intervals; others are a
// list, first on top.
TEST(Plots, SuccessHasTheRatesOfTheScore) {
  PolicyFamily family{"step", {{"gait.step_height", "cm", true}}, {}};
  family.members = {{"step/2cm", {"2cm"}, {2}}, {"step/1cm", {"1cm"}, {1}}};
  const Figure got = success_figure({family}, planted_score());
  ASSERT_EQ(got.panels.size(), 2u);
  const std::vector<PlotSeries> curves = of_kind(got.panels[0], Kind::line);
  ASSERT_EQ(curves.size(), 1u);
  EXPECT_EQ(curves[0].x, (std::vector<double>{1, 2})) << "in the order of the parameter";
  EXPECT_EQ(curves[0].y, (std::vector<double>{0.4, 1}));
  EXPECT_EQ(curves[0].low, (std::vector<double>{0.1, 0.8}));
  EXPECT_EQ(curves[0].high, (std::vector<double>{0.7, 1}));
  EXPECT_EQ(got.panels[0].x.title, "gait.step_height [cm]");
  const std::vector<PlotSeries> list = of_kind(got.panels[1], Kind::wide);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].high, std::vector<double>{0.5});
  const Figure plain = success_figure({}, planted_score());
  ASSERT_EQ(plain.panels.size(), 1u);
  EXPECT_EQ(plain.panels[0].series.size(), 3u) << "a bar for each policy";
  EXPECT_EQ(plain.panels[0].y.labels[0], (std::pair<double, std::string>(2, "step/1cm")));
}

// Claim: bars of what failed begin where the one before ends, and their lengths are the shares of all traces.
TEST(Plots, FailuresAreStacked) {
  const Figure got = failures_figure(planted_score());
  ASSERT_EQ(got.legend.size(), 4u);
  EXPECT_EQ(got.legend[0].text, "upright");
  EXPECT_EQ(got.legend[2].text, "objective not met");
  std::vector<double> ends;  // of the first policy's parts
  double before = 0;
  for (const PlotSeries& bar : got.panels[0].series) {
    ASSERT_FALSE(bar.x.empty());
    if (bar.y[0] < 1.5) continue;  // another policy's
    EXPECT_DOUBLE_EQ(bar.x[0], before);
    before = bar.high[0];
    ends.push_back(before * 12 / 100);
  }
  ASSERT_EQ(ends.size(), 4u);
  const std::vector<double> want = {3, 5, 6, 8};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(ends[i], want[i], 1e-12);
  EXPECT_EQ(got.panels[0].words[0].text, "8 of 12 failed");
  Score well = planted_score();
  well.policies.erase(well.policies.begin());
  well.policies.pop_back();
  EXPECT_THAT(failures_figure(well).notes, ElementsAre("No trace violated a requirement."));
}

// Claim: heights of a histogram's boxes add up to its counts; bins that are empty have none.
TEST(Plots, MarginsAreTheHistograms) {
  MarginHistogram one{"upright",
                      "rad",
                      false,
                      {-1, 0, 1, 2},
                      {{"a", {{0, 4, 0}, {2, 0, 0}, {6, 0, 2}}, 3}, {"b", {{}, {}, {1, 0, 0}}, 0}}};
  const Figure got = margins_figure({one, one}, "");
  ASSERT_EQ(got.panels.size(), 2u);
  double area = 0;
  std::size_t boxes = 0;
  for (const PlotSeries& series : got.panels[0].series) {
    ASSERT_EQ(series.kind, Kind::boxes);
    for (std::size_t i = 0; i < series.x.size(); ++i) area += series.low[i] - series.y[i];
    boxes += series.x.size();
  }
  EXPECT_NEAR(area / 0.86 * 8, 15, 1e-9) << "8 is the highest bin";
  EXPECT_EQ(boxes, 5u);
  EXPECT_THAT(got.notes.back(), HasSubstr("a: 3 traces"));
  EXPECT_EQ(margins_figure({one}, "upright").panels.size(), 1u);
  EXPECT_THROW(margins_figure({one}, "upwright"), InputError);
}

Json planted_page() {
  return Json::parse(R"({"channels": [{"group": "position", "name": "base.x", "unit": "m"},
      {"group": "position", "name": "base.y", "unit": "m"}, {"group": "position", "name": "knee", "unit": "rad"},
      {"group": "velocity", "name": "knee", "unit": "rad/s"}, {"group": "requirement", "name": "up", "unit": "rad"}],
    "scene": {"floating_base": true}, "trajectories": [
      {"policy": "b", "outcome": "known failure", "time": [0, 1], "rows": [[0, 1], [0, null], [1, 2], [3, 4], [5, 6]]},
      {"policy": "a", "outcome": "success", "time": [0, 2], "rows": [[0, 2], [0, 3], [1, 2], [3, 4], [5, 6]]},
      {"policy": "a", "outcome": "invalid"}]})");
}

// Claim: paths and channels are the page's rows, coloured by outcome or policy; names that several channels have, and
// unknown ones, are refused with what there is; a base that is fixed has no path.
TEST(Plots, TracesAreThoseOfThePage) {
  const Json page = planted_page();
  const std::vector<std::string> policies = {"a", "b"};
  const Figure plan = path_figure(page, policies, {}, {});
  const std::vector<PlotSeries> paths = of_kind(plan.panels[0], Kind::line);
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_EQ(paths[1].y, (std::vector<double>{0, 3}));
  EXPECT_EQ(paths[0].color, PlotColor::known);
  EXPECT_EQ(of_kind(path_figure(page, policies, {}, {PathView::above, PlotBy::policy}).panels[0], Kind::line)[0].color,
            policy_color(1));
  const Figure knee = channel_figure(page, policies, "velocity: knee", PlotBy::outcome);
  EXPECT_EQ(knee.panels[0].series[1].y, (std::vector<double>{3, 4}));
  EXPECT_EQ(knee.panels[0].x.high, 2);
  EXPECT_TRUE(channel_figure(page, policies, "up", PlotBy::outcome).panels[0].y.zero);
  for (const auto& [name, words] :
       {std::pair{"knee", "say one of 'position: knee', 'velocity: knee'"}, std::pair{"base.w", "nearest: base.x"}}) {
    try {
      channel_figure(page, policies, name, PlotBy::outcome);
      ADD_FAILURE() << name;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
  Json fixed = page;
  fixed["scene"]["floating_base"] = false;
  EXPECT_THROW(path_figure(fixed, policies, {}, {}), InputError);
  fixed["trajectories"] = Json::array();
  EXPECT_THROW(channel_figure(fixed, policies, "", PlotBy::outcome), InputError);
}

/// A robot of two bodies, a box and a ball that hangs on it, that goes 2 m along x and turns about z: by 225 degrees in
/// its rows, by 90 in its poses.
Json planted_journey() {
  return Json::parse(R"({"channels": [
      {"group": "position", "name": "base.qw", "unit": "1"}, {"group": "position", "name": "base.qx", "unit": "1"},
      {"group": "position", "name": "base.qy", "unit": "1"}, {"group": "position", "name": "base.qz", "unit": "1"},
      {"group": "position", "name": "base.x", "unit": "m"}, {"group": "position", "name": "base.y", "unit": "m"},
      {"group": "position", "name": "base.z", "unit": "m"}],
    "scene": {"floating_base": true, "bodies": [{"name": "base", "parent": -1}, {"name": "leg", "parent": 0}],
      "colliders": [{"name": "base", "body": 0, "object": false, "kind": "box"},
                    {"name": "foot", "body": 1, "object": false, "kind": "sphere"},
                    {"name": "curb", "body": -1, "object": true, "kind": "box"}]},
    "trajectories": [{"policy": "a", "outcome": "unknown failure", "time": [0, 0.9, 2.2],
      "rows": [[1, 0.3826834323650898, -0.3826834323650898], [0, 0, 0], [0, 0, 0],
               [0, 0.9238795325112867, 0.9238795325112867], [0, 1, 2], [0, 0, 0], [1, 1, 1]],
      "bodies": {
        "shapes": [[0.2, 0.4, 0.6, 0, 0, 0, 0, 0, 0, 1], [0.1, 0, 0, 0, 0, -0.5, 0, 0, 0, 1],
                   [1, 1, 1, 0, 0, 0, 0, 0, 0, 1]],
        "poses": [[0, 1, 2], [0, 0, 0], [1, 1, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0.7071067811865476],
                  [1, 1, 0.7071067811865476],
                  [0, 1, 2], [0, 0, 0], [0.7, 0.7, 0.7], [0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 1, 1]]}}]})");
}

// Claim: a path is drawn as its view has it: x and y from above, x and z from the side, obliquely with x and y at 30
// degrees in their length; by policy what failed is dashed; marks stand at the frames nearest to multiples of the time;
// of a floor only what is near is drawn.
TEST(Plots, PathsAreSeenFromEachSide) {
  const Json page = planted_journey();
  const std::vector<std::string> policies = {"a"};
  const auto path = [&](const PathScene& scene, const PathRequest& request) {
    return path_figure(page, policies, scene, request).panels[0];
  };
  const PlotPanel plan = path({}, {PathView::above, PlotBy::policy, 1});
  EXPECT_TRUE(plan.series[0].dashed);
  EXPECT_EQ(plan.series[1].x, (std::vector<double>{0, 1, 2})) << "marks at 0, near 1 and near 2 s";
  EXPECT_EQ(path({}, {PathView::above, PlotBy::policy, 2}).series[1].x, (std::vector<double>{0, 2}));
  EXPECT_FALSE(path({}, {}).series[0].dashed);
  EXPECT_EQ(path({}, {PathView::side}).series[0].y, (std::vector<double>{1, 1, 1}));
  const PlotSeries oblique = path({}, {PathView::isometric}).series[0];
  EXPECT_NEAR(oblique.x[2], 2 * std::sqrt(0.75), 1e-12);
  EXPECT_NEAR(oblique.y[2], 1 + 1, 1e-12);
  PathScene scene;
  scene.outlines = {{{-100, 0, 0}, {100, 0, 0}}, {{0, 50, 0}, {1, 50, 0}}};
  scene.waypoints = {{0.5, 0, 0}};
  const PlotPanel around = path(scene, {});
  ASSERT_EQ(around.series.size(), 4u) << "path, end, edges, waypoints";
  EXPECT_NEAR(around.series[2].x[0], -2.0 / 3, 1e-12) << "a third of 2 m about the path";
  EXPECT_NEAR(around.series[2].x[1], 2 + 2.0 / 3, 1e-12);
  EXPECT_EQ(around.series[2].x.size(), 3u) << "one line and a break: the other is far away";
  EXPECT_EQ(around.series[3].x, std::vector<double>{0.5});
  scene = {};
  scene.terrain = {{{0, 0, 0.1}, {1, 0, 0.2}}, {{0, 50, 0}, {1, 50, 0}}};
  EXPECT_EQ(path(scene, {PathView::side}).series[0].y[1], 0.2) << "behind the path, where it is near";
  EXPECT_EQ(path(scene, {PathView::side}).series[0].y.size(), 3u);
  EXPECT_EQ(path(scene, {}).series.size(), 2u) << "from above it has no heights";
}

// Claim: angles of what floats are told of its quaternion, and go on beyond half a turn.
TEST(Plots, AnglesAreThoseOfTheQuaternion) {
  const Figure yaw = channel_figure(planted_journey(), {"a"}, "base.yaw", PlotBy::policy);
  const std::vector<double>& y = yaw.panels[0].series[0].y;
  EXPECT_NEAR(y[1], 3 * M_PI / 4, 1e-12);
  EXPECT_NEAR(y[2], 5 * M_PI / 4, 1e-12);
  EXPECT_EQ(yaw.panels[0].y.title, "base.yaw [rad]");
  EXPECT_NEAR(channel_figure(planted_journey(), {"a"}, "base.roll", PlotBy::policy).panels[0].series[0].y[2], 0, 1e-12);
}

// Claim: a time lapse has each robot as lines at the moments that were asked for: its boxes' edges, turned and moved as
// it is, and its limbs.
TEST(Plots, LapseHasRobotsAtMoments) {
  PathScene scene;
  scene.movable = {"crate"};
  const Figure got = lapse_figure(planted_journey(), {"a", "b"}, scene, 2);
  EXPECT_THAT(got.notes.back(), HasSubstr("Movable objects are not drawn: crate;"));
  ASSERT_EQ(got.panels.size(), 1u) << "no trace of b";
  const PlotSeries& robots = got.panels[0].series[0];
  // Per robot: base to leg, six lines of the box, ball below the leg; two robots; each line ends with a break.
  const auto breaks = std::count_if(robots.x.begin(), robots.x.end(), [](double x) { return std::isnan(x); });
  EXPECT_EQ(breaks, 2 * (1 + 6 + 1));
  // The base of 0.2 m by 0.4 m that stands at x = 2 m has turned by 90 degrees: its edges reach from 1.8 to 2.2 m in x,
  // 0.1 m in y; obliquely the right end of the lower ones is at cos 30 (2.2 + 0.1).
  double right = 0;
  for (const double x : robots.x) right = std::isnan(x) ? right : std::max(right, x);
  EXPECT_NEAR(right, std::sqrt(0.75) * 2.3, 1e-12);
}

// Claim: terrain is a net behind the robots: the trace's own where it has one, else that of all; of several that have
// each their own none, which is said.
TEST(Plots, LapseHasTheGroundThatTheRobotStoodOn) {
  Json page = planted_journey();
  page["scene"]["colliders"][2]["kind"] = "heightfield";
  page["scene"]["colliders"][2]["grid"] = 0;
  page["scene"]["grids"] = {{{"nx", 3}, {"ny", 2}, {"height", {0, 0, 0, 0, 0, 0.5}}}};
  Json& bodies = page["trajectories"][0]["bodies"];
  bodies["grounds"] = Json::object();
  bodies["shapes"][2] = {4, 1, 1, 0, 0, 0, 0, 0, 0, 1};
  // Two rows and three columns, of which the first is too far from the robot; the highest point is at x = 2 m.
  const auto highest = [](const Figure& figure) {
    const PlotSeries& net = figure.panels[0].series[0];
    EXPECT_EQ(std::count_if(net.x.begin(), net.x.end(), [](double x) { return std::isnan(x); }), 2 * 2 + 2);
    double out = -1e300;
    for (const double y : net.y) out = std::isnan(y) ? out : std::max(out, y);
    return out;
  };
  const Figure common = lapse_figure(page, {"a"}, {}, 2);
  EXPECT_NEAR(highest(common), 0.5 * (2 + 0.5) + 0.5, 1e-12);
  bodies["grounds"]["2"] = {0, 0, 0, 0, 0, 0.25};
  const Figure own = lapse_figure(page, {"a"}, {}, 2);
  EXPECT_NEAR(highest(own), 0.5 * (2 + 0.5) + 0.25, 1e-12);
  EXPECT_EQ(own.notes.size(), 1u);
  page["trajectories"].push_back(page["trajectories"][0]);
  const Figure several = lapse_figure(page, {"a"}, {}, 2);
  EXPECT_EQ(several.panels[0].series[0].color, PlotColor::unknown);
  EXPECT_EQ(several.notes.back(), "Each robot had ground of its own, which is drawn where there is one robot.");
}

// Claim: every trace that counts is one mark, at its particle's values, in its outcome's colour and shape.
TEST(Plots, ParametersHaveAMarkForEachTrace) {
  const Folder folder;
  CampaignInfo want = info(200);
  write(folder / "a.graze", want);
  const Archive archive(folder / "a.graze");
  const ReportSample sample = sample_traces(archive, want.policies);
  const Figure got = parameters_figure(want, sample, {{"control.lag"}, "upright", true});
  ASSERT_EQ(got.panels.size(), want.policies.size());
  for (std::size_t p = 0; p < got.panels.size(); ++p) {
    for (const PlotSeries& one : got.panels[p].series) {
      const char letter = one.color == PlotColor::success ? 'S' : one.color == PlotColor::known ? 'K' : 'U';
      const std::string& outcome = sample.policies[p].outcome;
      EXPECT_EQ(one.x.size(), static_cast<std::size_t>(std::count(outcome.begin(), outcome.end(), letter)));
      const auto first = static_cast<std::uint32_t>(outcome.find(letter));
      EXPECT_EQ(one.x[0], values(want, first)[2]);
      EXPECT_EQ(one.y[0], trace(want, static_cast<int>(p), first).margins[0]);
    }
  }
  EXPECT_EQ(parameters_figure(want, sample, {}).panels.size(), 1u);
  EXPECT_THROW(parameters_figure(want, sample, {{"control.lagg"}, "", true}), InputError);
  EXPECT_THROW(parameters_figure(want, sample, {{"control.lag", "contact.model"}, "upright", true}), InputError);
}

// Claim: survival curves are the estimates of `graze explain`, as stairs from 1 at 0 to the end.
TEST(Plots, SurvivalIsThatOfExplain) {
  const Folder folder;
  const CampaignInfo want = info(60);
  write(folder / "a.graze", want);
  const Archive archive(folder / "a.graze");
  const Explanation told = explain(archive);
  const std::vector<Survival> mine =
      survivals(want, explained_traces(archive, "step/1cm", Freedoms(want.q_names), want.particles));
  const std::vector<Survival>& its = told.policies[0].survival;
  ASSERT_EQ(mine.size(), its.size());
  for (std::size_t i = 0; i < mine.size(); ++i) {
    ASSERT_EQ(mine[i].steps.size(), its[i].steps.size());
    EXPECT_EQ(mine[i].failed, its[i].failed);
  }
  const Figure got = survival_figure({{"step/1cm", mine[0]}}, "any requirement", want.end);
  const PlotSeries& line = got.panels[0].series[0];
  ASSERT_EQ(line.x.size(), 2 * mine[0].steps.size() + 2);
  EXPECT_EQ(line.y[0], 1);
  EXPECT_EQ(line.y[2], mine[0].steps[0].share);
  EXPECT_EQ(line.x[2], mine[0].steps[0].time);
  EXPECT_EQ(line.x.back(), want.end);
  const Figure causes = causes_figure(told, "");
  EXPECT_EQ(causes.panels.size(), want.policies.size());
  EXPECT_THROW(causes_figure(told, "upwright"), InputError);
}

// Claim: a tree has a box for each branch with its counts, a diamond and arrows for each bifurcation.
TEST(Plots, TreeIsThatOfTheEvents) {
  CampaignEvents events;
  events.info = info();
  PolicyEvents policy;
  policy.policy = "step/1cm";
  const auto counts = [](std::uint64_t success, std::uint64_t unknown, std::uint64_t violated) {
    OutcomeCounts out(2);
    out.n = success + unknown + violated;
    out.success = success;
    out.unknown = unknown;
    out.violated[0] = violated;
    return out;
  };
  policy.tree.all = counts(6, 1, 3);
  EventNode node;
  node.branches.resize(2);
  node.branches[0].outcomes = counts(6, 1, 0);
  node.branches[1].outcomes = counts(0, 0, 3);
  for (EventBranch& branch : node.branches) branch.kind = EventBranch::Kind::nothing;
  policy.tree.nodes = {node};
  PolicyEvents still;
  still.policy = "hold";
  still.tree.tested = 17;
  events.policies = {policy, still};
  const Figure got = tree_figure(events);
  std::size_t outlined = 0;
  for (const PlotDrawing::Box& box : got.drawing.boxes) outlined += box.outline;
  EXPECT_EQ(outlined, 4u);
  EXPECT_EQ(got.drawing.arrows.size(), 2u);
  EXPECT_EQ(got.drawing.diamonds.size(), 1u);
  std::string words;
  for (const PlotDrawing::Text& one : got.drawing.texts) words += one.text + "\n";
  EXPECT_THAT(words, AllOf(HasSubstr("10: S 6, K 3, U 1"), HasSubstr("3: S 0, K 3, U 0"), HasSubstr("hold: no contact"),
                           HasSubstr("17 were tested"), HasSubstr("◆ 1st contact of LF_FOOT")));
}

/// The script without what stands between single quotes: what gnuplot takes for commands, and blocks of data.
std::string commands_of(const std::string& script) {
  return std::regex_replace(script, std::regex("'[^'\n]*'"), "'…'");
}

// Claim: whatever the names are, nothing of them is a command of gnuplot's, and each stays in its line.
TEST(PlotScripts, NamesAreNeverCode) {
  for (const std::string hostile :
       {"'; system('touch /tmp/x'); '", "`touch x`", "a\nset output 'x'\n", "@macro", "x\\", "$d0 << EOD", "EOD",
        "\"; !ls", "{/Bold x}_^&~ %s %d", "\xff\x1b[31m", "a\r\nquit", "'", "''", "\\'"}) {
    Score score = planted_score();
    for (PolicyScore& one : score.policies) one.policy = hostile;
    score.requirements = {hostile, hostile};
    Figure figure = failures_figure(score);
    figure.title = figure.subtitle = hostile;
    figure.notes.push_back(hostile);
    figure.panels[0].title = figure.panels[0].x.title = figure.panels[0].y.title = figure.panels[0].instead = hostile;
    figure.drawing.texts.push_back({10, 10, hostile});
    const std::string commands = commands_of(gnuplot_script(figure, {}));
    for (const char* never : {"system", "`", "output", "@", "\\", "!", "quit", "\"", "Bold x", "%"}) {
      EXPECT_THAT(commands, Not(HasSubstr(never))) << hostile;
    }
    EXPECT_THAT(commands, Not(HasSubstr(" enhanced")));
    for (const char control : {'\r', '\x1b', '\t'}) EXPECT_EQ(commands.find(control), std::string::npos);
  }
}

// Claim: scripts are the same twice, numbers that are missing break lines and stand in no data, an empty panel is
// drawn.
TEST(PlotScripts, AreFunctionsOfTheFigure) {
  Figure figure{"a", "A"};
  PlotPanel panel{"", {"x"}, {"y"}};
  panel.series.push_back({Kind::line, PlotColor::ink, {0, 1, 2}, {1, std::nan(""), 3}});
  figure.panels = {panel, PlotPanel{"", {"x"}, {"y"}}};
  const std::string script = gnuplot_script(figure, {});
  EXPECT_EQ(script, gnuplot_script(figure, {}));
  EXPECT_THAT(script, HasSubstr("$d0 << EOD\n0 1\n\n2 3\nEOD\n"));
  EXPECT_THAT(script, AllOf(Not(HasSubstr("nan")), HasSubstr("plot NaN notitle"), HasSubstr("background '#ffffff'")));
  PlotStyle dark{PlotStyle::Format::png, PlotStyle::Theme::dark, 1600, 900};
  EXPECT_THAT(gnuplot_script(figure, dark), AllOf(HasSubstr("pngcairo size 1600,900"), HasSubstr("'#14171b'")));
}

// Claim: whatever size is asked for, panels lie within it, below each other, and have some height.
TEST(PlotScripts, PanelsLieWithinThePicture) {
  Figure figure = failures_figure(planted_score());
  figure.panels.resize(6, figure.panels[0]);
  figure.columns = 2;
  for (const auto& [width, height] :
       {std::pair{0, 0}, std::pair{3000, 200}, std::pair{200, 3000}, std::pair{1600, 900}}) {
    const PlotLayout layout = plot_layout(figure, {PlotStyle::Format::svg, PlotStyle::Theme::light, width, height});
    double below = layout.drawing_top;
    for (std::size_t i = 0; i < layout.panels.size(); ++i) {
      const PlacedPanel& one = layout.panels[i];
      EXPECT_GT(one.bottom, one.top + 10);
      EXPECT_GT(one.right, one.left + 10);
      EXPECT_LT(one.right, layout.width);
      EXPECT_GE(one.top, below);
      EXPECT_LT(one.bottom, layout.notes_top);
      if (i % 2 == 1) below = one.bottom;
    }
    EXPECT_NEAR(layout.width * layout.scale, width > 0 ? width : figure.width, 1e-6);
  }
}

// Claim: texts are cut at characters, to the room they have; ticks are round and within their range.
TEST(PlotTexts, FitTheirRoom) {
  const std::string name = "äöü und ein sehr langer Name";
  const std::string cut = plot_fitted(name, 12, 60);
  EXPECT_LE(plot_width(cut, 12), 60);
  EXPECT_EQ(valid_utf8(cut), cut);
  EXPECT_TRUE(cut.ends_with("…"));
  EXPECT_EQ(plot_fitted(name, 12, 1000), name);
  EXPECT_EQ(plot_number(-0.25), "−0.25");
  EXPECT_EQ(plot_number(3e-5), "3e−5");
  EXPECT_EQ(plot_number(-0.0), "0");
  for (const auto& [low, high] :
       {std::pair{0.0, 1.0}, std::pair{-3e-7, 5e-7}, std::pair{1e9, 1e9 + 5}, std::pair{2.0, 2.0}}) {
    for (const auto& [at, text] : plot_ticks(low, high, 5)) {
      EXPECT_GE(at, low - 1e-9 * (high - low) - 1e-12);
      EXPECT_LE(at, high + 1e-9 * (high - low) + 1e-12);
    }
    EXPECT_LE(plot_ticks(low, high, 5).size(), 12u);
  }
  EXPECT_EQ(plot_ticks(12.3410, 12.3414, 4)[1].second, "12.3411") << "neighbours have different names";
}

}  // namespace
}  // namespace graze
