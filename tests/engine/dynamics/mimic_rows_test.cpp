// Claim: mimic rows, and contacts and joint rows beside them, are those of the dense system of equations
//   M dv - G^T p = f,  G (v + dv) = target,
// for any tree and any joints of it, on one path or on branches, also where one joint is followed by several.

#include <gtest/gtest.h>

#include "engine/contact/paths.h"
#include "engine/lane_physics/joints_of_step.h"
#include "tests/engine/dynamics/robots.h"

namespace graze {
namespace {

using testing::ScalarEngine;

constexpr double kStep = 1e-3;  // s

/// Joints of the model, of which every second follows the first or, `backwards`, the last one.
Model with_mimics(Model model, bool backwards) {
  std::vector<int> joints;
  for (const int body : model.actuated) joints.push_back(body);
  if (backwards) std::reverse(joints.begin(), joints.end());
  for (std::size_t i = 1; i < joints.size(); i += 2) {
    Body& body = model.bodies[joints[i]];
    body.mimics = joints[0];
    body.multiplier = 0.4 + 0.3 * static_cast<double>(i) * (i % 4 == 1 ? -1 : 1);
    body.offset = 0.1 * static_cast<double>(i);
  }
  return model;
}

/// What the kernels made of a state and an impulse, and what they should have.
class Case {
 public:
  Case(const Model& model, unsigned seed) : model_(model), engine_(model) {
    state_ = testing::random_state(model, seed);
    engine_.start(state_);
    M_ = engine_.mass_matrix();
    tree_ = tree_of<double>(engine_.engine.block());
    const Eigen::VectorXd impulse = Eigen::VectorXd::Random(model.nv);
    dz_ = impulse;
    factor_and_solve<double>(tree_, dz_.data());
    mimics_ = follow_mimics<double>(engine_.engine.block(), tree_, kStep, dz_.data());
    solve_densely(impulse);
  }

  void expect_free_motion() {
    const Eigen::VectorXd dv = change_of(dz_);
    EXPECT_LT((dv - dv_).cwiseAbs().maxCoeff(), 1e-10 * (1 + dv_.cwiseAbs().maxCoeff()));
    EXPECT_LT((G_ * (state_.v + dv) - target_).cwiseAbs().maxCoeff(), 1e-11 * (1 + dv_.cwiseAbs().maxCoeff()));
  }

  void expect_contacts() {
    const std::vector<Pose> X = reference_poses(model_, state_.q);
    Paths paths(tree_.topology, mimic_dofs(model_, tree_.topology));
    const int bodies = static_cast<int>(model_.bodies.size());
    for (int a = 0; a < bodies; ++a) {
      const int b = (5 * a + 3) % (bodies + 1) - 1;
      if (a == b) continue;
      const Vec3 p = X[a].translation() + 0.3 * Vec3::Random();
      Eigen::Matrix3Xd J = reference_jacobian(model_, X, a, p);
      if (b >= 0) J -= reference_jacobian(model_, X, b, p);
      expect_contact(paths.views()[paths.add(a, b)], p, J);
    }
  }

  void expect_joint_rows() {
    for (const Body& body : model_.bodies) {
      if (body.type == JointType::floating) continue;
      const JointPathView& path = engine_.engine.block().joint_paths[body.v];
      std::vector<double> y(2 * path.count), scratch(model_.nv);
      JointRowT<double> row{};
      row.y = y.data();
      row.lanes = 1;
      set_up_joint<double>(tree_, state_.v.data(), body.v, path, mimics_, scratch.data(), row);
      const Eigen::VectorXd e = Eigen::VectorXd::Unit(model_.nv, body.v);
      const double A = e.dot(response_ * e);
      EXPECT_NEAR(1 / row.inverse_a, A, 1e-9 * A);
      EXPECT_NEAR(speed_of(row, dz_.data()), state_.v[body.v] + dv_[body.v], 1e-9 * (1 + dv_.cwiseAbs().maxCoeff()));
      Eigen::VectorXd dz = Eigen::VectorXd::Zero(model_.nv);
      apply_row(row, 1.0, dz.data());
      EXPECT_LT((change_of(dz) - response_ * e).cwiseAbs().maxCoeff(), 1e-9 * A);
    }
  }

