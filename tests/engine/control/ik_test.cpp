#include "engine/control/ik.h"

#include <random>

#include "tests/engine/control/support.h"

namespace graze {
namespace {

using Jacobian = Eigen::Matrix3Xd;

Vec3T<double> lane_of(const Vec3& a) { return {a.x(), a.y(), a.z()}; }

/// Tip and Jacobian from the lane code.
Vec3 tip_of(const Chain& chain, const Chain::Values& q, Jacobian& J) {
  Vec3T<double> columns[kMaxChainJoints];
  const Vec3T<double> tip = chain_jacobian<double, 0>(chain.view(), q.data(), columns);
  J.resize(3, chain.size());
  for (int i = 0; i < chain.size(); ++i) J.col(i) = Vec3(columns[i].x, columns[i].y, columns[i].z);
  return {tip.x, tip.y, tip.z};
}

bool solve_closed(const HipKneeView& leg, const Vec3& x, Chain::Values& q) {
  q.resize(3);
  return solve_hip_knee(leg, lane_of(x), q.data());
}

/// Joint-space inertia from the lane code.
Eigen::MatrixXd inertia_of(const Chain& chain, const Chain::Values& q) {
  const ChainView view = chain.view();
  ChainPose<double, 0> pose;
  ChainInertia<double> body[kMaxChainJoints];
  walk_chain(view, q.data(), pose, [&](int i, const RotT<double>& R, const Vec3T<double>& p) {
    body[i] = body_inertia(view.joint[i], R, p);
  });
  double M[kMaxChainJoints * kMaxChainJoints];
  chain_inertia(view, pose, body, M);
  Eigen::MatrixXd out(chain.size(), chain.size());
  for (int i = 0; i < chain.size(); ++i) {
    for (int j = 0; j <= i; ++j) out(i, j) = out(j, i) = M[i * kMaxChainJoints + j];
  }
  return out;
}

double solve_damped(const Chain& chain, const Vec3& x, Chain::Values& q) {
  return solve_damped(chain.view(), lane_of(x), q.data());
}

class LinksLegs : public ::testing::Test {
 protected:
  Scene scene{links_world()};
  std::vector<Chain> legs() const {
    std::vector<Chain> out;
    for (const char* foot : {"LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"}) {
      out.emplace_back(scene.model, scene.model.frame(foot));
    }
    return out;
  }
  /// Rows in q of a leg's joints.
  std::vector<int> rows_of(const Chain& leg) const {
    std::vector<int> rows;
    for (const ChainJointView& joint : leg.joints()) {
      rows.push_back(scene.model.bodies[scene.model.actuated[joint.actuator]].q);
    }
    return rows;
  }
  /// Joint angles around the initial ones, knee never straight.
  Chain::Values random_posture(const Chain& leg, std::mt19937& generator) const {
    std::uniform_real_distribution<double> spread(-0.5, 0.5);
    Chain::Values q = leg.select(scene.initial.q);
    for (int i = 0; i < leg.size(); ++i) q[i] += spread(generator);
    return q;
  }
};

// The chain's position and Jacobian are those of the whole model's kinematics with the base at the world's origin.
TEST_F(LinksLegs, ChainAgreesWithModelKinematics) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (const Chain& leg : legs()) {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(scene.model.nq);
    q[0] = 1;
    for (const int row : rows_of(leg)) q[row] = angle(generator);
    const std::vector<Pose> X_WB = reference_poses(scene.model, q);
    const int foot_body = scene.model.actuated[leg.joints().back().actuator];
    const auto frame = std::find_if(scene.model.frames.begin(), scene.model.frames.end(),
                                    [&](const Frame& f) { return f.body == foot_body && f.name.ends_with("_FOOT"); });
    const Vec3 p = (X_WB[foot_body] * frame->X_BF).translation();
    Jacobian J;
    EXPECT_LT((tip_of(leg, leg.select(q), J) - p).norm(), 1e-14);
    EXPECT_LT((leg.position(leg.select(q)) - p).norm(), 1e-14);
    const Eigen::Matrix3Xd whole = reference_jacobian(scene.model, X_WB, foot_body, p);
    for (int i = 0; i < leg.size(); ++i) {
      const int v = scene.model.bodies[scene.model.actuated[leg.joints()[i].actuator]].v;
      EXPECT_LT((J.col(i) - whole.col(v)).norm(), 1e-14);
    }
  }
}

// The closed form undoes forward kinematics exactly (to rounding, amplified by the knee's 1/sin) in the branch of the
// initial posture, for every leg.
TEST_F(LinksLegs, ClosedFormInvertsForwardKinematics) {
  std::mt19937 generator(2);
  for (const Chain& leg : legs()) {
    const auto closed = detect_hip_knee(leg, leg.select(scene.initial.q));
    ASSERT_TRUE(closed);
    for (int n = 0; n < 1000; ++n) {
      const Chain::Values q = random_posture(leg, generator);
      Chain::Values found;
      EXPECT_TRUE(solve_closed(*closed, leg.position(q), found));
      EXPECT_LT((found - q).norm(), 1e-12);
    }
  }
}

// Damped least squares and the closed form are independent and find the same joint angles from a start nearby.
TEST_F(LinksLegs, DampedLeastSquaresAgreesWithClosedForm) {
  std::mt19937 generator(3);
  for (const Chain& leg : legs()) {
    const auto closed = detect_hip_knee(leg, leg.select(scene.initial.q));
    ASSERT_TRUE(closed);
    for (int n = 0; n < 300; ++n) {
      const Vec3 x = leg.position(random_posture(leg, generator));
      Chain::Values direct, iterated = leg.select(scene.initial.q);
      solve_closed(*closed, x, direct);
      EXPECT_LT(solve_damped(leg, x, iterated), 1e-9);
      // 1e-9 m of tip error over the smallest singular value, at least 0.02 m/rad with a knee bent by 0.7 rad.
      EXPECT_LT((iterated - direct).norm(), 1e-9 / 0.02);
    }
  }
}

// The chain's joint-space inertia gives the kinetic energy of the leg's bodies, summed one by one from the model, when
// the base stands still.
TEST_F(LinksLegs, InertiaGivesKineticEnergy) {
  std::mt19937 generator(4);
  for (const Chain& leg : legs()) {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(scene.model.nq), v = Eigen::VectorXd::Zero(scene.model.nv);
    q[0] = 1;
    const Chain::Values posture = random_posture(leg, generator);
    Chain::Values rate(leg.size());
    for (int i = 0; i < leg.size(); ++i) {
      rate[i] = 1.0 + i;
      q[rows_of(leg)[i]] = posture[i];
      v[scene.model.bodies[scene.model.actuated[leg.joints()[i].actuator]].v] = rate[i];
    }
    const std::vector<Pose> X_WB = reference_poses(scene.model, q);
    double energy = 0;
    Vec3 omega = Vec3::Zero();
    for (int i = 0; i < leg.size(); ++i) {
      const int b = scene.model.actuated[leg.joints()[i].actuator];
      const Body& body = scene.model.bodies[b];
      omega += X_WB[b].linear() * body.axis * rate[i];
      const Vec3 v_com = reference_jacobian(scene.model, X_WB, b, X_WB[b] * body.com) * v;
      const Vec3 omega_B = X_WB[b].linear().transpose() * omega;
      energy += 0.5 * body.mass * v_com.squaredNorm() + 0.5 * omega_B.dot(body.inertia * omega_B);
    }
    EXPECT_NEAR(0.5 * rate.dot(inertia_of(leg, posture) * rate), energy, 1e-12 * energy);
  }
}

// A target out of reach: the closed form stretches the leg toward it, and no posture that damped least squares finds is
// nearer.
TEST_F(LinksLegs, OutOfReachStretchesTowardTheTarget) {
  for (const Chain& leg : legs()) {
    const auto closed = detect_hip_knee(leg, leg.select(scene.initial.q));
    const Vec3 x = leg.position(leg.select(scene.initial.q)) - 0.1 * Vec3::UnitZ();
    Chain::Values q, iterated = leg.select(scene.initial.q);
    EXPECT_FALSE(solve_closed(*closed, x, q));
    const double miss = (leg.position(q) - x).norm();
    EXPECT_NEAR(std::abs(std::remainder(q[2], 2 * M_PI)), 0, 1e-7);  // a straight knee
    const double least = solve_damped(leg, x, iterated);
    EXPECT_GT(least, 0.05);
    EXPECT_NEAR(miss, least, 2e-4);  // the hip's roll is solved for the plane, not for the distance
  }
}

// Joint limits hold, and what is left is the best point on the boundary: the distance cannot be reduced by any joint
// that is free to move.
TEST_F(LinksLegs, JointLimitsHold) {
  World world = links_world();
  for (Joint& joint : world.robot.joints) {
    if (joint.name.ends_with("Y_3")) joint.lower = -1.3, joint.upper = 1.3;
  }
  const Scene limited(world);
  const Chain leg(limited.model, limited.model.frame("LF_FOOT"));
  Chain::Values folded = leg.select(limited.initial.q);
  folded[2] = 1.8;
  const Vec3 x = leg.position(folded);
  Chain::Values q = leg.select(limited.initial.q);
  const double left = solve_damped(leg, x, q);
  EXPECT_NEAR(q[2], 1.3, 1e-12);
  EXPECT_GT(left, 1e-4);
  Jacobian J;
  const Vec3 e = x - tip_of(leg, q, J);
  const Eigen::VectorXd gradient = J.transpose() * e;
  EXPECT_LT(gradient.head(2).norm(), 1e-6);
  EXPECT_GT(gradient[2], 0);  // only the limit keeps the knee from folding further
}

// A leg whose first axis is not perpendicular to the others has no closed form and is solved all the same.
TEST_F(LinksLegs, OtherLegsFallBackToIteration) {
  World world = links_world();
  for (Joint& joint : world.robot.joints) {
    if (joint.name == "LF_X_1") joint.axis = Vec3(1, 0.2, 0.1).normalized();
  }
  const Scene skewed(world);
  const Chain leg(skewed.model, skewed.model.frame("LF_FOOT"));
  EXPECT_FALSE(detect_hip_knee(leg, leg.select(skewed.initial.q)));
  EXPECT_TRUE(detect_hip_knee(legs()[0], legs()[0].select(scene.initial.q)));
  Chain::Values q = leg.select(skewed.initial.q), v(3);
  const Vec3 x = leg.position(q) + Vec3(0.01, -0.01, 0.02);
  solve_damped(leg, x, q);
  EXPECT_LT((leg.position(q) - x).norm(), 1e-9);
  // Joint velocities move the tip at the velocity asked for, up to the damping (1 mm/rad against singular values > 2
  // cm).
  const Vec3 xd(0.1, -0.2, 0.3);
  Jacobian J;
  tip_of(leg, q, J);
  tip_velocity_to_joints<double, 3>(leg.view(), q.data(), lane_of(xd), v.data());
  EXPECT_LT((J * v - xd).norm(), xd.norm() * (1e-3 / 0.02) * (1e-3 / 0.02));
}

}  // namespace
}  // namespace graze
