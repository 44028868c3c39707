// Claim: `graze new` writes a scenario of any robot that runs as it is, and says in it what it found.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

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

// Claim: a robot without driven joints gets no gains, and one of which nothing moves no task and nothing uncertain;
// what is told of it counts what is welded, and it runs without a warning but that nothing can fail.
TEST_F(New, OfARobotWithoutJoints) {
  ASSERT_EQ(graze("new free.yaml ball.urdf").code, 0);
  const std::string free = testing::read_file(folder / "free.yaml");
  EXPECT_THAT(free, AllOf(HasSubstr(" 1 link, 0 driven joints, "), HasSubstr("rests:"), HasSubstr("*.mass"),
                          HasSubstr("there is no driven joint"), Not(HasSubstr("N m/rad"))));
  EXPECT_EQ(run_new("free.yaml").code, 0);
  testing::write_file(folder / "post.urdf",
                      "<robot name='post'><link name='world'/><joint name='weld' type='fixed'><parent link='world'/>"
                      "<child link='post'/></joint><link name='post'><inertial><mass value='2.5'/><inertia ixx='1' "
                      "iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  ASSERT_EQ(graze("new post.yaml post.urdf").code, 0);
  const std::string post = testing::read_file(folder / "post.yaml");
  EXPECT_THAT(post, AllOf(HasSubstr("# post: 2.5 kg, 0 kg of it moving, 2 links, "), Not(HasSubstr("rests:")),
                          Not(HasSubstr("\nuncertain:")), Not(HasSubstr("N m/rad"))));
  const testing::Result run = graze("run post.yaml -n 3 --quiet -o post.graze");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(Not(HasSubstr("welded")), Not(HasSubstr("always holds"))));
  EXPECT_THAT(graze("explain post.graze").out,
              HasSubstr("3 of 3 traces ran to the end: nothing moves, so that there is no state"));
  EXPECT_THAT(graze("replay post.graze --particle 0").out,
              AllOf(HasSubstr("digest     of nothing, as nothing moves"), Not(HasSubstr("0x0000"))));
  EXPECT_THAT(graze("check post.yaml").out, HasSubstr("fixed base, 2.5 kg, 0 kg of it moving"));
}

// Claim: the templates of robots are whole: their scenarios run in the folder as they stand, and judge both policies.
TEST_F(New, WritesAFolderWithARobot) {
  const auto succeed = [&](const std::string& name, const std::string& policies) {
    const testing::Result made = graze("new " + name + " sub/" + name);
    EXPECT_EQ(made.code, 0) << made.err;
    EXPECT_THAT(made.out, HasSubstr("cd sub/" + name + " && graze run scenario.yaml"));
    const testing::Result run = graze("run sub/" + name + "/scenario.yaml -n 8 --quiet -o " + name + ".graze");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_EQ(graze("score " + name + ".graze " + policies).code, 0);
    EXPECT_EQ(graze("new " + name + " sub/" + name).code, 2);  // is there already
  };
  succeed("quadruped", "--require 'stand: p >= 0.6' --require 'trot: p >= 0.3'");
  succeed("arm", "--require 'stiff: p >= 0.6' --require 'soft: p < 0.9'");  // the soft one sags under its load
  EXPECT_THAT(graze("new quadrupd walk").err, HasSubstr("did you mean quadruped?"));
  EXPECT_THAT(graze("new arm").err, HasSubstr("graze new arm my_arm"));
}

// Claim: a scenario that cannot be written is the machine's doing, exit code 3, before the robot is read.
TEST_F(New, WhereNothingCanBeWritten) {
  const testing::Result made = graze("new ball.yaml/sub/x.yaml ball.urdf");
  EXPECT_EQ(made.code, 3);
  EXPECT_THAT(made.err, HasSubstr("cannot be written"));
}

