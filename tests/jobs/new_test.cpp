// Claim: `graze new` writes a scenario of any robot that runs as it is, and says in it what it found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class New : public ::testing::Test, public testing::BallCampaign {
 protected:
  testing::Result run_new(const std::string& file) const {
    return graze("run " + file + " -n 2 --set time.end='0.05 s' --quiet");
  }
};

TEST_F(New, OfAQuadrupedWalksToo) {
  const std::string robot = std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf";
  const testing::Result made = graze("new sub/links.yaml " + robot);
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("graze run sub/links.yaml"));
  const std::string text = testing::read_file(folder / "sub/links.yaml");
  EXPECT_THAT(text, AllOf(HasSubstr("  trot:"), HasSubstr("'LF_FOOT', 'RF_FOOT', 'LH_FOOT', 'RH_FOOT'"),
                          HasSubstr("upright: {tilt: {link: 'BODY0'"), HasSubstr("      'LF_X_1': 0  #")));
  const testing::Result run = run_new("sub/links.yaml");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("hold"), HasSubstr("trot")));
}

TEST_F(New, OfARobotWithoutJointsFallsAndRests) {
  testing::write_file(folder / "it's a brick.urdf",
                      "<robot name=\"brick\"><link name=\"brick\"><collision><geometry><box size=\"0.2 0.1 0.05\"/>"
                      "</geometry></collision></link></robot>");
  EXPECT_EQ(graze("new brick.yaml \"it's a brick.urdf\"").code, 0);
  EXPECT_THAT(testing::read_file(folder / "brick.yaml"),
              AllOf(HasSubstr("urdf: 'it''s a brick.urdf'"), Not(HasSubstr("robot.joint.")), HasSubstr("rests:")));
  const testing::Result run = run_new("brick.yaml");
  EXPECT_EQ(run.code, 0) << run.err;
  const testing::Result stands = graze("check drop_and_stand --set robot.urdf=\"it's a brick.urdf\"");
  EXPECT_EQ(stands.code, 0) << stands.err;
  EXPECT_THAT(stands.err, HasSubstr("robot.joint.*.damping: the robot has no joint that moves, so this says nothing"));
  const testing::Result misspelt = graze("check brick.yaml --set uncertain.robot.joint.*.dampng=1");
  EXPECT_EQ(misspelt.code, 2);
}

// A gripper whose right finger follows the left one: one joint to drive and to begin, and whoever names the other is
// told why not.
TEST_F(New, OfAGripperDrivesWhatOthersFollow) {
  const auto finger = [](const std::string& name, const std::string& mimic) {
    return "<link name=\"" + name +
           "\"><collision><geometry><box size=\"0.02 0.02 0.06\"/></geometry></collision></link><joint name=\"j_" +
           name + "\" type=\"prismatic\"><parent link=\"palm\"/><child link=\"" + name +
           "\"/><axis xyz=\"1 0 0\"/><limit lower=\"-0.1\" upper=\"0.1\" effort=\"10\" velocity=\"1\"/>" + mimic +
           "</joint>";
  };
  testing::write_file(
      folder / "gripper.urdf",
      "<robot name=\"gripper\"><link name=\"palm\"><collision><geometry><box size=\"0.1 0.1 0.02\"/></geometry>"
      "</collision></link>" +
          finger("left", "") + finger("right", "<mimic joint=\"j_left\" multiplier=\"-1\" offset=\"0.05\"/>") +
          "</robot>");
  const testing::Result made = graze("new gripper.yaml gripper.urdf");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(
      testing::read_file(folder / "gripper.yaml"),
      AllOf(HasSubstr("1 driven joints"), HasSubstr("zero: {normal: {std: 1 mm}}"),
            HasSubstr("# 'j_right' follows 'j_left' (<mimic>): -1 times"), Not(HasSubstr("      'j_right': "))));
  for (const char* physics : {"lanes", "bullet"}) {
    const testing::Result run =
        graze(std::string("run gripper.yaml -n 2 --set time.end='0.05 s' --quiet --set physics=") + physics);
    EXPECT_EQ(run.code, 0) << run.err;
  }
  EXPECT_THAT(graze("check gripper.yaml").out, HasSubstr("1 driven joint (1 more follows them)"));
  EXPECT_THAT(graze("check gripper.yaml --json").out, AllOf(HasSubstr("\"follows\""), HasSubstr("\"j_left\"")));
  const testing::Result begins = graze("check gripper.yaml --set robot.initial.joints.j_right=0.01");
  EXPECT_EQ(begins.code, 2);
  EXPECT_THAT(begins.err, HasSubstr("'j_right' follows 'j_left' (<mimic> of the URDF: -1 times its position + 0.05)"));
  const testing::Result drives =
      graze("check gripper.yaml --set \"policies.hold.control={joint_pd: {kp: {j_right: 1}}}\"");
  EXPECT_EQ(drives.code, 2);
  EXPECT_THAT(drives.err, HasSubstr("'j_right' follows 'j_left' (<mimic> of the URDF) and has no drive of its own"));
}

TEST_F(New, SaysWhichLinksBeginInEachOther) {
  const std::string robot = std::string(GRAZE_SOURCE_DIR) + "/tests/scenarios/robots/tangle.urdf";
  EXPECT_EQ(graze("new tangle.yaml " + robot).code, 0);
  EXPECT_THAT(testing::read_file(folder / "tangle.yaml"), HasSubstr("- ['b', 'd']  # by 20 mm"));
  const testing::Result check = graze("check tangle.yaml");
  EXPECT_EQ(check.code, 0);
  EXPECT_THAT(check.err, Not(HasSubstr("each other")));
}

TEST_F(New, KeepsWhatIsThere) {
  testing::write_file(folder / "mine.yaml", "mine");
  const testing::Result there = graze("new mine.yaml ball.urdf");
  EXPECT_EQ(there.code, 2);
  EXPECT_THAT(there.err, HasSubstr("--force"));
  EXPECT_EQ(testing::read_file(folder / "mine.yaml"), "mine");
  EXPECT_EQ(graze("new mine.yaml ball.urdf --force").code, 0);
  EXPECT_THAT(testing::read_file(folder / "mine.yaml"), HasSubstr("graze: 1"));
  EXPECT_THAT(graze("new ball.urdf new.yaml").err, HasSubstr("graze new new.yaml ball.urdf"));
  EXPECT_THAT(graze("new new.txt ball.urdf").err, HasSubstr(".yaml"));
  EXPECT_THAT(graze("new new.yaml bal.urdf").err, HasSubstr("did you mean"));
  EXPECT_FALSE(testing::fs::exists(folder / "new.yaml"));
}

}  // namespace
}  // namespace graze
