// The shipped LINKS robots carry the numbers that their sources have.
#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>

#include "tests/engine/model/support.h"

namespace graze {
namespace {

const char* const kLegs[] = {"LF", "RF", "LH", "RH"};

double total_mass(const Robot& robot) {
  double mass = 0;
  for (const Link& link : robot.links) mass += link.inertia.mass;
  return mass;
}

Vec3 principal(const MassMoments& moments) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(moments.inertia_about_com(), Eigen::EigenvaluesOnly).eigenvalues();
}

/// Equal to the digits that the number was printed with (six significant ones).
void expect_printed(double value, double printed) { EXPECT_NEAR(value, printed, 5.1e-6 * printed) << printed; }

// The masses and inertias of the mean robot are those that the authors' own sampler printed for its "sample 0".
TEST(Links, HasTheMeanRobotsMasses) {
  const Robot robot = load_urdf(shipped_robot("links.urdf"));
  expect_printed(robot.link("BODY0").inertia.mass, 1.1736);
  const Mat3 base = robot.link("BODY0").inertia.inertia_about_com();
  expect_printed(base(0, 0), 8.7042e-4);
  expect_printed(base(1, 1), 2.445e-3);
  expect_printed(base(2, 2), 2.82642e-3);
  for (const std::string leg : kLegs) {
    const MassMoments hip = robot.link(leg + "_LEG_1").inertia, thigh = robot.link(leg + "_LEG_2").inertia;
    expect_printed(hip.mass, 0.00779704);
    expect_printed(principal(hip)[0], 3.51841e-7);
    expect_printed(principal(hip)[1], 5.82017e-7);
    expect_printed(principal(hip)[2], 5.82017e-7);
    expect_printed(thigh.mass, 0.0240149);
    expect_printed(principal(thigh)[0], 1.08367e-6);
    expect_printed(principal(thigh)[2], 1.24072e-5);
  }
  expect_printed(total_mass(robot), 1.43804);
}

// The published table joins shin and foot into one link and adds their inertias each about its own centre.
TEST(Links, HasTheMeanRobotsShinsAndFeet) {
  const Robot robot = load_urdf(shipped_robot("links.urdf"));
  for (const std::string leg : kLegs) {
    const MassMoments shin = robot.link(leg + "_LEG_3").inertia, foot = robot.link(leg + "_FOOT").inertia;
    const bool big = leg == "RH";
    expect_printed(shin.mass + foot.mass, big ? 0.0351387 : 0.0340178);
    expect_printed(principal(shin)[0] + principal(foot)[0], big ? 1.54998e-6 : 1.48914e-6);
    expect_printed(principal(shin)[2] + principal(foot)[2], big ? 2.68364e-5 : 2.67756e-5);
  }
}

// At q = 0 the joint origins relative to the base centre are those of the authors' exported model.
TEST(Links, HasTheMeanRobotsFrames) {
  const World world = links_world();
  const Model model = compile(world);
  State state{Eigen::VectorXd::Zero(model.nq), Eigen::VectorXd::Zero(model.nv)};
  state.q[0] = 1;
  const std::vector<Pose> X_WB = reference_poses(model, state.q);
  const auto at = [&](const std::string& link) {
    return frame_pose(model, X_WB, model.frame(link)).translation().eval();
  };
  for (const std::string leg : kLegs) {
    const double f = leg[1] == 'F' ? 1 : -1, s = leg[0] == 'L' ? 1 : -1;
    const double hip = f > 0 ? 0.0995145 : 0.0991956, knee = f > 0 ? 0.176515 : 0.176196;
    const double foot = f > 0 ? 0.276515 : 0.276196, z = f > 0 ? -0.029903 : -0.031291;
    EXPECT_TRUE(at(leg + "_LEG_1").isApprox(Vec3(f * 0.075, s * 0.04, -0.025), 1e-12)) << leg;
    EXPECT_LT((at(leg + "_LEG_2") - Vec3(f * hip, s * 0.04, z)).cwiseAbs().maxCoeff(), 6e-7) << leg;
    EXPECT_LT((at(leg + "_LEG_3") - Vec3(f * knee, s * 0.04, z)).cwiseAbs().maxCoeff(), 6e-7) << leg;
    EXPECT_LT((at(leg + "_FOOT") - Vec3(f * foot, s * 0.04, z)).cwiseAbs().maxCoeff(), 6e-7) << leg;
  }
}

// Each explicit inertia is that of the link's own homogeneous shape, at the density of the distribution's mean.
TEST(Links, InertiaIsThatOfTheShapes) {
  const Robot robot = load_urdf(shipped_robot("links.urdf"));
  for (const Link& link : robot.links) {
    ASSERT_EQ(link.collisions.size(), 1u) << link.name;
    const Geometry& geometry = link.collisions[0];
    const MassMoments expected = MassMoments::of_shape(geometry.shape, link.name == "BODY0" ? 1956 : 1100)
                                     .transformed(geometry.X_LG.linear(), geometry.X_LG.translation());
    // The file has 10 digits of lengths and 12 of masses and inertias.
    EXPECT_NEAR(link.inertia.mass, expected.mass, 1e-11 * expected.mass) << link.name;
    EXPECT_TRUE(link.inertia.first.isApprox(expected.first, 1e-9) || expected.first.norm() < 1e-15) << link.name;
    EXPECT_TRUE(link.inertia.second.isApprox(expected.second, 1e-9)) << link.name;
  }
}

// Joints, axes and actuators as published: left +y, right -y, front +x, hind -x, 7.3 N m, 15 rad/s, no limits.
TEST(Links, HasThePublishedJoints) {
  for (const char* file : {"links.urdf", "links_published.urdf"}) {
    const Robot robot = load_urdf(shipped_robot(file));
    std::vector<std::string> driven;
    for (const Joint& joint : robot.joints) {
      if (joint.type == JointType::fixed) continue;
      driven.push_back(joint.name);
      const double f = joint.name[1] == 'F' ? 1 : -1, s = joint.name[0] == 'L' ? 1 : -1;
      EXPECT_EQ(joint.axis, joint.name[3] == 'X' ? Vec3(f, 0, 0) : Vec3(0, s, 0)) << joint.name;
      EXPECT_EQ(joint.effort, 7.3);
      EXPECT_EQ(joint.velocity, 15);
      EXPECT_TRUE(std::isinf(joint.lower) && std::isinf(joint.upper));
    }
    EXPECT_THAT(driven, testing::ElementsAre("LF_X_1", "LF_Y_2", "LF_Y_3", "RF_X_1", "RF_Y_2", "RF_Y_3", "LH_X_1",
                                             "LH_Y_2", "LH_Y_3", "RH_X_1", "RH_Y_2", "RH_Y_3"));
  }
}

// The published robot weighs 3.8 kg, collides with torso and feet only, and its feet are where the file has them.
TEST(Links, PublishedVariant) {
  World world;
  world.robot = load_urdf(shipped_robot("links_published.urdf"));
  EXPECT_NEAR(total_mass(world.robot), 3.8, 1e-12);
  const Model model = compile(world);
  EXPECT_EQ(model.colliders.size(), 5u);
  const std::vector<Pose> X_WB = reference_poses(model, initial_state(world, model).q);
  for (const std::string leg : kLegs) {
    const double f = leg[1] == 'F' ? 1 : -1, s = leg[0] == 'L' ? 1 : -1;
    const Pose foot = frame_pose(model, X_WB, model.frame(leg + "_FOOT"));
    EXPECT_TRUE(foot.translation().isApprox(Vec3(f * 0.2795, s * 0.0625, f > 0 ? -0.005 : -0.0065), 1e-12));
    const Body& shin = model.bodies[model.joint(leg + "_Y_3")];
    EXPECT_TRUE((X_WB[model.joint(leg + "_Y_3")] * shin.com).isApprox(foot.translation(), 1e-12));
  }
}

bool contains(const Shape& shape, const Vec3& p) {
  if (shape.kind == ShapeKind::box) return (p.cwiseAbs() - shape.size / 2).maxCoeff() <= 0;
  if (shape.kind == ShapeKind::sphere) return p.norm() <= shape.size.x();
  return std::hypot(p.x(), p.y()) <= shape.size.x() && std::abs(p.z()) <= shape.size.y() / 2;
}

/// A point of the shape, in its own frame.
Vec3 point_in(const Shape& shape, std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  const Vec3 half = shape.kind == ShapeKind::box        ? Vec3(shape.size / 2)
                    : shape.kind == ShapeKind::cylinder ? Vec3(shape.size.x(), shape.size.x(), shape.size.y() / 2)
                                                        : Vec3(Vec3::Constant(shape.size.x()));
  for (;;) {
    const Vec3 p = half.cwiseProduct(Vec3(u(random), u(random), u(random)));
    if (contains(shape, p)) return p;
  }
}

// In its initial pose the mean robot touches nothing of itself among the pairs that are watched (else every trace would
// begin with a self-collision). 20000 points in each shape find any overlap of more than about 1 mm.
TEST(Links, NoOverlapAtRest) {
  const World world = links_world();
  const Model model = compile(world);
  const std::vector<Pose> X_WB = reference_poses(model, initial_state(world, model).q);
  std::mt19937 random(1);
  int watched = 0;
  for (const ColliderPair& pair : model.pairs) {
    const Collider &a = model.colliders[pair.a], &b = model.colliders[pair.b];
    if (a.is_object || b.is_object) continue;
    ++watched;
    const Pose X_BA = (X_WB[b.body] * b.X_BG).inverse() * (X_WB[a.body] * a.X_BG);
    for (int i = 0; i < 20000; ++i) {
      ASSERT_FALSE(contains(b.shape, X_BA * point_in(a.shape, random))) << a.name << " and " << b.name;
    }
  }
  // 17 shapes make 136 pairs; per leg base-hip, hip-thigh, thigh-shin, thigh-foot are adjacent, shin-foot one body.
  EXPECT_EQ(watched, 136 - 4 * 5);
}

// On the ground, the lowest of the robot's points is at z = 0, found by an independent walk over its feet, and the base
// is as high as the legs stacked by hand.
TEST(Links, StandsOnItsFeet) {
  World world = links_world();
  const Model model = compile(world);
  const State state = initial_state(world, model);
  const std::vector<Pose> X_WB = reference_poses(model, state.q);
  double lowest = 1;
  for (const std::string leg : kLegs) {
    const double radius = leg == "RH" ? 0.0095 : 0.0085;
    lowest = std::min(lowest, frame_pose(model, X_WB, model.frame(leg + "_FOOT")).translation().z() - radius);
  }
  EXPECT_NEAR(lowest, 0, 1e-12);
  EXPECT_NEAR(lowest_point(model, X_WB), 0, 1e-12);
  world.initial.clearance = 0.01;
  EXPECT_NEAR(initial_state(world, model).q[6] - state.q[6], 0.01, 1e-15);
  // Hip, thigh and shin stacked in their published angles, by hand: legs turned out by 0.2 rad.
  const double down = 0.0062908 + 0.077 * std::sin(0.8) + 0.1 * std::sin(2.0);
  const double feet = 0.025 + std::cos(0.2) * down + 0.0095;
  EXPECT_NEAR(state.q[6], feet, 1e-6);
}

}  // namespace
}  // namespace graze
