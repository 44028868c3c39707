// What graze check says of a scenario beyond its parameter table.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/jobs/ball_campaign.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Check : public ::testing::Test {
 protected:
  testing::BallCampaign campaign;
};

// Claim: the overview gives the robot's mass, not that of the things in its world.
TEST_F(Check, WeighsTheRobotAlone) {
  const std::string alone = campaign.graze("check ball.yaml").out;
  EXPECT_THAT(alone, HasSubstr("floating base, 1 kg"));
  EXPECT_THAT(campaign
                  .graze("check ball.yaml --set 'environment.anvil={box: [1, 1, 1], position: [9, 0, 0.5], "
                         "movable: true, mass: 50 kg}'")
                  .out,
              HasSubstr("floating base, 1 kg"));
}

// Claim: what an archive takes for contacts is not called events where none are kept.
TEST_F(Check, CallsEventsWhatAreEvents) {
  EXPECT_THAT(campaign.graze("check ball.yaml").out, AllOf(HasSubstr(", contacts "), Not(HasSubstr("events"))));
  EXPECT_THAT(campaign.graze("check ball.yaml --set record.events=true").out, HasSubstr(", contacts and events "));
}

// Claim: what is welded to the world counts in the mass, as in `sample --derived`, and is told apart; its uncertain
// mass changes nothing, and is counted as such, also where a glob names it among others.
TEST_F(Check, TellsWhatIsWelded) {
  const auto link = [](const std::string& name, double mass) {
    return "<link name='" + name + "'><inertial><mass value='" + std::to_string(mass) +
           "'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>";
  };
  testing::write_file(campaign.folder / "arm.urdf",
                      "<robot name='arm'>" + link("base", 3) + link("arm", 2) +
                          "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>");
  testing::write_file(
      campaign.folder / "arm.yaml",
      "graze: 1\nrobot: {urdf: arm.urdf, base: fixed}\ntime: {end: 0.1 s}\nuncertain: {'*.mass': {normal: "
      "{std: 1 %}}}\npolicies: {limp: {hold: {}, control: {joint_pd: {kp: 0}}}}\ntask: {objective: {rests: "
      "{speed: {link: arm, below: 1 m/s}}}}\n");
  const std::string arm = "arm.yaml";
  const testing::Result text = campaign.graze("check " + arm);
  EXPECT_THAT(text.out, AllOf(HasSubstr("fixed base, 5 kg, 2 kg of it moving\n"),
                              HasSubstr("; 1 of them without effect: its link is welded to the world")))
      << text.err;
  const auto json = nlohmann::json::parse(campaign.graze("check --json " + arm).out);
  EXPECT_EQ(json["robot"]["mass"], 5);
  EXPECT_EQ(json["robot"]["moving_mass"], 2);
}

// Claim: what --set says of a value that every particle draws for itself is doubted, unless what is drawn follows it.
TEST_F(Check, DoubtsNominalValuesOfWhatIsDrawn) {
  const std::string uniform = "check ball.yaml --set 'uncertain.contact.friction={uniform: [0.5, 1.2]}'";
  EXPECT_THAT(campaign.graze(uniform + " --set contact.friction=0.3").err,
              AllOf(HasSubstr("--set contact.friction: is uncertain, so that each particle draws its own value"),
                    HasSubstr("did you mean --set uncertain.contact.friction=0.3, which gives all particles")));
  EXPECT_EQ(campaign.graze(uniform).err, "");
  EXPECT_EQ(campaign
                .graze("check ball.yaml --set 'uncertain.contact.friction={normal: {std: 5 %}}' --set "
                       "contact.friction=0.3")
                .err,
            "");
}

