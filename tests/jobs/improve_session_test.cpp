// Claim: a session of `graze improve` is of one robot, one question and one process at a time; what cannot be meant is
// refused, and what others have put into its folder stays.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "tests/jobs/swing_session.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

using ImproveSession = testing::SwingSession;

TEST_F(ImproveSession, OfAnotherRobotDoesNotGoOn) {
  ASSERT_EQ(graze("improve swing.yaml --max-steps 1 -o s").code, 4);
  const std::string robot = testing::read_file(folder / "twins.urdf");
  std::string heavier = robot;
  heavier.replace(heavier.find("mass value=\"0.1\""), 16, "mass value=\"0.2\"");
  testing::write_file(folder / "twins.urdf", heavier);
  EXPECT_THAT(refusal("-o s"), AllOf(HasSubstr("improve.json: is of another robot"), HasSubstr("--force")));
  ASSERT_EQ(graze("run swing.yaml --quiet -n 32 -o heavy.graze").code, 0);
  testing::write_file(folder / "twins.urdf", robot);
  EXPECT_EQ(graze("improve swing.yaml --max-steps 2 -o s").code, 4);
  EXPECT_THAT(refusal("--from heavy.graze -o t"),
              AllOf(HasSubstr("--from heavy.graze: is a campaign with another"), HasSubstr("twins.urdf")));
}

TEST_F(ImproveSession, HasOneProcess) {
  testing::Result first;
  std::thread asking([&] {
    first = testing::shell(folder.path(), "(sleep 5; echo quit) | '" + std::string(GRAZE_PROGRAM) +
                                              "' improve swing.yaml --ask -o s > first.out");
  });
  for (int k = 0; k < 100 && !std::filesystem::exists(folder / "s" / "lock"); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const testing::Result second = graze("improve swing.yaml -o s");
  asking.join();
  EXPECT_EQ(first.code, 4) << first.err;
  EXPECT_EQ(second.code, 3);
  EXPECT_THAT(second.err, HasSubstr("is writing here"));
  EXPECT_EQ(graze("improve swing.yaml -o s").code, 0);
}

TEST_F(ImproveSession, RefusesWhatCannotBeMeant) {
  const auto told = [&](const std::string& design) {
    write("design: " + design + "\n");
    const std::string out = refusal("-o none");
    EXPECT_EQ(graze("run swing.yaml --quiet -n 2 --force -o run.graze").code, 0) << "campaigns do not heed it";
    return out;
  };
  const std::string rods = "rods: {of: \"robot.link.*_rod.length\", within: [10 cm, 60 cm]}";
  EXPECT_THAT(told("{variables: {a: {of: [], within: [1, 2]}}}"),
              AllOf(HasSubstr("swing.yaml:"), HasSubstr("names nothing")));
  EXPECT_THAT(told("{variables: {a: {of: , within: [1, 2]}}}"), HasSubstr("names nothing"));
  EXPECT_THAT(told("{variables: {" + rods + "}, fixed: [{sum: []}]}"), HasSubstr("names no variable"));
  for (const char* path : {"\"\"", "name", "sampling.particles", "design.variables.rods.within", "record"}) {
    EXPECT_THAT(
        told("{variables: {" + rods + "}, task: {path: " + path + ", values: [1, 2]}}"),
        AllOf(HasSubstr("swing.yaml:"), HasSubstr("task.path"),
              AnyOf(HasSubstr("names no setting"), HasSubstr("makes no task harder"), HasSubstr("no such setting"))))
        << path;
  }
  EXPECT_THAT(told("{variables: {" + rods + "}, task: {path: \"robot.initial.joints.*\", values: [70 deg, fast]}}"),
              AllOf(HasSubstr("swing.yaml:16:"), HasSubstr("2 of 2 (fast)"), Not(HasSubstr("--set"))));
}

// Damping is drawn between fixed bounds: whatever the design's is, no particle has it.
TEST_F(ImproveSession, TellsOfVariablesThatParticlesDoNotHeed) {
  write(
      "design: {variables: {damper: {of: \"robot.joint.*.damping\", within: [0, 0.1]}, "
      "rods: {of: \"robot.link.*_rod.length\", within: [10 cm, 60 cm]}}}\n");
  const testing::Result nominal = graze("improve swing.yaml --max-steps 1 -o a");
  EXPECT_EQ(nominal.code, 4);
  EXPECT_THAT(nominal.err, AllOf(HasSubstr("design.variables.damper: robot.joint.left.damping is uniform"),
                                 HasSubstr("do not heed it"), Not(HasSubstr("variables.rods"))));
  EXPECT_THAT(refusal("-n 4 -o b"), HasSubstr("do not heed it"));
}

TEST_F(ImproveSession, WorksInFoldersOfOddNames) {
  for (const char* name : {"a #b", "a: b"}) {
    const std::filesystem::path odd = folder / name;
    std::filesystem::create_directory(odd);
    std::filesystem::copy(folder / "swing.yaml", odd / "swing.yaml");
    std::filesystem::copy(folder / "twins.urdf", odd / "twins.urdf");
    EXPECT_EQ(testing::graze(odd, "improve swing.yaml -o s").code, 0) << name;
    EXPECT_EQ(testing::graze(odd, "run s/improved.yaml -n 2 --quiet").code, 0) << name;
  }
}

TEST_F(ImproveSession, MakesItsPictureAnewAndNoOther) {
  const std::string command = "improve swing.yaml --plot p.svg -o s --max-steps ";
  ASSERT_EQ(graze(command + "1").code, 4);
  EXPECT_EQ(graze(command + "2").code, 4) << "it is its own";
  testing::write_file(folder / "q.svg", "mine");
  EXPECT_THAT(refusal("-o s --plot q.svg"), HasSubstr("q.svg: exists already"));
  std::filesystem::resize_file(folder / "s" / "improve.json", 100);
  EXPECT_THAT(refusal("-o s"), AllOf(HasSubstr("improve.json: is damaged"), HasSubstr("--force begins anew")));
}

TEST_F(ImproveSession, ReplacesNoCampaignsButItsOwn) {
  ASSERT_EQ(graze("improve swing.yaml -o s").code, 0);
  ASSERT_EQ(graze("run swing.yaml --quiet -n 2 -o s/before.graze").code, 0);
  const testing::Result refused = graze("improve swing.yaml --verdict 4 -o s");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("before.graze: is there already, and no verdict"));
  std::filesystem::remove_all(folder / "s" / "before.graze");
  EXPECT_EQ(graze("improve swing.yaml --verdict 4 -o s").code, 0);
  const testing::Result again = graze("improve swing.yaml --verdict 6 -o s");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("Verdict on 6 particles"));
}

}  // namespace
}  // namespace graze