// A disk that is full in the middle of a folder: its file and the reason are told, and nothing stays.
TEST_F(New, LeavesNoHalfOfAFolder) {
  std::filesystem::create_directories(folder / "empty");
  for (const char* name : {"sub/mine", "empty"}) {
    const testing::Result made = testing::shell(
        folder.path(), "ulimit -f 4; '" + std::string(GRAZE_PROGRAM) + "' new policy-c " + std::string(name));
    EXPECT_EQ(made.code, 3) << made.err;
    EXPECT_THAT(made.err, AllOf(HasSubstr(std::string(name) + "/"), HasSubstr(": cannot be written: File too large")));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "sub"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "empty"));
}

/// A quadruped of 8.9 kg with the masses of a published one, whose hips weigh to the left.
std::string skew_quadruped() {
  const auto inertia = [](double x, double y, double z) {
    return fmt::format("<inertia ixx='{}' ixy='0' ixz='0' iyy='{}' iyz='0' izz='{}'/>", x, y, z);
  };
  std::string out = "<robot name='skew'><link name='body'><inertial><mass value='3.3'/>" +
                    inertia(0.011, 0.036, 0.043) +
                    "</inertial><collision><geometry><box size='0.3 0.15 0.08'/></geometry></collision></link>\n";
  const auto link = [&](const std::string& name, double mass, const char* com, const std::string& rest) {
    out +=
        fmt::format("<link name='{}'><inertial><origin xyz='{}'/><mass value='{}'/>{}</link>\n", name, com, mass, rest);
  };
  const auto joint = [&](const std::string& parent, const std::string& child, const std::string& place,
                         const char* axis) {
    out += fmt::format(
        "<joint name='to_{1}' type='{4}'><parent link='{0}'/><child link='{1}'/><origin xyz='{2}'/><axis xyz='{3}'/>"
        "</joint>\n",
        parent, child, place, axis, *axis ? "continuous" : "fixed");
  };
  using Leg = std::tuple<const char*, int, int>;
  for (const auto& [leg, x, y] : {Leg("fl", 1, 1), Leg("fr", 1, -1), Leg("hl", -1, 1), Leg("hr", -1, -1)}) {
    const std::string hip = std::string("hip_") + leg, thigh = std::string("thigh_") + leg;
    const std::string shin = std::string("shin_") + leg, toe = std::string("toe_") + leg;
    link(hip, 0.54, "0 0.036 0", inertia(0.0004, 0.0005, 0.0004) + "</inertial>");
    joint("body", hip, fmt::format("{} {} 0", 0.19 * x, 0.049 * y), "1 0 0");
    link(thigh, 0.634, "0 0.016 -0.02", inertia(0.002, 0.0021, 0.0004) + "</inertial>");
    joint(hip, thigh, fmt::format("0 {} 0", 0.062 * y), "0 -1 0");
    link(
        shin, 0.214, "0 0 -0.18",
        inertia(0.0003, 0.0003, 0.00003) +
            "</inertial><collision><origin xyz='0 0 -0.18'/><geometry><sphere radius='0.015'/></geometry></collision>");
    joint(thigh, shin, "0 0 -0.209", "0 -1 0");
    out += "<link name='" + toe + "'/>";
    joint(shin, toe, "0 0 -0.18", "");
  }
  return out + "</robot>";
}

