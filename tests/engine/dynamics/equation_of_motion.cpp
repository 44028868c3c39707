// Claim: the mass matrix, bias forces and contact Jacobians of the lane kernels are those of the model, for any tree
// (checked against sums over bodies with Jacobians from other code), and the factorisation solves with them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>

#include "engine/contact/constraint.h"
#include "engine/contact/paths.h"
#include "engine/dynamics/factor.h"
#include "engine/lane_physics/block_view.h"
#include "tests/engine/dynamics/reference.h"

namespace graze {
namespace {

using testing::ScalarEngine;

/// A tree with everything: floating and fixed base, revolute and prismatic joints, branches, skew axes and offsets.
Model mixed_tree(bool floating) {
  World world;
  Robot& robot = world.robot;
  robot.floating_base = floating;
  const int parents[] = {-1, 0, 1, 1, 3, 0, 5, 6};
  std::srand(7);
  for (int i = 0; i < 8; ++i) {
    Link link;
    link.name = "link" + std::to_string(i);
    const Mat3 A = Mat3::Random();
    link.inertia.mass = 1.0 + i;
    link.inertia.first = link.inertia.mass * 0.2 * Vec3::Random();
    link.inertia.second = A * A.transpose() * 0.3 + Mat3::Identity() * 0.1 +
                          link.inertia.first * link.inertia.first.transpose() / link.inertia.mass;
    robot.links.push_back(link);
    if (i == 0) continue;
    Joint joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = "link" + std::to_string(parents[i]);
    joint.child = link.name;
    joint.type = i % 3 == 2 ? JointType::prismatic : JointType::revolute;
    joint.X_PJ.linear() = rotation_from_rpy(Vec3::Random());
    joint.X_PJ.translation() = 0.5 * Vec3::Random();
    joint.axis = i == 4 ? Vec3(0, 0, -1) : Vec3(Vec3::Random().normalized());
    if (i % 2 == 0) joint.gear = 20, joint.rotor_inertia = 1e-3;
    robot.joints.push_back(joint);
  }
  world.gravity = {1.0, -2.0, -9.0};
  return compile(world);
}

/// The rows of contacts between any two bodies, or a body and the world, are those of the point's velocities.
void expect_contact_jacobians(const Model& model, const State& state, ScalarEngine& engine) {
  const std::vector<Pose> X = reference_poses(model, state.q);
  const TreeT<double> tree = tree_of<double>(engine.engine.block());
  Paths paths(tree.topology);
  const int bodies = static_cast<int>(model.bodies.size());
  for (int a = 0; a < bodies; ++a) {
    const int b = (5 * a + 3) % (bodies + 1) - 1;
    if (a == b) continue;
    const int index = paths.add(a, b);
    const PathView& path = paths.views()[index];
    const Vec3 p = X[a].translation() + 0.3 * Vec3::Random(), n = Vec3::Random().normalized();
    ContactT<double> contact{};
    contact.p = {p.x(), p.y(), p.z()};
    contact.n = {n.x(), n.y(), n.z()};
    make_tangents(contact);
    std::vector<Vec3T<double>> rows(model.nv, {0, 0, 0});
    for (int i = 0; i < path.moving_count; ++i) {
      jacobian_rows(tree, path.bodies[i], path.signs[i], contact, rows.data());
    }
    Eigen::Matrix3Xd J = reference_jacobian(model, X, a, p);
    if (b >= 0) J -= reference_jacobian(model, X, b, p);
    for (int k = 0; k < model.nv; ++k) {
      const Vec3 column = J.col(k);
      const auto along = [&](const Vec3T<double>& d) { return column.dot(Vec3(d.x, d.y, d.z)); };
      EXPECT_NEAR(rows[k].x, along(contact.n), 1e-12) << a << " " << b << " " << k;
      EXPECT_NEAR(rows[k].y, along(contact.s), 1e-12) << a << " " << b << " " << k;
      EXPECT_NEAR(rows[k].z, along(contact.t), 1e-12) << a << " " << b << " " << k;
    }
  }
}

void expect_equation_of_motion(const Model& model, unsigned seed) {
  const State state = testing::random_state(model, seed);
  ScalarEngine engine(model);
  engine.start(state);
  const Eigen::MatrixXd M = testing::reference_mass_matrix(model, state.q);
  EXPECT_LT((engine.mass_matrix() - M).cwiseAbs().maxCoeff(), 1e-12 * M.cwiseAbs().maxCoeff());
  const Eigen::VectorXd bias = testing::reference_bias(model, state.q, state.v);
  EXPECT_LT((engine.bias() - bias).cwiseAbs().maxCoeff(), 1e-12 * bias.cwiseAbs().maxCoeff());
  expect_contact_jacobians(model, state, engine);
}

TEST(EquationOfMotion, OfAFloatingTree) {
  for (unsigned seed = 1; seed < 6; ++seed) expect_equation_of_motion(mixed_tree(true), seed);
}

TEST(EquationOfMotion, OfAFixedTree) {
  for (unsigned seed = 1; seed < 6; ++seed) expect_equation_of_motion(mixed_tree(false), seed);
}

TEST(EquationOfMotion, OfLinks) {
  World world;
  world.robot = load_urdf(std::string(GRAZE_SOURCE_DIR) + "/data/robots/links.urdf");
  for (unsigned seed = 1; seed < 4; ++seed) expect_equation_of_motion(compile(world), seed);
}

/// Robots of others, by the environment or beside the sources.
std::filesystem::path robots_folder() {
  const char* given = std::getenv("GRAZE_TEST_ROBOTS");
  return given ? given : std::filesystem::path(GRAZE_SOURCE_DIR).parent_path() / "shared" / "robots";
}

TEST(EquationOfMotion, OfOtherPeoplesRobots) {
  if (!std::filesystem::is_directory(robots_folder())) GTEST_SKIP() << "no robots at " << robots_folder();
  int read = 0;
  std::vector<std::string> refused;
  for (const auto& file : std::filesystem::recursive_directory_iterator(robots_folder())) {
    if (file.path().extension() != ".urdf") continue;
    World world;
    UrdfOptions options;
    options.repair = true;
    try {
      world.robot = load_urdf(file.path().string(), options);
      // Links may lack mass; that is the reader's and the compiler's to refuse.
      const Model model = compile(world);
      SCOPED_TRACE(file.path().string());
      expect_equation_of_motion(model, 3);
      ++read;
    } catch (const InputError& error) {
      refused.push_back(file.path().filename().string() + ": " + error.what());
    }
  }
  RecordProperty("read", read);
  for (const std::string& one : refused) std::cout << "not compared: " << one << "\n";
  EXPECT_GT(read, 5);
}

TEST(Factorization, SolvesWithTheMassMatrix) {
  const Model model = mixed_tree(true);
  ScalarEngine engine(model);
  engine.start(testing::random_state(model, 11));
  const Eigen::MatrixXd M = engine.mass_matrix();
  LaneBlock& block = engine.engine.block();
  TreeT<double> tree{};
  tree.topology = block.topology;
  tree.M = block.M;
  tree.inverse_D = block.inverse_D;
  Eigen::VectorXd x = Eigen::VectorXd::Random(model.nv);
  const Eigen::VectorXd want = M.ldlt().solve(x);
  factor_and_solve(tree, x.data());
  solve_L(tree, x.data());
  EXPECT_LT((x - want).norm(), 1e-12 * want.norm() * M.norm());
  // M = L^T D L, entry by entry.
  Eigen::MatrixXd L = Eigen::MatrixXd::Identity(model.nv, model.nv);
  Eigen::VectorXd D(model.nv);
  for (int i = 0; i < model.nv; ++i) {
    D[i] = 1 / block.inverse_D[i];
    for (int d = 0; d < block.topology.dof_depth[i]; ++d) {
      L(i, block.topology.chain[block.topology.row[i] + d]) = block.M[block.topology.row[i] + d];
    }
  }
  EXPECT_LT((L.transpose() * D.asDiagonal() * L - M).norm(), 1e-13 * M.norm());
}

}  // namespace
}  // namespace graze
