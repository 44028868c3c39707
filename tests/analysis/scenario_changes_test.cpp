// Claim: every value that differs between two scenarios is told with its path, and nothing else.
#include "analysis/scenario_changes.h"

#include <gtest/gtest.h>

namespace graze {
namespace {

TEST(ScenarioChanges, NamesEachValueThatDiffers) {
  const std::string a =
      "name: A\n"
      "sampling: {seed: 1, particles: 5}\n"
      "task: {requirements: {upright: {tilt: {below: 45 deg}}, old: {speed: {below: 1}}}}\n"
      "gravity: [0, 0, -9.81]\n"
      "objects: [{sphere: 1}, {box: [1, 2, 3]}]\n";
  const std::string b =
      "name: B\n"
      "sampling: {seed: 2, particles: 9}\n"
      "gravity: [0, 0, -1.62]\n"
      "task: {requirements: {upright: {tilt: {below: 12 deg}}}}\n"
      "objects: [{sphere: 1}, {box: [1, 2, 4]}]\n"
      "time: {end: 3 s}\n";
  const std::vector<ScenarioChange> got = scenario_changes(a, b);
  const ScenarioChange wanted[] = {{"task.requirements.upright.tilt.below", "45 deg", "12 deg"},
                                   {"task.requirements.old.speed.below", "1", ""},
                                   {"gravity", "[0, 0, -9.81]", "[0, 0, -1.62]"},
                                   {"objects.1.box", "[1, 2, 3]", "[1, 2, 4]"},
                                   {"time.end", "", "3 s"}};
  ASSERT_EQ(got.size(), std::size(wanted));
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].path, wanted[i].path);
    EXPECT_EQ(got[i].in_a, wanted[i].in_a) << got[i].path;
    EXPECT_EQ(got[i].in_b, wanted[i].in_b) << got[i].path;
  }
}

TEST(ScenarioChanges, OfEqualOnesThereAreNone) {
  EXPECT_TRUE(scenario_changes("a: [1, {b: ~}]\n", "a:\n- 1\n- b:\n").empty()) << "however it is written";
  EXPECT_TRUE(scenario_changes("not: [yaml", "not: [yaml").empty());
}

// A robot or mesh of another content is a change, though the scenario's text names the same file.
TEST(ScenarioChanges, AreOfFilesToo) {
  const std::map<std::string, std::string> a = {{"/x/s.yaml", "a"}, {"/x/r.urdf", "one"}, {"/x/m.obj", "same"}},
                                           b = {{"/y/s.yaml", "b"},
                                                {"/y/r.urdf", "other"},
                                                {"/y/m.obj", "same"},
                                                {"/y/new.stl", "1"}};
  const std::vector<ScenarioChange> got = file_changes(a, b);
  ASSERT_EQ(got.size(), 2u);
  EXPECT_EQ(got[0].path, "file r.urdf");
  EXPECT_EQ(got[0].in_a.substr(0, 8), "3 bytes,");
  EXPECT_EQ(got[0].in_b.substr(0, 8), "5 bytes,");
  EXPECT_EQ(got[1].path, "file new.stl");
  EXPECT_EQ(got[1].in_a, "");
  EXPECT_TRUE(file_changes(a, {}).empty()) << "an archive that kept none";
}

}  // namespace
}  // namespace graze
