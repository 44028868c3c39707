// Claim: a replay shows what the controller saw and wanted beside what was true; failures name the part that is to
// blame; and what fabrication made of a particle can be listed.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "engine/dynamics/dynamics_model.h"
#include "simulation/particles.h"
#include "simulation/step_recorder.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

/// One particle of the curb for 0.2 s, with a lag that reaches behind many control steps.
struct Watched {
  Scenario scenario;
  Model model;  // the particle's
  StepLog log;

  Watched() {
    ScenarioOptions options;
    options.overrides = {{"time.end", "0.2 s"}, {"uncertain.control.lag.normal.mean", "20 ms"}};
    scenario = load_scenario(testing::data("scenarios/quadruped_curb.yaml"), options);
    const ParticleSource source(scenario, 1, 8);
    const std::vector<Particle> particles = {source.fabricate(3, source.draw(3))};
    model = particles[0].model;
    const TraceNames info = trace_names(scenario.model);
    StepRecorder recorder(scenario, info);
    BlockRun(scenario, scenario.policies[3], 1).run(particles, nullptr, {.observer = &recorder});
    log = recorder.take();
  }

  const FrameTable& table(const std::string& name) const {
    for (const FrameTable& one : log.tables) {
      if (one.name == name) return one;
    }
    throw std::runtime_error("no table " + name);
  }
  std::vector<double> row(const std::string& name, std::size_t frame) const {
    const FrameTable& one = table(name);
    const auto begin = one.values.begin() + static_cast<std::ptrdiff_t>(frame * one.columns.size());
    return {begin, begin + static_cast<std::ptrdiff_t>(one.columns.size())};
  }
  double at(const std::string& name, std::size_t frame, std::size_t column) const { return row(name, frame)[column]; }
  /// The frame whose state was sensed for this one.
  std::size_t sensed_frame(std::size_t frame) const {
    return static_cast<std::size_t>(std::llround(at("control", frame, 0) / scenario.timing.step));
  }
};

const Watched& watched() {
  static const Watched one;
  return one;
}

