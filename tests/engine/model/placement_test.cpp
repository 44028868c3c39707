#include "engine/model/placement.h"

#include "tests/engine/model/support.h"

namespace graze {
namespace {

State random_state(const Model& model, std::mt19937& random) {
  std::normal_distribution<double> n;
  State state{Eigen::VectorXd(model.nq), Eigen::VectorXd(model.nv)};
  for (int i = 0; i < model.nq; ++i) state.q[i] = n(random);
  for (int i = 0; i < model.nv; ++i) state.v[i] = n(random);
  for (const Body& b : model.bodies) {
    if (b.type == JointType::floating) state.q.segment<4>(b.q).normalize();
  }
  return state;
}

World arm_with_slider() {
  World world;
  world.robot = parse_urdf(R"(<robot name="arm">
    <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
    <link name="upper"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
    <link name="slider"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
    <link name="tip"/>
    <joint name="turn" type="continuous"><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>
      <parent link="base"/><child link="upper"/><axis xyz="1 2 3"/></joint>
    <joint name="slide" type="prismatic"><origin xyz="0.3 0 0.3" rpy="-0.4 0.5 1.6"/>
      <parent link="upper"/><child link="slider"/><axis xyz="0 1 1"/><limit effort="1" velocity="1" lower="-9" upper="9"/>
    </joint>
    <joint name="fix" type="fixed"><origin xyz="0 0 1" rpy="0.1 0.2 0.3"/>
      <parent link="slider"/><child link="tip"/></joint></robot>)",
                           "arm.urdf");
  return world;
}

// The poses are those of the same joints by Eigen's rotations.
TEST(Placement, BodiesStandWhereTheirJointsHaveThem) {
  std::mt19937 random(3);
  for (const World& world : {links_world(), arm_with_slider()}) {
    const Model model = compile(world);
    for (int trial = 0; trial < 20; ++trial) {
      const State state = random_state(model, random);
      const std::vector<Pose> found = place_bodies(model, state.q), wanted = reference_poses(model, state.q);
      for (std::size_t b = 0; b < found.size(); ++b) {
        EXPECT_LT((found[b].matrix() - wanted[b].matrix()).cwiseAbs().maxCoeff(), 1e-13) << model.bodies[b].name;
      }
    }
  }
}

// A fixed link's frame rides on the body it is merged into.
TEST(Placement, FramesRideOnTheirBodies) {
  const World world = arm_with_slider();
  const Model model = compile(world);
  std::mt19937 random(4);
  const std::vector<Pose> X_WB = place_bodies(model, random_state(model, random).q);
  const Pose tip = frame_pose(model, X_WB, model.frame("tip")), slider = frame_pose(model, X_WB, model.frame("slider"));
  Pose X_ST = Pose::Identity();
  X_ST.linear() = rotation_from_rpy({0.1, 0.2, 0.3});
  X_ST.translation().z() = 1;
  EXPECT_TRUE(tip.isApprox(slider * X_ST, 1e-14));
}

// rpy and rotation are inverse to each other, also where pitch is near or at a right angle.
TEST(Rotation, RollPitchYawRoundTrip) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (int i = 0; i < 1000; ++i) {
    const Mat3 R = rotation_from_rpy({angle(random), angle(random), angle(random)});
    EXPECT_LT((rotation_from_rpy(rpy_from_rotation(R)) - R).norm(), 1e-14);
  }
  for (double pitch : {M_PI / 2, -M_PI / 2}) {
    const Mat3 R = rotation_from_rpy({0.3, pitch, -0.7});
    EXPECT_LT((rotation_from_rpy(rpy_from_rotation(R)) - R).norm(), 1e-14);
  }
  const Vec3 rpy(0.1, -0.2, 0.3);  // R = Rz Ry Rx
  const Mat3 expected = (Eigen::AngleAxisd(0.3, Vec3::UnitZ()) * Eigen::AngleAxisd(-0.2, Vec3::UnitY()) *
                         Eigen::AngleAxisd(0.1, Vec3::UnitX()))
                            .toRotationMatrix();
  EXPECT_TRUE(rotation_from_rpy(rpy).isApprox(expected, 1e-15));
}

/// The lowest of many points on a shape's surface.
double sampled_lowest(const Shape& shape, const Pose& X, std::mt19937& random) {
  std::normal_distribution<double> n;
  std::uniform_real_distribution<double> u(-1, 1);
  double lowest = 1e9;
  for (int i = 0; i < 200000; ++i) {
    Vec3 p = Vec3(n(random), n(random), n(random)).normalized() * shape.size.x();
    if (shape.kind == ShapeKind::box)
      p = shape.size.cwiseProduct(Vec3(u(random), u(random), u(random)).cwiseSign()) / 2;
    if (shape.kind == ShapeKind::capsule) p.z() += p.z() > 0 ? shape.size.y() / 2 : -shape.size.y() / 2;
    if (shape.kind == ShapeKind::cylinder) {
      const double a = M_PI * u(random);
      p = {shape.size.x() * std::cos(a), shape.size.x() * std::sin(a), (i % 2 ? 0.5 : -0.5) * shape.size.y()};
    }
    lowest = std::min(lowest, (X * p).z());
  }
  return lowest;
}

// Turns by our own sines are Eigen's turns by the C library's.
TEST(Rotation, RotationsAboutAnAxisAreThoseOfEigen) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 axis = Vec3(normal(random), normal(random), normal(random)).normalized();
    const double angle = 10 * normal(random);
    const Mat3 expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_LT((rotation_about(axis, angle) - expected).cwiseAbs().maxCoeff(), 1e-15) << angle;
  }
}

// The closed forms of the lowest point agree with points sampled on the surfaces (which lie a little higher).
TEST(Placement, LowestPoint) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (ShapeKind kind : {ShapeKind::box, ShapeKind::sphere, ShapeKind::cylinder, ShapeKind::capsule}) {
    Model model;
    model.bodies.resize(1);
    Collider collider{"c", "c", 0, {kind, {0.3, 0.5, 0.7}, nullptr, nullptr}, Pose::Identity(), false};
    collider.X_BG.linear() = rotation_from_rpy({angle(random), angle(random), angle(random)});
    collider.X_BG.translation() = Vec3(0.1, 0.2, 0.3);
    model.colliders.push_back(collider);
    Pose X_WB = Pose::Identity();
    X_WB.linear() = rotation_from_rpy({angle(random), angle(random), angle(random)});
    const double exact = lowest_point(model, {X_WB});
    const double sampled = sampled_lowest(collider.shape, X_WB * collider.X_BG, random);
    EXPECT_LE(exact, sampled + 1e-12) << static_cast<int>(kind);
    EXPECT_NEAR(exact, sampled, 1e-4) << static_cast<int>(kind);
  }
}

}  // namespace
}  // namespace graze
