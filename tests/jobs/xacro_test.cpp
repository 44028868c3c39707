// Claim: a robot in a xacro file is read by any verb where a program `xacro` is on PATH, which is run as it is and
// never for a replay; what goes wrong with it is the user's to mend, exit code 2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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

TEST_F(XacroFile, WithoutTheProgramShowsTheCommand) {
  const testing::Result refused =
      testing::shell(folder.path(), "PATH=/nowhere '" + std::string(GRAZE_PROGRAM) + "' check ball.yaml" + kSet);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("ball.urdf.xacro:2: <xacro:ball>: this is a xacro file"),
                                 HasSubstr("xacro ball.urdf.xacro > ball.urdf")));
}

}  // namespace
}  // namespace graze