// Every table has its columns in every frame, and in the first frame nothing was seen or wanted yet.
TEST(Sight, TablesAreWhole) {
  const Watched& w = watched();
  ASSERT_EQ(w.log.time.size(), 401u);
  std::set<std::string> names;
  for (const FrameTable& table : w.log.tables) {
    names.insert(table.name);
    EXPECT_EQ(table.values.size(), 401 * table.columns.size()) << table.name;
    for (const NamedColumn& column : table.columns) EXPECT_NE(column.unit, "") << table.name << column.name;
  }
  for (const char* name : {"control", "policy", "sensed/joint_position", "truth/imu_linear", "sensed/link_force",
                           "targets/x", "targets_in_force/xd", "effectors/x"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  EXPECT_TRUE(std::isnan(w.at("control", 0, 0)));
  EXPECT_TRUE(std::isnan(w.at("targets/x", 0, 0)));
  EXPECT_EQ(w.table("policy").columns[0].name, "LF_FOOT.mode");
  EXPECT_EQ(w.table("targets/x").columns[11].name, "RH_FOOT.z");
  EXPECT_EQ(w.table("sensed/base_rpy").columns[2].unit, "rad");
}

// Truth is the state of the frame that was sensed, to the bit; what was sensed differs from it by an error of the size
// that the scenario says, and afresh at each step.
TEST(Sight, WhatWasSensedStandsBesideTheTruth) {
  const Watched& w = watched();
  double sum = 0;
  std::set<double> errors;
  for (std::size_t frame = 1; frame < 401; ++frame) {
    const std::size_t then = w.sensed_frame(frame);
    ASSERT_EQ(then, frame - 1);
    for (std::size_t k = 0; k < 12; ++k) {
      EXPECT_EQ(w.at("truth/joint_position", frame, k), w.at("q", then, 7 + k));
      const double error = w.at("sensed/joint_position", frame, k) - w.at("truth/joint_position", frame, k);
      sum += error * error;
      errors.insert(error);
    }
    EXPECT_EQ(w.at("truth/base_position", frame, 2), w.at("q", then, 6));
    EXPECT_NE(w.at("sensed/imu_linear", frame, 0), w.at("truth/imu_linear", frame, 0)) << "the gait does not read it";
  }
  // 4800 draws: the standard deviation of their spread is 1 % of it; 6 of those.
  EXPECT_NEAR(std::sqrt(sum / 4800), 0.0033333, 6e-2 * 0.0033333);
  EXPECT_GT(errors.size(), 4700u);
}

// The centre of mass is the particle's own, not the nominal robot's.
TEST(Sight, CentreOfMassIsThatOfTheDynamics) {
  const Watched& w = watched();
  const DynamicsModel own(w.model), nominal(w.scenario.model);
  DynamicsData<double> data(own), wrong(nominal);
  for (const std::size_t frame : {0, 137, 400}) {
    const std::vector<double> q = w.row("q", frame), com = w.row("centre_of_mass", frame);
    update_poses(data.tree(), q.data());
    update_poses(wrong.tree(), q.data());
    const Vec3 want = to_eigen(centre_of_mass(data.tree(), 0));
    EXPECT_LT((Vec3(com[0], com[1], com[2]) - want).norm(), 1e-12) << frame;
    EXPECT_GT((to_eigen(centre_of_mass(wrong.tree(), 0)) - want).norm(), 1e-6) << frame;
  }
}

// The targets in force are those that were issued a lag before, and the lag is the particle's with its jitter.
TEST(Sight, TheLagInForceIsThatOfTheTargets) {
  const Watched& w = watched();
  std::set<double> lags;
  int behind = 0;
  for (std::size_t frame = 1; frame < 401; ++frame) {
    const double now = w.at("control", frame, 0), lag = w.at("control", frame, 1);
    lags.insert(lag);
    EXPECT_NEAR(lag, 0.020, 0.006);
    const double due = now - lag;
    if (due < 0) continue;
    const auto issued = static_cast<std::size_t>(std::floor((due + 1e-9) / w.scenario.timing.step)) + 1;
    for (const char* table : {"x", "xd"}) {
      const auto force = std::string("targets_in_force/") + table, wanted = std::string("targets/") + table;
      ASSERT_EQ(w.row(force, frame), w.row(wanted, issued)) << frame;
      behind += w.row(force, frame) != w.row(wanted, frame);
    }
  }
  EXPECT_GT(lags.size(), 300u);
  EXPECT_GT(behind, 300);
}

// Modes tell the gait's swings: the LH foot lifts off first, one foot swings at a time, and the foot that swings rises
// after its target.
TEST(Sight, ModesAreThoseOfTheGait) {
  const Watched& w = watched();
  std::set<double> seen;
  double highest = 0;
  for (std::size_t frame = 1; frame < 401; ++frame) {
    int swinging = 0;
    for (std::size_t foot = 0; foot < 4; ++foot) {
      const double mode = w.at("policy", frame, foot);
      seen.insert(mode);
      swinging += mode == 1;
    }
    EXPECT_LE(swinging, 2) << frame;
    if (w.at("policy", frame, 2) == 1) highest = std::max(highest, w.at("effectors/x", frame, 8));
    EXPECT_EQ(w.at("policy", frame, 4), 0.2) << "commanded forward";
    EXPECT_EQ(w.at("policy", frame, 9), -0.5) << "commanded turn";
  }
  EXPECT_TRUE(seen.contains(0) && seen.contains(1));
  EXPECT_TRUE(*seen.begin() >= 0 && *seen.rbegin() <= 3);
  EXPECT_GT(highest, w.at("effectors/x", 1, 8) + 0.02) << "a step of 4 cm";
}

std::vector<std::vector<std::string>> cells_of(const std::string& text) {
  std::vector<std::vector<std::string>> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    out.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) out.back().push_back(cell);
  }
  return out;
}