// Claim: the overview tells how particles are drawn: how many, by which design and seed, as the command line has it,
// and what is correlated with what.
TEST_F(Check, TellsHowParticlesAreDrawn) {
  EXPECT_THAT(
      campaign.graze("check ball.yaml").out,
      AllOf(HasSubstr("\n  sampling     100 particles, design random, seed 1\n"), Not(HasSubstr("correlated"))));
  EXPECT_THAT(campaign.graze("check ball.yaml -n 1 --seed 7 --set sampling.design=sobol").out,
              HasSubstr("\n  sampling     1 particle, design sobol, seed 7\n"));
  const std::string tied =
      " --set 'uncertain.initial.base.velocity.*={normal: {std: 1e-3}}' --set 'uncertain.correlated="
      "[{parameters: [initial.base.z, robot.link.ball.density], correlation: -0.5},"
      " {parameters: [\"initial.base.velocity.{x,y,z}\", initial.base.velocity.yaw], correlation:"
      " [[1, 0.2, 0, 0], [0.2, 1, 0, 0], [0, 0, 1, 0.1], [0, 0, 0.1, 1]]}]'";
  EXPECT_THAT(campaign.graze("check ball.yaml" + tied).out,
              HasSubstr("\n  correlated   initial.base.z, robot.link.ball.density by -0.5; initial.base.velocity.x, "
                        "initial.base.velocity.y, initial.base.velocity.z … (4 in all) by 0 to 0.2\n"));
  const auto json = nlohmann::json::parse(campaign.graze("check ball.yaml --json --seed 7" + tied).out);
  EXPECT_EQ(json["sampling"], nlohmann::json::parse(R"({"design": "random", "seed": 7, "particles": 100})"));
  ASSERT_EQ(json["correlated"].size(), 2u);
  EXPECT_EQ(json["correlated"][0]["parameters"][1], "robot.link.ball.density");
  EXPECT_EQ(json["correlated"][1]["correlation"][2][3], 0.1);
}

// Claim: the overview has a line for each collision mesh: how many vertices its hull has, how many are kept, and the
// error that this makes.
TEST_F(Check, TellsHowMeshesAreSimplified) {
  EXPECT_THAT(campaign.graze("check ball.yaml").out, Not(HasSubstr("collision mesh")));
  std::ofstream file(std::filesystem::path(campaign.folder.path()) / "drum.obj");
  for (int i = 0; i < 400; ++i) {
    const double angle = M_PI / 100 * (i / 2);
    file << "v " << 0.1 * std::cos(angle) << " " << 0.1 * std::sin(angle) << " " << (i % 2 ? 0.1 : 0.2) << "\n";
  }
  for (int i = 1; i <= 398; ++i) file << "f " << i << " " << i + 1 << " " << i + 2 << "\n";
  file.close();
  const std::string with = "check ball.yaml --set 'environment.drum={mesh: drum.obj, position: [9, 0, 0]}'";
  const std::string out = campaign.graze(with).out;
  EXPECT_THAT(out, HasSubstr("\ncollision mesh  file      vertices of its hull  kept"));
  const auto json = nlohmann::json::parse(campaign.graze(with + " --json").out);
  ASSERT_EQ(json["meshes"].size(), 1u);
  const auto& drum = json["meshes"][0];
  EXPECT_EQ(drum["part"], "drum");
  EXPECT_EQ(drum["of"], 400);
  EXPECT_LT(drum["vertices"], 100);
  EXPECT_GT(drum["error"], 0);
  EXPECT_LE(drum["error"], 1e-3);
}

// Claim: a robot that is broken is refused with all its problems in one error; --repair mends and tells them, and what
// --write-urdf writes needs no repair, wherever it lies. No file is replaced unasked.
TEST_F(Check, RepairsRobots) {
  testing::write_file(campaign.folder / "broken.urdf", R"(<robot name="broken"><link name="ball">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="3"/></inertial>
    <collision><geometry><mesh filename="t.obj" scale="0.1"/></geometry></collision></link></robot>)");
  testing::write_file(campaign.folder / "t.obj",
                      "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string robot = "check ball.yaml --set uncertain=~ --set robot.urdf=broken.urdf";
  const auto refused = campaign.graze(robot);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr("2 problems, all of which --repair"), HasSubstr("broken.urdf:2: link 'ball'"),
                    HasSubstr("broken.urdf:3: link 'ball': <mesh> scale")));
  const auto written = campaign.graze(robot + " --repair --write-urdf out/mended.urdf");
  EXPECT_EQ(written.code, 0) << written.err;
  EXPECT_THAT(written.err, AllOf(HasSubstr("broken.urdf:2: link 'ball'"), HasSubstr("; repaired: takes the nearest")));
  const auto mended = campaign.graze("check ball.yaml --set uncertain=~ --set robot.urdf=out/mended.urdf");
  EXPECT_EQ(mended.code, 0) << mended.err;
  EXPECT_THAT(mended.err, Not(HasSubstr("mended.urdf")));
  EXPECT_THAT(campaign.graze(robot + " --repair --write-urdf out/mended.urdf").err, HasSubstr("exists already"));
  EXPECT_EQ(campaign.graze(robot + " --repair --write-urdf out/mended.urdf --force").code, 0);
  EXPECT_EQ(campaign.graze(robot + " --repair --force --write-urdf broken.urdf").code, 2) << "it is made of that file";
}

}  // namespace
}  // namespace graze