// The gait that is proposed is one that the robot can walk: it stands with its feet below its centre of mass, is stiff
// enough for its weight, and no joint is braked so much that a foot comes late.
TEST_F(New, ProposesATrotThatWorks) {
  testing::write_file(folder / "skew.urdf", skew_quadruped());
  EXPECT_EQ(graze("new skew.yaml skew.urdf").code, 0);
  EXPECT_THAT(testing::read_file(folder / "skew.yaml"), HasSubstr(", -1.3 cm]}"));
  const testing::Result run = graze("run skew.yaml -n 8 -o skew.graze --quiet");
  EXPECT_EQ(run.code, 0) << run.err;
  const testing::Result gate = graze("score skew.graze --policy trot --policy hold --require 'p >= 0.6'");
  EXPECT_EQ(gate.code, 0) << gate.out;
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
      AllOf(HasSubstr("1 driven joint,"), HasSubstr("zero: {normal: {std: 1 mm}}"),
            HasSubstr("# 'j_right' follows 'j_left' (<mimic>): -1 times"), Not(HasSubstr("      'j_right': "))));
  for (const char* physics : {"lanes", "bullet"}) {
    const testing::Result run = graze(std::string("run gripper.yaml -n 2 -o ") + physics +
                                      ".graze --set time.end='0.05 s' --quiet --set physics=" + physics);
    EXPECT_EQ(run.code, 0) << run.err;
  }
  EXPECT_THAT(graze("check gripper.yaml").out, HasSubstr("1 driven joint (1 more follows it)"));
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
}

// What cannot be meant is refused in words of this command, and nothing is written.
TEST_F(New, RefusesWhatCannotBeMeant) {
  testing::fs::create_directory(folder / "folder.yaml");
  testing::fs::create_symlink("nowhere", folder / "link.yaml");
  testing::write_file(folder / "old.yaml", "mine");
  testing::write_file(folder / "bad.urdf", "<robot name='bad'>\n<link/></robot>");
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"ball.urdf new.yaml", {"the scenario that is to be written goes first", "graze new new.yaml ball.urdf"}},
      {"ball.urdf old.yaml", {"graze new old.yaml ball.urdf"}},
      {"new.yml old.yml", {"old.yml: is a scenario by its name", "graze new new.yml ROBOT.urdf"}},
      {"ball.urdf walk", {"the scenario that is to be written goes first", "graze new walk.yaml ball.urdf"}},
      {"ball.urdf ball.urdf", {"ball.urdf: is a robot by its name", "graze new ball.yaml ball.urdf"}},
      {"- sub/ball.urdf", {"-: a scenario is written to a file, not to", "graze new ball.yaml sub/ball.urdf"}},
      {"robot.urdf.xacro new.yaml", {"graze new new.yaml robot.urdf.xacro"}},
      {"new.txt ball.urdf", {"graze: new.txt: ends in .txt", "nearest right answer: new.yaml or new.yml"}},
      {"new ball.urdf", {"graze: new: has no ending", "new.yaml or new.yml"}},
      {"new.yaml/ ball.urdf", {"graze: new.yaml/: ends in a slash", "nearest right answer: new.yaml"}},
      {"new.yaml bal.urdf", {"graze: bal.urdf: there is no such file; did you mean 'bad.urdf'?"}},
      {"new.yaml folder.yaml/ball.urdf", {"graze: folder.yaml/ball.urdf: there is no such file"}},
      {"new.yaml bad.urdf", {"graze: bad.urdf:2: link: <link> needs a non-empty name"}},
      {"new.yaml .", {"not a file, but a folder"}},
      {"folder.yaml ball.urdf", {"folder.yaml: is a directory or a device; choose another name"}},
      {"link.yaml ball.urdf", {"symbolic link that leads nowhere; choose another name"}},
      {"old.yaml ball.urdf", {"old.yaml: exists already; choose another name or give --force"}},
      {"ball.urdf/new.yaml ball.urdf", {"new.yaml: lies within ball.urdf"}},
      {"/proc/new.yaml ball.urdf", {"/proc/new.yaml: cannot be written: "}},
      {"new.yaml", {"robot is required"}},
  };
  for (const auto& [arguments, words] : cases) {
    SCOPED_TRACE(arguments);
    const testing::Result refused = graze("new " + arguments);
    EXPECT_NE(refused.code, 0);
    EXPECT_THAT(refused.err, Not(HasSubstr("--output")));
    for (const std::string& word : words) EXPECT_THAT(refused.err, HasSubstr(word));
  }
  EXPECT_FALSE(testing::fs::exists(folder / "new.yaml"));
  EXPECT_EQ(testing::read_file(folder / "old.yaml"), "mine");
}

