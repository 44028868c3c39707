// Claim: the joints of a proposed scenario are held as stiffly as the robot's own weight and size ask for.
#include "scenarios/proposal.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/settings/inputs.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

/// N m/rad: weight times half the height within 0.05 rad, on each foot.
double expected(double mass, double height, int feet) { return 9.81 * mass * 0.5 * height / 0.05 / feet; }

TEST(Proposal, HoldsARobotByItsWeight) {
  const std::string robots = std::string(GRAZE_SOURCE_DIR) + "/data/robots/", file = robots + "new.yaml";
  const HoldGains light = propose_hold({robots + "links.urdf", file});
  const HoldGains heavy = propose_hold({robots + "links_published.urdf", file});
  // kg and m, as the scenarios say that the robots begin, on bent legs; gains have two digits.
  EXPECT_NEAR(light.stiffness / expected(1.438, 0.217, 4), 1, 0.03);
  EXPECT_NEAR(heavy.stiffness / expected(3.8, 0.193, 4), 1, 0.03);
  for (const HoldGains& gains : {light, heavy})
    EXPECT_NEAR(gains.damping, 0.05 * gains.stiffness, 0.06 * gains.damping);
  const std::string text = propose_scenario({robots + "links.urdf", file});
  EXPECT_THAT(text,
              ::testing::HasSubstr(fmt::format("joint_pd: {{kp: {:g}, kd: {:g}}}", light.stiffness, light.damping)));
}

// A robot's name cannot write into the scenario.
TEST(Proposal, NamesStayInTheirComment) {
  const std::string urdf =
      "<robot name=\"evil&#10;include: extra.yaml&#10;#\"><link name=\"a\"><collision><geometry>"
      "<sphere radius=\"0.1\"/></geometry></collision></link></robot>";
  const InputReplay files({{"/evil.urdf", urdf}}, "/");
  const std::string text = propose_scenario({"/evil.urdf", "/evil.yaml"});
  EXPECT_THAT(text, ::testing::HasSubstr("# evil?include: extra.yaml?#: "));
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("\ninclude")));
}

// Nor can a joint's, whatever stands in it, and masses may be as small as they like.
TEST(Proposal, TakesAnyNameAndMass) {
  const std::string urdf =
      "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1e-320\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"1\" "
      "iyz=\"0\" izz=\"1\"/></inertial><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>"
      "<link name=\"b\"><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>"
      "<joint name=\"j&#10;'k&#9;\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"1 0 "
      "0\"/></joint>"
      "</robot>";
  const InputReplay files({{"/r.urdf", urdf}}, "/");
  EXPECT_THAT(propose_scenario({"/r.urdf", "/r.yaml"}), ::testing::HasSubstr("\"j\\x0a'k\\x09\""));
}

// Damping of the file stays; joints without get some.
TEST(Proposal, KeepsTheDampingOfTheUrdf) {
  const auto proposed = [](const std::string& damping) {
    const auto link = [](const std::string& name) {
      return "<link name=\"" + name + "\"><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>";
    };
    const auto joint = [](const std::string& name, const std::string& child, const std::string& more) {
      return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"a\"/><child link=\"" + child +
             "\"/><origin xyz=\"0 0 1\"/>" + more + "</joint>";
    };
    const std::string urdf = "<robot name=\"r\">" + link("a") + link("b") + link("c") + joint("j1", "b", damping) +
                             joint("j2", "c", "") + "</robot>";
    const InputReplay files({{"/r.urdf", urdf}}, "/");
    return propose_scenario({"/r.urdf", "/r.yaml"});
  };
  const std::string own = proposed("<dynamics damping=\"0.5\"/>");
  EXPECT_THAT(own, ::testing::HasSubstr("  'robot.joint.j2.damping': "));
  EXPECT_THAT(own, ::testing::Not(::testing::HasSubstr("j1.damping")));
  EXPECT_THAT(own, ::testing::Not(::testing::HasSubstr("joint.*.damping")));
  EXPECT_THAT(proposed(""), ::testing::HasSubstr("  robot.joint.*.damping: "));
}

// Its ground is not called as a link of the robot is.
TEST(Proposal, FindsAFreeNameForItsGround) {
  const auto proposed = [](const std::string& links) {
    const std::string urdf = "<robot name=\"r\">" + links + "</robot>";
    const InputReplay files({{"/r.urdf", urdf}}, "/");
    return propose_scenario({"/r.urdf", "/r.yaml"});
  };
  const auto link = [](const std::string& name) {
    return "<link name=\"" + name + "\"><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>";
  };
  EXPECT_THAT(proposed(link("ground")), ::testing::HasSubstr("\n  floor: {plane: z}"));
  EXPECT_THAT(proposed(link("ground") + link("floor") +
                       "<joint name=\"j\" type=\"fixed\"><parent link=\"ground\"/><child link=\"floor\"/></joint>"),
              ::testing::HasSubstr("\n  floor_2: {plane: z}"));
}

// A proposal that its own reading refuses is our mistake: it is said so, without a line of a file that is not there.
TEST(Proposal, CallsItsOwnMistakesDefects) {
  const ProposalRequest request{"box.urdf", "box.yaml"};
  EXPECT_EQ(
      refused_proposal(request, "box.yaml:12:3: uncertain.x: 1 rad: the unit 'rad' does not fit\nand more"),
      "box.yaml: a scenario of box.urdf was made and is refused by its own reading, so nothing is written: "
      "uncertain.x: 1 rad: the unit 'rad' does not fit; this is a defect of graze new; please report it, with the "
      "robot");
  const std::string robots_own = "box.urdf:3: link: <link> needs a non-empty name";
  EXPECT_EQ(refused_proposal(request, robots_own), robots_own);
}

}  // namespace
}  // namespace graze
