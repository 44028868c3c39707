// Joints that follow others: read from a URDF, led to the joint that follows none, and what that means for a model.

#include <gmock/gmock.h>

#include "engine/model/fabrication.h"
#include "engine/model/model.h"
#include "engine/model/parameters.h"
#include "engine/model/urdf.h"

namespace graze {
namespace {

std::string body(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" "
         "iyz=\"0\" izz=\"1\"/></inertial></link>\n";
}

std::string hinge(const std::string& name, const std::string& child, const std::string& range,
                  const std::string& mimic = "") {
  return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"a\"/><child link=\"" + child + "\"/><limit " +
         range + " effort=\"5\" velocity=\"5\"/>" + mimic + "</joint>\n";
}

/// j2 follows j1; j3 follows j2, and by it j1: q3 = -2 (0.5 q1 + 0.1) + 0.3 = -q1 + 0.1.
std::string hand(const std::string& range_of_j2 = "lower=\"-3\" upper=\"3\"") {
  const std::string wide = "lower=\"-3\" upper=\"3\"";
  return "<robot name=\"r\">\n" + body("a") + body("b") + body("c") + body("d") +
         hinge("j3", "d", wide, "<mimic joint=\"j2\" multiplier=\"-2\" offset=\"0.3\"/>") +
         hinge("j2", "c", range_of_j2, "<mimic joint=\"j1\" multiplier=\"0.5\" offset=\"0.1\"/>") +
         hinge("j1", "b", wide) + "</robot>";
}

World world_of(const std::string& xml) {
  World world;
  world.robot = parse_urdf(xml, "r.urdf");
  return world;
}

TEST(Mimic, IsLedToTheJointThatFollowsNone) {
  std::string written;
  UrdfOptions options;
  options.read = [&](const std::string& text) { written = text; };
  const Robot robot = parse_urdf(hand(), "r.urdf", options);
  EXPECT_EQ(robot.joint("j1").mimic.joint, "");
  EXPECT_EQ(robot.joint("j2").mimic.joint, "j1");
  EXPECT_EQ(robot.joint("j2").mimic.multiplier, 0.5);
  EXPECT_EQ(robot.joint("j2").mimic.offset, 0.1);
  EXPECT_EQ(robot.joint("j3").mimic.joint, "j1");
  EXPECT_EQ(robot.joint("j3").mimic.multiplier, -1);
  EXPECT_NEAR(robot.joint("j3").mimic.offset, 0.1, 1e-15);
  // The document that is written back says it as it was said.
  EXPECT_THAT(written, testing::HasSubstr("<mimic joint=\"j2\" multiplier=\"-2\" offset=\"0.3\"/>"));
  EXPECT_EQ(parse_urdf(written, "r.urdf").joint("j3").mimic.multiplier, -1);
}

// Only the joint that others follow has a drive, an encoder and an initial position that may be uncertain.
TEST(Mimic, HasNoDriveOfItsOwn) {
  const World world = world_of(hand());
  const Model model = compile(world);
  ASSERT_EQ(model.na(), 1);
  EXPECT_EQ(model.bodies[model.actuated[0]].joint, "j1");
  const Body& j3 = model.bodies[model.joint("j3")];
  EXPECT_EQ(j3.mimics, model.joint("j1"));
  EXPECT_EQ(j3.multiplier, -1);
  for (const std::string& name : channel_names(world.robot)) {
    EXPECT_THAT(name, testing::Not(testing::AnyOf(testing::HasSubstr("j2"), testing::HasSubstr("j3"))));
  }
  const ParameterTable table(world);
  EXPECT_NE(table.find("initial.joint.j1.position"), nullptr);
  EXPECT_NE(table.find("robot.joint.j1.zero"), nullptr);
  EXPECT_NE(table.find("robot.joint.j2.damping"), nullptr);
  for (const char* path : {"initial.joint.j2.position", "robot.joint.j2.zero", "robot.joint.j2.effort"}) {
    EXPECT_EQ(table.find(path), nullptr) << path;
  }
  EXPECT_EQ(Fabricator(std::make_shared<World>(world), {}).nominal().joint_zero.size(), 1u);
}

TEST(Mimic, BeginsWhereTheOtherPutsIt) {
  World world = world_of(hand());
  world.initial.joint_position["j1"] = 0.8;
  world.initial.joint_velocity["j1"] = 2;
  const Model model = compile(world);
  const State state = initial_state(world, model);
  const auto q = [&](const char* joint) { return state.q[model.bodies[model.joint(joint)].q]; };
  const auto v = [&](const char* joint) { return state.v[model.bodies[model.joint(joint)].v]; };
  EXPECT_EQ(q("j1"), 0.8);
  EXPECT_DOUBLE_EQ(q("j2"), 0.5);
  EXPECT_DOUBLE_EQ(q("j3"), -0.7);
  EXPECT_EQ(v("j2"), 1);
  EXPECT_EQ(v("j3"), -2);
}

// j2 = 0.5 j1 + 0.1 may be no less than 0.4, so j1 begins at 0.6 if nothing says otherwise.
TEST(Mimic, LimitsOfFollowersCountForTheDefault) {
  const World world = world_of(hand("lower=\"0.4\" upper=\"3\""));
  EXPECT_NEAR(world.robot.default_position("j1"), 0.6, 1e-15);
  const Model model = compile(world);
  EXPECT_NEAR(initial_state(world, model).q[model.bodies[model.joint("j2")].q], 0.4, 1e-15);
}

}  // namespace
}  // namespace graze