double cell(const std::vector<std::vector<std::string>>& rows, const std::string& head, std::size_t row) {
  for (std::size_t i = 0; i < rows[0].size(); ++i) {
    if (rows[0][i] == head) return std::stod(rows.at(row).at(i));
  }
  ADD_FAILURE() << "no column " << head;
  return 0;
}

// A shin that is 1 cm longer and twice as dense weighs as much more, and its foot stands as much farther away.
TEST(Sight, DerivedNumbersAreThoseOfTheParticle) {
  const TemporaryFolder folder;
  testing::write_file(folder / "a.yaml", "include: " + testing::data("scenarios/quadruped_walk.yaml") +
                                             "\nuncertain: !replace\n"
                                             "  robot.link.LF_LEG_3.length: {uniform: [11 cm, 11.0000001 cm]}\n"
                                             "  robot.link.LF_LEG_3.density: 2200\n");
  const testing::Result got = testing::graze(folder.path(), "sample a.yaml -n 9 --derived --particle 7 --particle 2");
  ASSERT_EQ(got.code, 0) << got.err;
  const auto rows = cells_of(got.out);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[1][0], "7");
  EXPECT_EQ(rows[2][0], "2");
  const double volume = M_PI * 0.0095 * 0.0095 * 0.11;
  EXPECT_NEAR(cell(rows, "link.LF_LEG_3.length [m]", 1), 0.11, 1e-8);
  EXPECT_NEAR(cell(rows, "link.LF_LEG_3.mass [kg]", 1), 2200 * volume, 1e-6);
  EXPECT_NEAR(cell(rows, "link.LF_LEG_3.com.x [m]", 1), 0.055, 1e-6);
  EXPECT_NEAR(cell(rows, "joint.LF_ANKLE.origin.x [m]", 1), 0.11, 1e-6);
  EXPECT_NEAR(cell(rows, "joint.RF_ANKLE.origin.x [m]", 1), 0.10, 1e-6);
  const double inertia = 2200 * volume * (3 * 0.0095 * 0.0095 + 0.11 * 0.11) / 12;
  EXPECT_NEAR(cell(rows, "link.LF_LEG_3.inertia.yy [kg m^2]", 1), inertia, 1e-9);
  const auto foot = [&](const char* leg, const char* axis) {
    return cell(rows, std::string("link.") + leg + "." + axis, 1);
  };
  double way2 = 0;
  for (const char* axis : {"position.x [m]", "position.y [m]", "position.z [m]"}) {
    way2 += std::pow(foot("LF_FOOT", axis) - foot("LF_LEG_3", axis), 2);
  }
  EXPECT_NEAR(std::sqrt(way2), 0.11, 1e-6);
  const testing::Result wrong = testing::graze(folder.path(), "sample a.yaml -n 9 --derived --particle 9");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, AllOf(HasSubstr("--particle"), HasSubstr("8")));
}

// A requirement and an objective over several links name the one that failed, in the score, in the list of failures, in
// the replay and in what it exports.
TEST(Sight, FailuresNameTheCulprit) {
  const TemporaryFolder folder;
  testing::write_file(
      folder / "a.yaml",
      "include: " + testing::data("scenarios/quadruped_walk.yaml") +
          "\ntime: {end: 40 ms}\n"
          "policies: {circle: ~}\n"
          "task:\n"
          "  stop_at_violation: false\n"
          "  requirements: {low: {height: {link: '{BODY0,LF_FOOT}', below: 10 cm}}, body-free: ~}\n"
          "  objective: {stands: ~, there: {position: {link: '{BODY0,RH_LEG_1}', x: {above: -1 cm}}}}\n");
  const auto graze = [&](const std::string& arguments) {
    const testing::Result got = testing::graze(folder.path(), arguments);
    EXPECT_LT(got.code, 2) << arguments << got.err;
    return got.out;
  };
  const std::string scored = graze("run a.yaml -n 4 -o a.h5 --quiet");
  EXPECT_THAT(scored, ContainsRegex("\nlow +BODY0 +4\n"));
  EXPECT_THAT(graze("score a.h5 --failures"), ContainsRegex("known failure +low +BODY0 "));
  const auto json = nlohmann::json::parse(graze("score a.h5 --json"));
  EXPECT_EQ(json["policies"][0]["culprits"][0],
            nlohmann::json({{"requirement", "low"}, {"culprit", "BODY0"}, {"traces", 4}}));
  EXPECT_EQ(json["failures"][0]["culprit"], "BODY0");
  EXPECT_THAT(graze("replay a.h5 --particle 2 -o a.csv"),
              AllOf(HasSubstr("low was violated first by BODY0"), HasSubstr("VIOLATED: low by BODY0"),
                    HasSubstr("(RH_LEG_1)")));
  EXPECT_THAT(testing::read_file(folder / "a.trace.csv"),
              AllOf(HasSubstr("violation_culprit.low,BODY0"), HasSubstr("objective_culprit,RH_LEG_1")));
  EXPECT_THAT(testing::read_file(folder / "a.derived.csv"), HasSubstr("link.LF_FOOT.mass,kg,"));
}