// A robot that stands on no legs, or on two, is held and not walked.
TEST_F(New, WithoutFourLegsNothingWalks) {
  const std::string arm =
      "<robot name='arm'><link name='world'/><link name='arm'><inertial><origin xyz='0.2 0 0'/><mass value='1'/>"
      "<inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>"
      "<joint name='hinge' type='revolute'><parent link='world'/><child link='arm'/><origin xyz='0 0 1'/>"
      "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='10' velocity='5'/></joint></robot>";
  testing::write_file(folder / "arm.urdf", arm);
  EXPECT_EQ(graze("new arm.yaml arm.urdf").code, 0);
  EXPECT_THAT(testing::read_file(folder / "arm.yaml"),
              AllOf(HasSubstr("  hold:"), Not(HasSubstr("trot")), HasSubstr("rests:"), HasSubstr("'hinge': 0  #")));
  const testing::Result run = run_new("arm.yaml");
  EXPECT_EQ(run.code, 0) << run.err;
}

/// One link of a robot with `mass` in a box of 4 cm, and the joint that it hangs on.
std::string jointed(const std::string& parent, const std::string& name, const std::string& type, double mass,
                    const char* axis, const char* place, const char* limit) {
  return fmt::format(
      "<link name='{1}'><inertial><mass value='{3}'/><inertia ixx='1e-3' iyy='1e-3' izz='1e-3' ixy='0' ixz='0' "
      "iyz='0'/></inertial><collision><geometry><box size='0.04 0.04 0.04'/></geometry></collision></link>"
      "<joint name='to {1}' type='{2}'><parent link='{0}'/><child link='{1}'/><origin xyz='{5}'/><axis xyz='{4}'/>"
      "<limit {6} effort='100' velocity='5'/></joint>",
      parent, name, type, mass, axis, place, limit);
}

// A robot with joints of both types has errors and gains in the units of each: a lift that carries 1.2 kg on 981 N/m
// sinks by 1.2 cm, so it has more, and stays near where it begins.
TEST_F(New, OfTurningAndSlidingJointsHoldsBoth) {
  testing::write_file(folder / "lift.urdf",
                      "<robot name='lift'><link name='world'/>" +
                          jointed("world", "carriage", "prismatic", 1, "0 0 1", "0 0 0.5", "lower='-0.3' upper='0.3'") +
                          jointed("carriage", "hand", "revolute", 0.2, "0 0 1", "0.1 0 0", "lower='-1' upper='1'") +
                          "</robot>");
  const testing::Result made = graze("new lift.yaml lift.urdf");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(testing::read_file(folder / "lift.yaml"),
              AllOf(HasSubstr("'robot.joint.to carriage.zero': {normal: {std: 1 mm}}"),
                    HasSubstr("'robot.joint.to hand.zero': {normal: {std: 0.01 rad}}"),
                    HasSubstr(", 'to carriage': 1200}  # N m/rad; N/m of those that slide")));
  const testing::Result run = graze(
      "run lift.yaml -n 8 -o lift.graze --quiet --set \"task={objective: {holds: {position: {link: carriage, z: "
      "{above: "
      "0.48}}}}}\"");
  EXPECT_EQ(run.code, 0) << run.err;
  const testing::Result gate = graze("score lift.graze --require 'p >= 0.6'");
  EXPECT_EQ(gate.code, 0) << gate.out;
}

