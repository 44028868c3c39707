// Claim: a robot that is written as URDF and read again is the same robot.
#include "engine/model/urdf_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/model/fabrication.h"
#include "engine/model/urdf.h"
#include "tests/message_of.h"

namespace graze {
namespace {

constexpr double kRounding = 1e-12;  // of places and turns, m or 1

void expect_same(const std::vector<Geometry>& a, const std::vector<Geometry>& b, const std::string& link) {
  ASSERT_EQ(a.size(), b.size()) << link;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].shape.kind, b[i].shape.kind) << link;
    EXPECT_EQ(a[i].shape.size, b[i].shape.size) << link;
    EXPECT_LT((a[i].X_LG.matrix() - b[i].X_LG.matrix()).cwiseAbs().maxCoeff(), kRounding) << link;
  }
}

void expect_same(const Joint& a, const Joint& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.type, b.type);
  EXPECT_LT((a.X_PJ.matrix() - b.X_PJ.matrix()).cwiseAbs().maxCoeff(), kRounding) << a.name;
  EXPECT_LT((a.axis - b.axis).cwiseAbs().maxCoeff(), kRounding) << a.name;
  for (const auto member : {&Joint::lower, &Joint::upper, &Joint::effort, &Joint::velocity, &Joint::damping}) {
    EXPECT_EQ(a.*member, b.*member) << a.name;
  }
  EXPECT_EQ(a.mimic.joint, b.mimic.joint);
  EXPECT_EQ(a.mimic.multiplier, b.mimic.multiplier);
}

void expect_same(const Robot& a, const Robot& b) {
  ASSERT_EQ(a.links.size(), b.links.size());
  ASSERT_EQ(a.joints.size(), b.joints.size());
  EXPECT_EQ(a.floating_base, b.floating_base);
  for (std::size_t i = 0; i < a.links.size(); ++i) {
    const MassMoments &x = a.links[i].inertia, &y = b.links[i].inertia;
    EXPECT_EQ(a.links[i].name, b.links[i].name);
    EXPECT_EQ(x.mass, y.mass) << a.links[i].name;
    EXPECT_LT((x.first - y.first).cwiseAbs().maxCoeff(), kRounding * (1 + x.mass)) << a.links[i].name;
    EXPECT_LT((x.second - y.second).cwiseAbs().maxCoeff(), kRounding * (1 + x.mass)) << a.links[i].name;
    expect_same(a.links[i].collisions, b.links[i].collisions, a.links[i].name);
  }
  for (std::size_t i = 0; i < a.joints.size(); ++i) expect_same(a.joints[i], b.joints[i]);
}

Robot again(const Robot& robot) {
  UrdfOptions options;
  options.fixed_base = !robot.floating_base;
  return parse_urdf(write_urdf(robot), "again.urdf", options);
}

Robot shipped(const std::string& name, bool fixed_base) {
  UrdfOptions options;
  options.fixed_base = fixed_base;
  return load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/" + name + ".urdf", options);
}

TEST(UrdfWriter, ShippedRobotsComeBack) {
  for (const std::string name : {"links", "links_published", "six_joint_arm", "pendulum", "printed_quadruped"}) {
    const Robot robot = shipped(name, name == "six_joint_arm" || name == "pendulum");
    SCOPED_TRACE(name);
    expect_same(robot, again(robot));
  }
}

// A longer, heavier shin: what fabrication makes of it is what the file says.
TEST(UrdfWriter, DesignsComeBack) {
  World world;
  world.robot = shipped("links", false);
  const Fabricator fabricator(std::make_shared<const World>(world),
                              {"robot.link.LF_LEG_3.length", "robot.link.LF_LEG_3.mass", "robot.link.BODY0.size.x",
                               "robot.link.LF_LEG_2.com.z", "robot.joint.LF_Y_3.effort"});
  const Robot changed = fabricator.perturbed(std::vector<double>{0.133, 0.05, 0.2, 0.003, 5.5}).robot;
  expect_same(changed, again(changed));
  EXPECT_EQ(again(changed).joint("LF_Y_3").effort, 5.5);
  EXPECT_EQ(again(changed).link("LF_LEG_3").inertia.mass, 0.05);
}

// Sliding joints, followers, capsules, names that XML must escape.
TEST(UrdfWriter, WritesAllKindsOfJoints) {
  const Robot robot = parse_urdf(
      R"(<robot name="a&amp;b"><link name="world"/>
      <joint name="j0" type="fixed"><parent link="world"/><child link="l0"/></joint>
      <link name="l0"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry><capsule radius="0.1" length="0.3"/></geometry></collision></link>
      <joint name="j1" type="prismatic"><parent link="l0"/><child link="l1"/><axis xyz="0 0.6 0.8"/>
        <limit lower="-0.1" upper="0.2" effort="3" velocity="4"/></joint>
      <link name="l1"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="j2" type="prismatic"><parent link="l0"/><child link="l2"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" effort="3" velocity="4"/><mimic joint="j1" multiplier="-2" offset="0.1"/></joint>
      <link name="l2"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      </robot>)",
      "all.urdf");
  expect_same(robot, again(robot));
  EXPECT_EQ(again(robot).name, "a&b");
}

TEST(UrdfWriter, RefusesWhatUrdfCannotSay) {
  Robot robot = shipped("pendulum", true);
  robot.links[1].collisions[0].shape.kind = ShapeKind::heightfield;
  EXPECT_THAT(testing::message_of([&] { write_urdf(robot); }), ::testing::HasSubstr("link 'rod'"));
}

}  // namespace
}  // namespace graze
