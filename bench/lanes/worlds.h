#pragma once
// The worlds that bench_lanes steps.

#include <string>

#include "engine/model/urdf.h"

namespace graze::bench {

inline Object ground() {
  Object object;
  object.name = "ground";
  object.shape.kind = ShapeKind::plane;
  return object;
}

/// LINKS above a plane, crouching. As published it collides by torso and feet only.
inline World links_on_plane() {
  World world;
  world.robot = load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf");
  world.objects.push_back(ground());
  world.contact.ignore = {{"*_LEG_*", "*"}};
  world.initial.on_ground = true;
  world.initial.clearance = 0.005;
  for (const Joint& joint : world.robot.joints) {
    const double sign = joint.name.starts_with("LF") || joint.name.starts_with("RH") ? 1 : -1;
    if (joint.name.ends_with("X_1")) world.initial.joint_position[joint.name] = 0.2 * sign;
    if (joint.name.ends_with("Y_2")) world.initial.joint_position[joint.name] = 0.8 * sign;
    if (joint.name.ends_with("Y_3")) world.initial.joint_position[joint.name] = 1.2 * sign;
  }
  return world;
}

inline Link bead(const std::string& name, double radius, const Vec3& at) {
  Link link;
  link.name = name;
  Geometry geometry;
  geometry.name = name;
  geometry.shape.kind = ShapeKind::sphere;
  geometry.shape.size = {radius, 0, 0};
  geometry.X_LG.translation() = at;
  link.collisions.push_back(geometry);
  link.inertia = MassMoments::of_shape(geometry.shape, 2000).transformed(Mat3::Identity(), at);
  return link;
}

inline Joint joint_between(const Link& parent, const Link& child, JointType type, const Vec3& axis, const Vec3& at) {
  Joint joint;
  joint.name = "to_" + child.name;
  joint.parent = parent.name;
  joint.child = child.name;
  joint.type = type;
  joint.axis = axis;
  joint.X_PJ.translation() = at;
  joint.damping = 1e-3;
  return joint;
}

/// Beads of 2 cm on `joints` hinges, 6 cm apart, with axes across each other in turn: hanging from the world, or lying
/// stretched out on a plane (one contact per bead).
inline World chain(int joints, bool lying) {
  World world;
  Robot& robot = world.robot;
  robot.name = "chain";
  robot.floating_base = lying;
  const Vec3 step = lying ? Vec3(0.06, 0, 0) : Vec3(0, 0, -0.06);
  robot.links.push_back(bead("bead_0", 0.02, Vec3::Zero()));
  for (int i = 1; i <= joints; ++i) {
    robot.links.push_back(bead("bead_" + std::to_string(i), 0.02, step));
    const Vec3 axis = i % 2 == 1 ? Vec3(0, 1, 0) : lying ? Vec3(0, 0, 1) : Vec3(1, 0, 0);
    robot.joints.push_back(joint_between(robot.links[i - 1], robot.links[i], JointType::revolute, axis,
                                         i == 1 ? Vec3(Vec3::Zero()) : step));
  }
  world.contact.self_collision = false;
  if (lying) {
    world.objects.push_back(ground());
    world.initial.on_ground = true;
    world.initial.clearance = 1e-3;
  } else {
    world.initial.joint_position["to_bead_1"] = 0.3;
  }
  return world;
}

/// A table on `feet` round feet that slides on a plane along x, y and z: three degrees of freedom and many contacts.
inline World table(int feet) {
  World world;
  Robot& robot = world.robot;
  robot.name = "table";
  robot.floating_base = false;
  robot.links.push_back(bead("rail", 0.01, {0, 0, 1}));
  robot.links.push_back(bead("slide_x", 0.01, {0, 0, 1}));
  robot.links.push_back(bead("slide_y", 0.01, {0, 0, 1}));
  Link top = bead("top", 0.03, {0, 0, 1});
  int across = 1;
  while (across * across < feet) ++across;
  for (int i = 0; i < feet; ++i) {
    Geometry foot;
    foot.name = "foot_" + std::to_string(i);
    foot.shape.kind = ShapeKind::sphere;
    foot.shape.size = {0.02, 0, 0};
    foot.X_LG.translation() = Vec3(0.1 * (i % across), 0.1 * (i / across), 0);
    top.collisions.push_back(foot);
  }
  robot.links.push_back(top);
  for (int i = 0; i < 3; ++i) {
    robot.joints.push_back(
        joint_between(robot.links[i], robot.links[i + 1], JointType::prismatic, Vec3::Unit(i), Vec3::Zero()));
  }
  world.objects.push_back(ground());
  world.contact.self_collision = false;
  world.contact.friction = 0.5;
  world.initial.on_ground = true;
  world.initial.clearance = 1e-3;
  return world;
}

/// `count` free balls of six degrees of freedom each, rolling on a plane.
inline World balls(int count) {
  World world;
  world.robot.name = "ball";
  world.robot.links.push_back(bead("ball_0", 0.02, Vec3::Zero()));
  world.initial.on_ground = true;
  world.initial.linear_velocity = {0.5, 0, 0};
  world.objects.push_back(ground());
  for (int i = 1; i < count; ++i) {
    Object ball;
    ball.name = "ball_" + std::to_string(i);
    ball.shape.kind = ShapeKind::sphere;
    ball.shape.size = {0.02, 0, 0};
    ball.movable = true;
    ball.inertia = MassMoments::of_shape(ball.shape, 2000);
    ball.X_WO.translation() = Vec3(0, 0.1 * i, 0.02);
    world.objects.push_back(ball);
  }
  return world;
}

}  // namespace graze::bench
