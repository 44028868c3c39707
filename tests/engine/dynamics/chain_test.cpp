// Claim: the serial form of a limb (chain.h) is the tree's kinematics and inertia of the same joints, base held still.

#include "engine/dynamics/chain.h"

#include <gtest/gtest.h>

#include "engine/dynamics/chain_motion.h"
#include "engine/dynamics/dynamics_model.h"
#include "tests/engine/dynamics/robots.h"

namespace graze {
namespace {

/// Limbs: the joints on the way to each frame of a moving body, base to tip.
std::vector<int> limb_bodies(const Model& model, int frame) {
  std::vector<int> out;
  for (int b = model.frames[frame].body; b >= 0 && model.bodies[b].type != JointType::floating;
       b = model.bodies[b].parent) {
    out.insert(out.begin(), b);
  }
  return out;
}

Vec3 base_axes(const Pose& X_WBase, const Vec3T<double>& a) { return X_WBase.linear().transpose() * to_eigen(a); }

/// Tip, columns of its Jacobian and M by both.
void expect_same(const Model& model, int frame, const State& state) {
  const std::vector<int> bodies = limb_bodies(model, frame);
  const Chain chain(model, frame);
  const ChainView view = chain.view();
  const int n = chain.size();
  ASSERT_EQ(n, static_cast<int>(bodies.size()));
  const DynamicsModel robot(model);
  DynamicsData<double> data(robot);
  const TreeT<double>& tree = data.tree();
  update(tree, state.q.data(), state.v.data());
  const Pose X_WBase = model.floating_base ? to_eigen(tree.pose[0]) : fixed_base_pose(model);
  const Chain::Values q = chain.select(state.q);
  ChainPose<double, 0> pose;
  ChainInertia<double> inertia[kMaxChainJoints];
  walk_chain(view, q.data(), pose, [&](int i, const RotT<double>& R, const Vec3T<double>& p) {
    inertia[i] = body_inertia(view.joint[i], R, p);
    const Pose X = X_WBase.inverse() * to_eigen(tree.pose[bodies[static_cast<std::size_t>(i)]]);
    EXPECT_LT((X.matrix() - to_eigen(PoseT<double>{R, p}).matrix()).cwiseAbs().maxCoeff(), 1e-13);
  });
  const Frame& tip = model.frames[frame];
  const PoseT<double> X_WF = frame_pose(tree, tip.body, to_kernel(tip.X_BF));
  const Vec3 p_BF = X_WBase.inverse() * to_eigen(X_WF.p);
  EXPECT_LT((to_eigen(pose.tip) - p_BF).norm(), 1e-13);
  EXPECT_LT((chain.position(q) - p_BF).norm(), 1e-13);
  std::vector<Vec3T<double>> J(model.nv);
  point_jacobian(tree, tip.body, X_WF.p, J.data());
  double M[kMaxChainJoints * kMaxChainJoints];
  chain_inertia(view, pose, inertia, M);
  for (int i = 0; i < n; ++i) {
    const int dof = model.bodies[bodies[static_cast<std::size_t>(i)]].v;
    EXPECT_LT((to_eigen(tip_column(view, pose, i)) - base_axes(X_WBase, J[dof])).norm(), 1e-13) << i;
    for (int j = 0; j <= i; ++j) {
      const double wanted = mass_entry(tree, dof, model.bodies[bodies[static_cast<std::size_t>(j)]].v);
      EXPECT_NEAR(M[i * kMaxChainJoints + j], wanted, 1e-13 * (1 + std::abs(wanted))) << i << " " << j;
    }
  }
}

// Of a chain that ends a limb: M is the tree's only where nothing else hangs on its bodies.
TEST(Chain, IsTheSerialFormOfTheTree) {
  int limbs = 0;
  const auto on = [&](const Model& model, const std::vector<std::string>& tips) {
    for (const std::string& tip : tips) {
      for (unsigned seed = 1; seed < 6; ++seed, ++limbs) {
        SCOPED_TRACE(tip + ", state " + std::to_string(seed));
        expect_same(model, model.frame(tip), testing::random_state(model, seed));
      }
    }
  };
  on(testing::shipped("links.urdf", true), {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"});
  for (unsigned seed = 1; seed < 6; ++seed) {
    on(testing::random_tree(seed, {.links = 7, .straight = 1}), {"link6"});
    on(testing::random_tree(seed, {.links = 9, .floating = false, .straight = 1}), {"link8"});
    on(testing::random_tree(seed, {.links = 6, .straight = 0}), {"link1", "link5"});
  }
  EXPECT_GT(limbs, 100);
}

}  // namespace
}  // namespace graze
