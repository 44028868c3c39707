#pragma once
// Kinematics of a Model by Eigen, joint by joint: the way that tests go beside engine/dynamics, with which this shares
// nothing.

#include <Eigen/Geometry>
#include <vector>

#include "engine/model/placement.h"
#include "engine/model/rotation.h"

namespace graze {

/// World poses of all bodies, joint by joint with Eigen's rotations.
inline std::vector<Pose> reference_poses(const Model& model, const Eigen::VectorXd& q) {
  std::vector<Pose> X;
  for (const Body& body : model.bodies) {
    Pose own = Pose::Identity();
    if (body.type == JointType::floating) {
      own.linear() = Quat(q[body.q], q[body.q + 1], q[body.q + 2], q[body.q + 3]).normalized().toRotationMatrix();
      own.translation() = q.segment<3>(body.q + 4);
    } else if (body.type == JointType::revolute) {
      own.linear() = Eigen::AngleAxisd(q[body.q], body.axis).toRotationMatrix();
    } else {
      own.translation() = q[body.q] * body.axis;
    }
    const Pose X_PC = body.X_PB * own;
    X.push_back(body.parent < 0 ? X_PC : X[body.parent] * X_PC);
  }
  return X;
}

/// Velocity of a point fixed to `body` (-1: the world), now at p_W: J v. 3 x nv, world axes.
inline Eigen::Matrix3Xd reference_jacobian(const Model& model, const std::vector<Pose>& X, int body, const Vec3& p_W) {
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, model.nv);
  for (int b = body; b >= 0; b = model.bodies[b].parent) {
    const Body& joint = model.bodies[b];
    const Vec3 r = p_W - X[b].translation(), axis_W = X[b].linear() * joint.axis;
    if (joint.type == JointType::floating) {
      for (int k = 0; k < 3; ++k) J.col(joint.v + k) = Vec3::Unit(k).cross(r);
      J.block<3, 3>(0, joint.v + 3).setIdentity();
    } else {
      J.col(joint.v) = joint.type == JointType::revolute ? Vec3(axis_W.cross(r)) : axis_W;
    }
  }
  return J;
}

}  // namespace graze
