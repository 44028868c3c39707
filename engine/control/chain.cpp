#include "engine/control/chain.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace graze {

namespace {

/// Index of the actuator that drives `body`, or -1.
int actuator_of(const Model& model, int body) {
  const auto found = std::find(model.actuated.begin(), model.actuated.end(), body);
  return found == model.actuated.end() ? -1 : static_cast<int>(found - model.actuated.begin());
}

/// Walks one joint: (R, p) becomes the pose of the joint's body frame in the base; `axis` its axis in the base.
void advance(const Chain::Joint& joint, double q, Mat3& R, Vec3& p, Vec3& axis) {
  p += R * joint.X_PB.translation();
  R = R * joint.X_PB.linear();
  axis = R * joint.axis;
  if (joint.prismatic) {
    p += q * axis;
  } else {
    R = R * Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
  }
}

}  // namespace

Chain::Chain(const Model& model, int frame) {
  const Frame& tip = model.frames.at(frame);
  p_BF_ = tip.X_BF.translation();
  for (int b = tip.body; b >= 0 && model.bodies[b].type != JointType::floating; b = model.bodies[b].parent) {
    const Body& body = model.bodies[b];
    const Joint joint{body.X_PB,   body.axis,  body.type == JointType::prismatic,
                      body.lower,  body.upper, actuator_of(model, b),
                      body.q,      body.mass,  body.com,
                      body.inertia};
    if (joint.actuator < 0) throw std::invalid_argument("joint " + body.joint + " on the way is not actuated");
    joints_.push_back(joint);
  }
  std::reverse(joints_.begin(), joints_.end());
  if (joints_.empty()) throw std::invalid_argument(tip.name + " does not move relative to the base");
  if (size() > kMaxJoints) {
    throw std::invalid_argument(tip.name + " has more than " + std::to_string(kMaxJoints) + " joints to the base");
  }
}

Vec3 Chain::position(const Values& q) const {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero(), axis;
  for (int i = 0; i < size(); ++i) advance(joints_[i], q[i], R, p, axis);
  return p + R * p_BF_;
}

Vec3 Chain::position(const Values& q, Jacobian& J) const {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero(), axis;
  std::array<Vec3, kMaxJoints> origin;
  J.resize(3, size());
  for (int i = 0; i < size(); ++i) {
    advance(joints_[i], q[i], R, p, axis);
    origin[i] = p;
    J.col(i) = axis;
  }
  const Vec3 tip = p + R * p_BF_;
  for (int i = 0; i < size(); ++i) {
    if (!joints_[i].prismatic) J.col(i) = Vec3(J.col(i)).cross(tip - origin[i]);
  }
  return tip;
}

Chain::Matrix Chain::inertia(const Values& q) const {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
  std::array<Vec3, kMaxJoints> origin, axis;
  Matrix M = Matrix::Zero(size(), size());
  for (int b = 0; b < size(); ++b) {
    const Joint& body = joints_[b];
    advance(body, q[b], R, p, axis[b]);
    origin[b] = p;
    const Vec3 com = p + R * body.com;
    const Mat3 inertia = R * body.inertia * R.transpose();
    // Sum over bodies of m Jc^T Jc + Jw^T I Jw, with the columns of the joints that carry the body.
    Jacobian Jc(3, b + 1), Jw(3, b + 1);
    for (int i = 0; i <= b; ++i) {
      Jc.col(i) = joints_[i].prismatic ? axis[i] : Vec3(axis[i].cross(com - origin[i]));
      Jw.col(i) = joints_[i].prismatic ? Vec3(Vec3::Zero()) : axis[i];
    }
    M.topLeftCorner(b + 1, b + 1) += body.mass * Jc.transpose() * Jc + Jw.transpose() * inertia * Jw;
  }
  return M;
}

Chain::Skeleton Chain::skeleton(const Values& q) const {
  Skeleton out;
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero(), axis;
  for (int i = 0; i < size(); ++i) {
    advance(joints_[i], q[i], R, p, axis);
    out.origin.push_back(p);
    out.axis.push_back(axis);
  }
  out.tip = p + R * p_BF_;
  return out;
}

Chain::Values Chain::select(const Eigen::VectorXd& q) const {
  Values out(size());
  for (int i = 0; i < size(); ++i) out[i] = q[joints_[i].q];
  return out;
}

}  // namespace graze
