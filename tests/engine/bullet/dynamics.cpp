// Accelerations of branched robots against an independent computation from the Model.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "tests/engine/bullet/worlds.h"
#include "tests/reference_kinematics.h"

namespace graze::test {
namespace {

class Dynamics : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Physics, Dynamics, testing::ValuesIn(physics_names()));

/// A random branched robot: six links of odd shapes and frames, five revolute joints or sliders.
World random_robot(std::mt19937& draw, bool floating) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto axis = [&] { return Vec3(Vec3(unit(draw), unit(draw), unit(draw) + 1.5).normalized()); };
  const auto pose = [&](double reach) {
    return at(reach * unit(draw), reach * unit(draw), reach * unit(draw), turn(2 * unit(draw), axis()));
  };
  World world;
  world.robot.floating_base = floating;
  for (int i = 0; i < 6; ++i) {
    const Shape shape = i % 2 ? cylinder(0.03, 0.2) : box(0.05, 0.1, 0.2);
    world.robot.links.push_back(link("l" + std::to_string(i), shape, 0.5 + 0.4 * unit(draw), pose(0.1), false));
    if (i == 0) continue;
    const std::string parent = "l" + std::to_string(i / 2);
    world.robot.joints.push_back(joint("j" + std::to_string(i), parent, "l" + std::to_string(i),
                                       i == 4 ? JointType::prismatic : JointType::revolute, pose(0.2), axis()));
  }
  return world;
}

/// Velocity of a body and the part of its acceleration that does not come from dv/dt.
struct Motion {
  Vec3 omega = Vec3::Zero(), alpha = Vec3::Zero(), v = Vec3::Zero(), a = Vec3::Zero();  // of the body origin, world
};

Motion motion_of(const Body& body, const Motion& parent, const Vec3& r, const Vec3& axis_W, const double* v) {
  Motion m;
  if (body.type == JointType::floating) {
    m.omega = Eigen::Map<const Vec3>(v);
    m.v = Eigen::Map<const Vec3>(v + 3);
    return m;
  }
  m.omega = parent.omega;
  m.alpha = parent.alpha;
  m.v = parent.v + parent.omega.cross(r);
  m.a = parent.a + parent.alpha.cross(r) + parent.omega.cross(parent.omega.cross(r));
  if (body.type == JointType::revolute) {
    m.alpha += parent.omega.cross(axis_W * *v);
    m.omega += axis_W * *v;
  } else {
    m.v += axis_W * *v;
    m.a += 2 * parent.omega.cross(axis_W * *v);
  }
  return m;
}

/// Columns of a body's angular velocity: omega = J v.
Eigen::Matrix3Xd angular_jacobian(const Model& model, const std::vector<Pose>& X, int i) {
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, model.nv);
  for (int k = i; k >= 0; k = model.bodies[k].parent) {
    const Body& body = model.bodies[k];
    if (body.type == JointType::floating) J.middleCols<3>(body.v).setIdentity();
    if (body.type == JointType::revolute) J.col(body.v) = X[k].linear() * body.axis;
  }
  return J;
}

/// dv/dt by Kane's method: (sum J^T M J) dv/dt = tau - sum J^T (m (a0 - g), I alpha0 + omega x I omega).
Eigen::VectorXd acceleration(const Model& model, const State& state, const Eigen::VectorXd& tau) {
  const std::vector<Pose> X = reference_poses(model, state.q);
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(model.nv, model.nv);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(model.nv);
  for (int k = 0; k < model.na(); ++k) f[model.bodies[model.actuated[k]].v] = tau[k];
  std::vector<Motion> motion(model.bodies.size());
  for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
    const Body& body = model.bodies[i];
    const bool rooted = body.parent < 0;
    const Vec3 r = X[i].translation() - (rooted ? Vec3(X[i].translation()) : Vec3(X[body.parent].translation()));
    const Motion m = motion[i] =
        motion_of(body, rooted ? Motion{} : motion[body.parent], r, X[i].linear() * body.axis, state.v.data() + body.v);
    const Vec3 lever = X[i].linear() * body.com;
    const Eigen::Matrix3Xd Jc = reference_jacobian(model, X, i, X[i].translation() + lever);
    const Eigen::Matrix3Xd Jw = angular_jacobian(model, X, i);
    const Mat3 I = X[i].linear() * body.inertia * X[i].linear().transpose();
    const Vec3 a0 = m.a + m.alpha.cross(lever) + m.omega.cross(m.omega.cross(lever));
    M += body.mass * Jc.transpose() * Jc + Jw.transpose() * I * Jw;
    f -= Jc.transpose() * (body.mass * (a0 - model.gravity)) +
         Jw.transpose() * (I * m.alpha + m.omega.cross(I * m.omega));
  }
  return M.ldlt().solve(f);
}

