#pragma once
// A small design problem for tests of `graze improve`: two pendulums that must not swing faster than 3.4 rad/s, let go
// at ever larger angles.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "scenarios/scenario.h"
#include "tests/jobs/program.h"

namespace graze::testing {

/// Two pendulums of 30 cm on a post, let go at 70 degrees.
inline constexpr const char* kTwins = R"(<robot name="twins"><link name="post"/>
  <joint name="left" type="continuous"><origin xyz="0 0.2 0.5"/><parent link="post"/><child link="left_rod"/>
    <axis xyz="0 1 0"/><limit effort="1" velocity="20"/></joint>
  <link name="left_rod"><inertial><origin xyz="0 0 -0.15"/><mass value="0.1"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.15"/><geometry><cylinder radius="0.004" length="0.3"/></geometry></collision></link>
  <joint name="right" type="continuous"><origin xyz="0 -0.2 0.5"/><parent link="post"/><child link="right_rod"/>
    <axis xyz="0 1 0"/><limit effort="1" velocity="20"/></joint>
  <link name="right_rod"><inertial><origin xyz="0 0 -0.15"/><mass value="0.1"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.15"/><geometry><cylinder radius="0.004" length="0.3"/></geometry></collision></link>
</robot>)";

inline constexpr const char* kSwing = R"(graze: 1
name: Swing
robot:
  urdf: twins.urdf
  base: fixed
  initial: {joints: {"*": 70 deg}}
time: {end: 0.1 s, step: 1 ms, control: 10 ms}
uncertain:
  robot.joint.*.damping: {uniform: [0, 0.002]}
  initial.joint.*.position: {normal: {std: 4 deg}}
policies:
  free: {hold: {}, control: {torque: {}}}
task:
  requirements:
    slow: {joint_speed: {joints: "*", below: 3.4 rad/s}}
)";

inline constexpr const char* kBothRods = R"(
design:
  variables:
    rods: {of: "robot.link.*_rod.length", within: [10 cm, 60 cm]}
    thick: {of: "robot.link.*_rod.radius", within: [2 mm, 20 mm]}
    motor: {of: "robot.joint.*.effort", factor: [0.5, 2]}
  task: {path: "robot.initial.joints.*", values: [70 deg, 80 deg, 90 deg]}
)";

struct SwingSession : ::testing::Test {
  SwingSession() {
    write_file(folder / "twins.urdf", kTwins);
    write(kBothRods);
  }
  void write(const std::string& design) { write_file(folder / "swing.yaml", kSwing + design); }
  Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
  nlohmann::json history(const std::string& options, int code = 0) const {
    const Result run = graze("improve swing.yaml --json " + options);
    EXPECT_EQ(run.code, code) << run.err;
    return run.code == 2 ? nlohmann::json() : nlohmann::json::parse(run.out);
  }
  /// What is told of a session that cannot be.
  std::string refusal(const std::string& options) const {
    const Result run = graze("improve swing.yaml " + options);
    EXPECT_EQ(run.code, 2) << options << run.out;
    return run.err;
  }
  Scenario scenario() const { return load_scenario((folder / "swing.yaml").string()); }

  TemporaryFolder folder;
};

}  // namespace graze::testing
