#pragma once
// Robots to try dynamics on: trees of every kind, made from fixed sequences, and some of those that are shipped.

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "engine/model/urdf.h"
#include "tests/engine/dynamics/reference.h"

namespace graze::testing {

/// What a random tree is made of.
struct TreePlan {
  int links = 8;           // with the base
  bool floating = true;    // base
  double prismatic = 0.3;  // share of sliding joints
  double straight = 0.5;   // chance of a link to hang on the link before it; 1: a chain, 0: a star on the base
  int objects = 0;         // that move beside the robot
  double length = 0.4;     // m, of a link
};

inline MassMoments random_inertia(std::mt19937& random, double length) {
  std::uniform_real_distribution<double> u(-1, 1);
  const auto vec = [&] { return Vec3(u(random), u(random), u(random)); };
  MassMoments out;
  out.mass = 1.5 + u(random);
  out.first = out.mass * 0.5 * length * vec();
  Mat3 A;
  A << vec(), vec(), vec();
  // Second moments: positive definite about the centre of mass.
  out.second = out.mass * length * length * (0.1 * A * A.transpose() + 0.05 * Mat3::Identity()) +
               out.first * out.first.transpose() / out.mass;
  return out;
}

/// A tree with skew axes, offsets and lopsided bodies; every 4th axis is along a coordinate.
inline Model random_tree(unsigned seed, const TreePlan& plan) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto vec = [&] { return Vec3(u(random), u(random), u(random)); };
  World world;
  Robot& robot = world.robot;
  robot.floating_base = plan.floating;
  for (int i = 0; i < plan.links; ++i) {
    Link link;
    link.name = "link" + std::to_string(i);
    link.inertia = random_inertia(random, plan.length);
    robot.links.push_back(link);
    if (i == 0) continue;
    Joint joint;
    joint.name = "joint" + std::to_string(i);
    const bool on = 0.5 * (1 + u(random)) < plan.straight;
    const int parent = on ? i - 1 : plan.straight == 0 ? 0 : static_cast<int>(random() % static_cast<unsigned>(i));
    joint.parent = "link" + std::to_string(parent);
    joint.child = link.name;
    joint.type = 0.5 * (1 + u(random)) < plan.prismatic ? JointType::prismatic : JointType::revolute;
    joint.X_PJ.linear() = rotation_from_rpy(2 * vec());
    joint.X_PJ.translation() = plan.length * vec();
    joint.axis = i % 4 == 0 ? Vec3(-Vec3::Unit(i % 3)) : Vec3(vec().normalized());
    if (i % 3 == 1) joint.gear = 10 + i, joint.rotor_inertia = 1e-4 * (1 + i % 5);  // a tenth of a link's inertia
    robot.joints.push_back(joint);
  }
  for (int i = 0; i < plan.objects; ++i) {
    Object object;
    object.name = "object" + std::to_string(i);
    object.shape = {ShapeKind::box, {0.3, 0.2, 0.1}, nullptr, nullptr};
    object.X_WO.translation() = 3 * vec();
    object.movable = true;
    object.inertia = random_inertia(random, 0.3);
    world.objects.push_back(object);
  }
  world.gravity = {1.0, -2.0, -9.0};
  return compile(world);
}

inline Model shipped(const std::string& urdf, bool floating) {
  World world;
  world.robot = load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/" + urdf);
  world.robot.floating_base = floating;
  return compile(world);
}

/// A dozen robots and more: chains, stars and trees on fixed and floating bases, with sliding joints, of one and of
/// several trees.
inline std::vector<std::pair<std::string, Model>> robots() {
  std::vector<std::pair<std::string, Model>> out;
  const auto add = [&](const std::string& name, TreePlan plan) {
    out.emplace_back(name, random_tree(static_cast<unsigned>(out.size() + 1), plan));
  };
  add("body", {.links = 1});
  add("pendulum", {.links = 2, .floating = false, .prismatic = 0});
  add("slider", {.links = 2, .floating = false, .prismatic = 1});
  add("arm", {.links = 8, .floating = false, .prismatic = 0, .straight = 1});
  add("gantry", {.links = 5, .floating = false, .prismatic = 1, .straight = 1});
  add("fixed tree", {.links = 10, .floating = false});
  add("fixed star: eight trees", {.links = 9, .floating = false, .straight = 0});
  add("chain", {.links = 7, .straight = 1});
  add("star", {.links = 9, .straight = 0});
  add("tree", {.links = 12});
  add("bushy tree", {.links = 20, .straight = 0.2});
  add("tree and objects", {.links = 6, .objects = 2});
  add("fixed tree and objects", {.links = 6, .floating = false, .objects = 3});
  out.emplace_back("links", shipped("links.urdf", true));
  return out;
}

/// q after moving with the constant velocity v for the time h.
inline Eigen::VectorXd moved(const Model& model, const Eigen::VectorXd& q, const Eigen::VectorXd& v, double h) {
  Eigen::VectorXd out = q;
  for (const Body& b : model.bodies) {
    if (b.type != JointType::floating) {
      out[b.q] += h * v[b.v];
      continue;
    }
    const Vec3 w = v.segment<3>(b.v);
    const Quat turn = w.norm() > 0 ? Quat(Eigen::AngleAxisd(h * w.norm(), w.normalized())) : Quat::Identity();
    const Quat R = (turn * Quat(q[b.q], q[b.q + 1], q[b.q + 2], q[b.q + 3])).normalized();
    out.segment<4>(b.q) << R.w(), R.x(), R.y(), R.z();
    out.segment<3>(b.q + 4) += h * v.segment<3>(b.v + 3);
  }
  return out;
}

/// Derivative at 0 of f, a function of time that gives a vector or matrix, by central differences of fourth order:
/// wrong by h^4 f''''' / 30 and by rounding, 1e-16 f / h.
template <class F>
inline auto rate_of(const F& f, double h = 1e-3) {
  return ((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)).eval();
}

}  // namespace graze::testing
