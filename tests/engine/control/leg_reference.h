#pragma once
// Jacobian and inertia of a leg of three joints by the whole robot's kinematics and sums over bodies: references of the
// chain's own.

#include "engine/dynamics/chain.h"
#include "tests/reference_kinematics.h"

namespace graze {

/// Poses of the bodies with the base at the world's origin and one leg at q.
inline std::vector<Pose> leg_poses(const Model& model, const Chain& leg, const Chain::Values& q) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(model.nq);
  all[0] = 1;
  for (int i = 0; i < leg.size(); ++i) all[model.bodies[model.actuated[leg.joints()[i].actuator]].q] = q[i];
  const std::vector<Pose> X_WB = reference_poses(model, all);
  return X_WB;
}

/// Columns of the leg's joints in the whole robot's Jacobian of a point of a body.
inline Eigen::Matrix3d columns(const Model& model, const Chain& leg, const std::vector<Pose>& X_WB, int body,
                               const Vec3& p) {
  const Eigen::Matrix3Xd whole = reference_jacobian(model, X_WB, body, p);
  Eigen::Matrix3d J;
  for (int i = 0; i < 3; ++i) J.col(i) = whole.col(model.bodies[model.actuated[leg.joints()[i].actuator]].v);
  return J;
}

/// Of the foot, by the whole robot's kinematics.
inline Eigen::Matrix3d leg_jacobian(const Model& model, const Chain& leg, const Chain::Values& q) {
  const int foot = model.actuated[leg.joints().back().actuator];
  return columns(model, leg, leg_poses(model, leg, q), foot, leg.position(q));
}

/// Joint-space inertia as the sum over the bodies of m Jc^T Jc + Jw^T I Jw.
inline Eigen::Matrix3d leg_inertia(const Model& model, const Chain& leg, const Chain::Values& q) {
  const std::vector<Pose> X_WB = leg_poses(model, leg, q);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero(), Jw = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const int b = model.actuated[leg.joints()[i].actuator];
    const Body& body = model.bodies[b];
    const Mat3 R = X_WB[b].linear();
    Jw.col(i) = R * body.axis;
    const Eigen::Matrix3d Jc = columns(model, leg, X_WB, b, X_WB[b] * body.com);
    M += body.mass * Jc.transpose() * Jc + Jw.transpose() * (R * body.inertia * R.transpose()) * Jw;
  }
  return M;
}

}  // namespace graze
