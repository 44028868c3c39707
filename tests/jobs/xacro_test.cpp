// Claim: a robot in a xacro file is read by any verb where a program `xacro` is on PATH, which is run as it is and
// never for a replay; what goes wrong with it is the user's to mend, exit code 2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class XacroFile : public ::testing::Test, public testing::BallCampaign {
 protected:
  XacroFile() {
    testing::fs::create_directory(folder / "bin");
    testing::write_file(folder / "ball.urdf.xacro",
                        "<robot name=\"ball\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n<xacro:ball/></robot>");
  }
  void stand_in(const std::string& script) const {
    testing::write_file(folder / "bin/xacro", "#!/bin/sh\n" + script + "\n");
    chmod((folder / "bin/xacro").c_str(), 0700);
  }
  /// With the stand-in before all else on PATH.
  testing::Result with_xacro(const std::string& arguments) const {
    return testing::shell(folder.path(), "PATH=\"$PWD/bin:$PATH\" '" + std::string(GRAZE_PROGRAM) + "' " + arguments);
  }
};

const char* const kSet = " --set robot.urdf=ball.urdf.xacro";

TEST_F(XacroFile, RunsAndIsReplayedWithoutIt) {
  stand_in("[ \"$1\" = \"" + (folder / "ball.urdf.xacro").string() + "\" ] && echo run >>runs && cat ball.urdf");
  const testing::Result run = with_xacro("run ball.yaml -n 2 -o a.graze --quiet" + std::string(kSet));
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(testing::read_file(folder / "runs"), "run\n") << "once for a campaign";
  testing::fs::remove(folder / "ball.urdf.xacro");
  testing::fs::remove(folder / "bin/xacro");
  const testing::Result replay = graze("replay a.graze --particle 1");
  EXPECT_EQ(replay.code, 0) << replay.err;
}

TEST_F(XacroFile, WhoseProgramFailsIsRefused) {
  stand_in("echo 'error: no such macro: ball' >&2; exit 2");
  const testing::Result refused = with_xacro("check ball.yaml" + std::string(kSet));
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("robot.urdf: "), HasSubstr("xacro ended with exit code 2; it said:"),
                                 HasSubstr("error: no such macro: ball")));
}

// Claim: a program that is there and whose interpreter is not is no missing program.
TEST_F(XacroFile, WhoseInterpreterIsMissingSaysSo) {
  stand_in("");
  testing::write_file(folder / "bin/xacro", "#!/nowhere/python2 -u\n");
  const testing::Result refused = with_xacro("check ball.yaml" + std::string(kSet));
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("xacro cannot be started: the interpreter in the first line of"),
                                 HasSubstr("'#!/nowhere/python2 -u', is not there")));
}

// Claim: what xacro leaves running is not waited for, wherever it has gone, and what xacro itself has written is read.
TEST_F(XacroFile, IsOverWhenItsProgramHasEnded) {
  for (const char* leave : {"sleep 50 &", "setsid sleep 50 &"}) {
    stand_in(std::string(leave) + " echo $! >left; cat ball.urdf");
    const auto begin = std::chrono::steady_clock::now();
    const testing::Result read = with_xacro("check ball.yaml" + std::string(kSet));
    EXPECT_EQ(read.code, 0) << read.err;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20)) << leave;
    testing::shell(folder.path(), "kill $(cat left)");
  }
}

// Claim: xacro does not outlive a graze that is killed.
TEST_F(XacroFile, EndsWithTheProgramThatRunsIt) {
  stand_in("echo $$ >pid; exec sleep 50");
  const testing::Result gone = testing::shell(
      folder.path(), "PATH=\"$PWD/bin:$PATH\" '" + std::string(GRAZE_PROGRAM) + "' check ball.yaml" + kSet +
                         " & graze=$!; until [ -s pid ]; do sleep 0.05; done; kill -9 $graze; wait $graze; "
                         // One that has ended may wait for init as a zombie, which `kill -0` still finds.
                         "runs() { grep -q '^State:.[^ZX]' /proc/$(cat pid)/status; }; "
                         "for i in 1 2 3 4 5 6 7 8 9 10; do runs || exit 7; sleep 0.2; done");
  EXPECT_EQ(gone.code, 7) << "xacro still runs";
}

TEST_F(XacroFile, WithoutTheProgramShowsTheCommand) {
  const testing::Result refused =
      testing::shell(folder.path(), "PATH=/nowhere '" + std::string(GRAZE_PROGRAM) + "' check ball.yaml" + kSet);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("ball.urdf.xacro:2: <xacro:ball>: this is a xacro file"),
                                 HasSubstr("xacro ball.urdf.xacro > ball.urdf")));
}

}  // namespace
}  // namespace graze
