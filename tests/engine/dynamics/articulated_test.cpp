// Claim: what goes through articulated-body inertias (engine/dynamics/articulated.h) is what the factors of M give:
// rows of contacts and L^-T of joint forces, on any tree, also with more on M's diagonal than bodies and rotors.

#include <gtest/gtest.h>

#include "engine/contact/constraint.h"
#include "engine/contact/paths.h"
#include "engine/lane_physics/block_view.h"
#include "tests/engine/dynamics/robots.h"

namespace graze {
namespace {

using testing::ScalarEngine;

/// A robot at some state, its M with dampers factored, and its articulated inertias.
class Articulated {
 public:
  Articulated(const Model& model, unsigned seed) : model_(model), engine_(model), diagonal_(model.nv) {
    engine_.start(testing::random_state(model, seed));
    tree_ = tree_of<double>(engine_.engine.block());
    const TopologyView& t = tree_.topology;
    for (int i = 0; i < t.bodies; ++i) {
      if (t.kind[i] == kFloating) continue;
      const int k = t.v[i];
      const double damping = 0.01 * (1 + k % 3);
      tree_.M[t.row[k] + t.dof_depth[k]] += damping;
      diagonal_[k] = model.bodies[i].armature + damping;
    }
    M_ = engine_.mass_matrix();
    std::vector<double> none(model.nv);
    factor_and_solve<double>(tree_, none.data());
    std::vector<SpatialMatrixT<double>> A(t.bodies);
    U_.resize(t.bodies);
    articulate<double>(tree_, diagonal_.data(), A.data(), U_.data());
  }

  void expect_forces() {
    const Eigen::VectorXd g = Eigen::VectorXd::Random(model_.nv);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(model_.nv);
    std::vector<SpatialT<double>> F(tree_.topology.bodies);
    int visited = 0, last = model_.nv;
    visit_forces(tree_, U_.data(), g.data(), F.data(), [&](int k, double value) {
      EXPECT_LT(k, last);
      last = k, x[k] = value, ++visited;
    });
    EXPECT_EQ(visited, model_.nv);
    // M^-1 = L^-1 D^-1 L^-T
    double energy = 0;
    for (int k = 0; k < model_.nv; ++k) energy += x[k] * x[k] * tree_.inverse_D[k], x[k] *= tree_.inverse_D[k];
    solve_L<double>(tree_, x.data());
    const Eigen::VectorXd want = M_.ldlt().solve(g);
    EXPECT_LT((x - want).norm(), 1e-10 * (1 + want.norm()));
    EXPECT_NEAR(energy, g.dot(want), 1e-10 * (1 + energy));
  }

  void expect_contacts() {
    Paths paths(tree_.topology, {});
    const int bodies = static_cast<int>(model_.bodies.size());
    for (int body = 0; body < bodies; ++body) {
      for (const bool first : {true, false}) {
        const int path = first ? paths.add(body, -1) : paths.add(-1, body);
        expect_contact(paths.views()[path]);
      }
    }
  }

 private:
  void expect_contact(const PathView& path) {
    const Vec3 p = Vec3::Random(), n = Vec3::Random().normalized();
    ContactT<double> one{}, other{};
    one.p = {p.x(), p.y(), p.z()}, one.n = {n.x(), n.y(), n.z()};
    make_tangents(one);
    other = one;
    std::vector<Vec3T<double>> y(2 * path.count), want(2 * path.count), scratch(model_.nv);
    one.y = y.data(), other.y = want.data();
    factor_contact_of_body<double>(tree_, U_.data(), path, one);
    factor_contact<double>(tree_, path, other, scratch.data());
    const double scale = 1e-10 * (1 + other.ann + other.ass + other.att);
    for (int i = 0; i < 2 * path.count; ++i) {
      for (int k = 0; k < 3; ++k) EXPECT_NEAR((&y[i].x)[k], (&want[i].x)[k], scale) << i << " of " << path.count;
    }
    EXPECT_NEAR(one.ann, other.ann, scale);
    EXPECT_NEAR(one.ast, other.ast, scale);
  }

  const Model& model_;
  ScalarEngine engine_;
  TreeT<double> tree_;
  Eigen::VectorXd diagonal_ = {};
  Eigen::MatrixXd M_;
  std::vector<SpatialT<double>> U_;
};

TEST(Articulated, RowsAndForcesAreThoseOfTheFactors) {
  for (const auto& [name, model] : testing::robots()) {
    SCOPED_TRACE(name);
    for (unsigned seed = 1; seed < 4; ++seed) {
      Articulated one(model, seed);
      one.expect_forces();
      one.expect_contacts();
    }
  }
}

}  // namespace
}  // namespace graze
