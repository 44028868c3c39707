// Claim: a design's robots are told apart by what is in their files, and variables that particles do not heed are
// found.
#include "jobs/campaign/design_robots.h"

#include <gmock/gmock.h>

#include "tests/jobs/swing_session.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct DesignRobotsTest : testing::SwingSession {
  std::string sum() const {
    const Scenario own = scenario();
    return DesignRobots(own).files_sha256();
  }
  std::vector<std::string> overdrawn(const std::string& variables, const std::string& uncertain = "") {
    std::string text = testing::kSwing;
    if (!uncertain.empty()) {
      const std::string drawn = "{uniform: [0, 0.002]}";
      text.replace(text.find(drawn), drawn.size(), uncertain);
    }
    testing::write_file(folder / "swing.yaml", text + "design: {variables: {" + variables + "}}\n");
    const Scenario own = scenario();
    if (!own.redesign) throw std::runtime_error(own.redesign_problem);
    return DesignRobots(own).overdrawn();
  }
};

TEST_F(DesignRobotsTest, FilesAreToldApartByTheirContent) {
  const std::string first = sum();
  EXPECT_EQ(first.size(), 64u);
  testing::write_file(folder / "swing.yaml", std::string("# a comment\n") + testing::kSwing + testing::kBothRods);
  EXPECT_EQ(sum(), first) << "the text of a scenario stands for itself";
  std::filesystem::create_directory(folder / "robots");
  std::filesystem::rename(folder / "twins.urdf", folder / "robots" / "two.urdf");
  std::string moved = std::string(testing::kSwing) + testing::kBothRods;
  moved.replace(moved.find("twins.urdf"), 10, "robots/two.urdf");
  testing::write_file(folder / "swing.yaml", moved);
  EXPECT_EQ(sum(), first) << "the same robot in another folder";
  testing::write_file(folder / "robots" / "two.urdf", std::string(testing::kTwins) + "\n<!-- heavier -->");
  EXPECT_NE(sum(), first);
}

TEST_F(DesignRobotsTest, PartsOfARobotAreNeitherScenariosNorVariables) {
  for (const char* part : {"/a/b.urdf", "/a/mesh.stl", "/a/walk.so.sha256", "/a/table.csv", "/a/b.xacro"}) {
    EXPECT_TRUE(is_part_of_robot(part)) << part;
  }
  for (const char* other : {"/a/b.yaml", "/a/b.yml", "$ROS_PACKAGE_PATH", "/a/pendulum.meant"}) {
    EXPECT_FALSE(is_part_of_robot(other)) << other;
  }
}

TEST_F(DesignRobotsTest, VariablesThatParticlesDrawAnewAreFound) {
  const std::string damper = "damper: {of: \"robot.joint.*.damping\", within: [0, 0.1]}";
  const std::string rods = "rods: {of: \"robot.link.*_rod.length\", within: [10 cm, 60 cm]}";
  EXPECT_THAT(overdrawn(damper + ", " + rods),
              ElementsAre(AllOf(HasSubstr("damper: robot.joint.left.damping is uniform"), HasSubstr("0.002"))));
  EXPECT_THAT(overdrawn(rods), IsEmpty());
  EXPECT_THAT(overdrawn(damper, "{normal: {std: 1e-3, min: 0}}"), IsEmpty()) << "it follows the nominal number";
  EXPECT_THAT(overdrawn(damper, "0.01"), ElementsAre(HasSubstr("damper")));
}

}  // namespace
}  // namespace graze