// What hangs below z = 0 from a base that is fixed gets no ground to stand in.
TEST_F(New, OfWhatHangsBelowTheGroundHasNone) {
  const auto robot = [](const char* place) {
    return "<robot name='swing'><link name='world'/>" +
           jointed("world", "bob", "continuous", 1, "0 1 0", place, "lower='0' upper='0'") +
           jointed("bob", "tip", "continuous", 1, "0 1 0", "0 0 -1", "lower='0' upper='0'") + "</robot>";
  };
  testing::write_file(folder / "deep.urdf", robot("0 0 -2"));
  testing::write_file(folder / "high.urdf", robot("0 0 2"));
  EXPECT_EQ(graze("new deep.yaml deep.urdf").code, 0);
  EXPECT_EQ(graze("new high.yaml high.urdf").code, 0);
  const std::string deep = testing::read_file(folder / "deep.yaml");
  EXPECT_THAT(deep, AllOf(HasSubstr("# No ground: "), HasSubstr("parts 3 m below z = 0"), Not(HasSubstr("\n  ground:")),
                          Not(HasSubstr("contact.friction"))));
  EXPECT_THAT(testing::read_file(folder / "high.yaml"), HasSubstr("\n  ground: {plane: z}\n"));
  const testing::Result run = run_new("deep.yaml");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("ground")));
}

/// Four legs of `joints` joints that reach outwards, or down.
std::string four_limbs(int joints, const char* way, double reach = 1) {
  std::string out =
      "<robot name='table'><link name='body'><collision><geometry><box size='0.4 0.4 0.3'/></geometry>"
      "</collision></link>";
  for (const char* corner : {"0.2 0.2 0", "0.2 -0.2 0", "-0.2 0.2 0", "-0.2 -0.2 0"}) {
    std::string parent = "body", place = corner;
    for (int k = 0; k < joints; ++k) {
      const std::string name = fmt::format("link{}{}", k, corner);
      const std::string limit = fmt::format("lower='{}' upper='{}'", -reach, reach);
      out += jointed(parent, name, "revolute", 0.2, "0 1 0", place.c_str(), limit.c_str());
      parent = name, place = way;
    }
  }
  return out + "</robot>";
}

// What the reader made up, and why four legs do not trot, is said where the user looks, and so is what the robot
// needs in every command.
TEST_F(New, SaysWhatItMadeUpAndWhyNothingTrots) {
  testing::write_file(folder / "flat.urdf", four_limbs(3, "0.1 0 0", 0.1));
  testing::write_file(folder / "short.urdf", four_limbs(2, "0 0 -0.3"));
  const testing::Result flat = graze("new flat.yaml flat.urdf --ignore-missing-meshes");
  EXPECT_EQ(flat.code, 0) << flat.err;
  EXPECT_THAT(flat.err,
              AllOf(HasSubstr("mass made up from collision shapes"), HasSubstr("flat.yaml: no trot: 0 of its")));
  EXPECT_THAT(testing::read_file(folder / "flat.yaml"), AllOf(HasSubstr("graze run flat.yaml --ignore-missing-meshes "),
                                                              HasSubstr("  # No trot: 0 of its 4 limbs")));
  const testing::Result bent = graze("new bent.yaml '" + testing::data("robots/links_published.urdf") + "'");
  EXPECT_THAT(bent.err, Not(HasSubstr("no trot"))) << "its legs, which the URDF has stretched out, are bent";
  EXPECT_THAT(testing::read_file(folder / "bent.yaml"), HasSubstr("\n  trot:"));
  const testing::Result few = graze("new short.yaml short.urdf");
  EXPECT_THAT(few.err, HasSubstr("are 2 joints that a gait can move, and a trot needs 3 in each leg"));
  EXPECT_THAT(testing::read_file(folder / "short.yaml"), Not(HasSubstr("--ignore-missing-meshes")));
}

// Who gives a robot where a scenario belongs is told of the command that makes one.
TEST_F(New, IsNamedWhereARobotStandsForAScenario) {
  for (const char* verb : {"run", "check"}) {
    const testing::Result refused = graze(std::string(verb) + " ball.urdf");
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err,
                HasSubstr("ball.urdf: is a robot by its name, and a scenario is meant; 'graze new ball.yaml "
                          "ball.urdf' writes a first one"));
  }
}

}  // namespace
}  // namespace graze