 private:
  void solve_densely(const Eigen::VectorXd& impulse) {
    std::vector<const Body*> followers;
    for (const Body& body : model_.bodies) {
      if (body.mimics >= 0) followers.push_back(&body);
    }
    G_.setZero(static_cast<Eigen::Index>(followers.size()), model_.nv);
    target_.setZero(G_.rows());
    for (Eigen::Index i = 0; i < G_.rows(); ++i) {
      const Body &body = *followers[i], &other = model_.bodies[body.mimics];
      G_(i, body.v) = 1, G_(i, other.v) = -body.multiplier;
      const double error = state_.q[body.q] - body.multiplier * state_.q[other.q] - body.offset;
      target_[i] = std::clamp(-0.2 * error / kStep, -0.2, 0.2);
    }
    const Eigen::MatrixXd W = M_.inverse(), GWG = G_ * W * G_.transpose();
    const Eigen::VectorXd free = W * impulse;
    dv_ = free + W * G_.transpose() * GWG.ldlt().solve(target_ - G_ * (state_.v + free));
    response_ = W - W * G_.transpose() * GWG.ldlt().solve(G_ * W);
  }

  /// Change of v of a change of L v.
  Eigen::VectorXd change_of(Eigen::VectorXd dz) const {
    solve_L<double>(tree_, dz.data());
    return dz;
  }

  void expect_contact(const PathView& path, const Vec3& p, const Eigen::Matrix3Xd& J) {
    ContactT<double> c{};
    c.p = {p.x(), p.y(), p.z()};
    const Vec3 n = Vec3::Random().normalized();
    c.n = {n.x(), n.y(), n.z()};
    make_tangents(c);
    c.phi = 1;
    std::vector<Vec3T<double>> y(2 * path.count), scratch(model_.nv);
    c.y = y.data();
    set_up_contact<double>(tree_, nullptr, path, mimics_, {0, 0, 0.2, 0.1}, kStep, dz_.data(), c, scratch.data());
    Eigen::Matrix3d axes;
    axes << n.x(), n.y(), n.z(), c.s.x, c.s.y, c.s.z, c.t.x, c.t.y, c.t.z;
    const Eigen::Matrix3d A = axes * J * response_ * J.transpose() * axes.transpose();
    const double scale = 1e-9 * (1 + A.trace());
    EXPECT_NEAR(c.ann - c.compliance, A(0, 0), scale);
    EXPECT_NEAR(c.ass - c.guard, A(1, 1), scale);
    EXPECT_NEAR(c.att - c.guard, A(2, 2), scale);
    EXPECT_NEAR(c.ans, A(0, 1), scale);
    EXPECT_NEAR(c.ant, A(0, 2), scale);
    EXPECT_NEAR(c.ast, A(1, 2), scale);
    EXPECT_NEAR(c.free, n.dot(J * (state_.v + dv_)), 1e-9 * (1 + dv_.cwiseAbs().maxCoeff()));
    // What its impulse does.
    Eigen::VectorXd dz = Eigen::VectorXd::Zero(model_.nv);
    for (int i = 0; i < path.count; ++i) dz[path.dofs[i]] = c.y[path.count + i].x;
    const Eigen::VectorXd wanted = response_ * J.transpose() * n;
    EXPECT_LT((change_of(dz) - wanted).cwiseAbs().maxCoeff(), 1e-9 * (1 + wanted.cwiseAbs().maxCoeff()));
  }

  const Model& model_;
  ScalarEngine engine_;
  State state_;
  TreeT<double> tree_;
  MimicsT<double> mimics_;
  Eigen::MatrixXd M_, G_, response_;  // response_: change of v per impulse, with the rows
  Eigen::VectorXd dz_, dv_, target_;
};

TEST(MimicRows, AreThoseOfTheDenseSystem) {
  int tried = 0;
  for (const auto& [name, plain] : testing::robots()) {
    if (plain.na() < 2) continue;
    for (const bool backwards : {false, true}) {
      SCOPED_TRACE(name + (backwards ? ", following the last joint" : ", following the first"));
      const Model model = with_mimics(plain, backwards);
      for (unsigned seed = 1; seed < 5; ++seed) {
        Case one(model, seed);
        one.expect_free_motion();
        one.expect_contacts();
        one.expect_joint_rows();
        ++tried;
      }
    }
  }
  EXPECT_GT(tried, 80);
}

}  // namespace
}  // namespace graze