// Robots in random states under random torques accelerate as Kane's equations say. A step gives the mean over h, so two
// steps extrapolate to h = 0: what is left is O(h^2) and rounding / h, both near 1e-9 here.
TEST_P(Dynamics, RandomRobotsAccelerateAsKaneSays) {
  std::mt19937 draw(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const World world = random_robot(draw, trial % 2 == 0);
    Particle particle = particle_of(world);
    const Model& model = particle.model;
    State& state = particle.initial;
    for (int i = 0; i < model.nv; ++i) state.v[i] = 2 * unit(draw);
    for (const Body& body : model.bodies) {
      if (body.type != JointType::floating) state.q[body.q] = 0.5 * unit(draw);
    }
    if (model.floating_base) {
      const Quat q(turn(3 * unit(draw), {unit(draw), unit(draw), unit(draw) + 2}));
      state.q.head<4>() << q.w(), q.x(), q.y(), q.z();
    }
    Eigen::VectorXd tau(model.na());
    for (int k = 0; k < tau.size(); ++k) tau[k] = unit(draw);
    const auto mean = [&](double h) {
      Bench run(GetParam(), particle);
      for (int k = 0; k < tau.size(); ++k) run.tau(k, 0) = tau[k];
      run.step(h);
      return Eigen::VectorXd((run.v() - state.v) / h);
    };
    const double h = 1e-5;
    const Eigen::VectorXd expected = acceleration(model, state, tau), got = 2 * mean(h / 2) - mean(h);
    EXPECT_LT((got - expected).norm(), 1e-7 * (1 + expected.norm())) << trial;
  }
}

// Two links that a fixed joint holds together move as one link with both shapes, in flight and in contact.
TEST_P(Dynamics, FixedJointIsOneBody) {
  const Shape part = box(0.1, 0.2, 0.05);
  const Pose X = at(0.1, 0.05, 0.02, turn(0.4, {1, 2, 3}));
  World two = free_body(part, 0.5), one = two;
  two.robot.links.push_back(link("arm", part, 0.3));
  two.robot.joints.push_back(joint("weld", "body", "arm", JointType::fixed, X, Vec3::UnitX()));
  const Link arm = link("arm", part, 0.3, X);
  one.robot.links[0].inertia = one.robot.links[0].inertia + arm.inertia;
  one.robot.links[0].collisions.push_back({"body.1", part, X});
  for (World* world : {&two, &one}) {
    world->objects.push_back(fixed("ground", plane()));
    world->initial.position = {0, 0, 0.3};
    world->initial.angular_velocity = {1, 2, 3};
  }
  Bench a(GetParam(), two), b(GetParam(), one);
  ASSERT_EQ(a.model().bodies.size(), 1u);
  ASSERT_EQ(a.model().colliders.size(), b.model().colliders.size());
  for (int k = 0; k < 300; ++k) {
    a.step(1e-3);
    b.step(1e-3);
    ASSERT_LT((a.q() - b.q()).norm(), 1e-9) << k;
  }
  EXPECT_FALSE(a.contacts().empty());
}

}  // namespace
}  // namespace graze::test
