// Claim: a scenario can be read again from what it was read from, when nothing of it is left on the disk.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "scenarios/scenario.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(ReloadedScenario, NeedsNoFilesAndIsTheSame) {
  const fs::path folder = fs::path(::testing::TempDir()) / "reload";
  write(folder / "robots/one.urdf",
        R"(<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)");
  write(folder / "part/common.yaml", "time: {end: 2 s}\n");
  write(folder / "tables/swing.csv", "time,hinge\n0,0\n1,0.5\n");
  write(folder / "scenarios/a.yaml",
        "graze: 1\ninclude: ../part/common.yaml\nrobot: {urdf: ../robots/one.urdf, base: fixed}\n"
        "policies:\n  p:\n    joint_trajectory: {table: ../tables/swing.csv}\n    control: {joint_pd: {kp: 1}}\n");
  const Scenario first = load_scenario((folder / "scenarios/a.yaml").string(), {{{"time.end", "3 s"}}});
  EXPECT_EQ(first.source.inputs.size(), 4u);
  fs::remove_all(folder);

  const InputReplay replay(first.source.inputs, first.source.folder);
  const Scenario again = reload_scenario(first.source);
  EXPECT_EQ(again.sha256, first.sha256);
  EXPECT_EQ(again.timing.end, 3.0);
  EXPECT_EQ(again.model.bodies.size(), first.model.bodies.size());
}

TEST(ReloadedScenario, NamesTheFileThatWasNotKept) {
  const InputReplay replay({{"/x/a.yaml", "graze: 1\nrobot: {urdf: gone.urdf}\npolicies: {}\n"}}, "/x");
  try {
    reload_scenario({"a.yaml", "/x", {}, {}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("gone.urdf"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("not among the files"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace graze