// An object is listed by the sizes that it has: of a sphere the radius, of a cylinder radius and length, of a box
// edges.
TEST(Sight, DerivedSizesOfObjectsAreThoseTheyHave) {
  const TemporaryFolder folder;
  const testing::Result got =
      testing::graze(folder.path(), "sample " + testing::data("scenarios/pendulum.yaml") +
                                        " -n 1 --derived --set 'environment.s={sphere: 5 cm, position: [9, 0, 9]}'"
                                        " --set 'environment.c={cylinder: [1 cm, 7 cm], position: [9, 9, 9]}'"
                                        " --set 'environment.b={box: [1, 2, 3], position: [9, 9, 0]}'");
  ASSERT_EQ(got.code, 0) << got.err;
  const auto rows = cells_of(got.out);
  EXPECT_DOUBLE_EQ(cell(rows, "object.s.radius [m]", 1), 0.05);
  EXPECT_DOUBLE_EQ(cell(rows, "object.c.radius [m]", 1), 0.01);
  EXPECT_DOUBLE_EQ(cell(rows, "object.c.length [m]", 1), 0.07);
  EXPECT_DOUBLE_EQ(cell(rows, "object.b.size.z [m]", 1), 3);
  EXPECT_THAT(got.out, ::testing::Not(HasSubstr("object.s.size")));
}

// A joint that the URDF gives no limit has an infinite nominal one, which every verb copes with: JSON says null.
TEST(Sight, NominalValuesMayBeInfinite) {
  const TemporaryFolder folder;
  testing::write_file(folder / "a.yaml",
                      "include: " + testing::data("scenarios/drop_and_stand.yaml") +
                          "\nrobot: {urdf: " + std::string(GRAZE_SOURCE_DIR) +
                          "/tests/scenarios/robots/hopper.urdf}\ntime: {end: 20 ms}\nuncertain: !replace\n"
                          "  'robot.joint.wheel.{effort,velocity}': {uniform: [4, 5]}\n");
  const auto graze = [&](const std::string& arguments) {
    const testing::Result got = testing::graze(folder.path(), arguments);
    EXPECT_LT(got.code, 2) << arguments << got.err;
    return got.out;
  };
  const auto checked = nlohmann::json::parse(graze("check a.yaml --json"));
  EXPECT_EQ(checked["parameters"][0]["name"], "robot.joint.wheel.effort");
  EXPECT_TRUE(checked["parameters"][0]["nominal"].is_null());
  EXPECT_EQ(cells_of(graze("sample a.yaml -n 3")).size(), 4u);
  graze("run a.yaml -n 2 -o a.h5 --quiet");
  const auto replayed = nlohmann::json::parse(graze("replay a.h5 --particle 1 --json"));
  EXPECT_TRUE(replayed["parameters"][0]["nominal"].is_null());
  EXPECT_THAT(graze("replay a.h5 --particle 1 --all"),
              AllOf(HasSubstr("robot.joint.wheel.effort"), ::testing::Not(HasSubstr("-inf"))));
}

}  // namespace
}  // namespace graze
