#include "engine/dynamics/chain.h"

#include <algorithm>
#include <stdexcept>

#include "engine/dynamics/chain_motion.h"
#include "engine/dynamics/dynamics_model.h"
#include "engine/model/placement.h"

namespace graze {

namespace {

/// Index of the actuator that drives `body`, or -1.
int actuator_of(const Model& model, int body) {
  const auto found = std::find(model.actuated.begin(), model.actuated.end(), body);
  return found == model.actuated.end() ? -1 : static_cast<int>(found - model.actuated.begin());
}

void put(const Vec3& from, double* to) { Vec3::Map(to) = from; }
void put_matrix(const Mat3& from, double* to) { Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{to} = from; }

/// X_PB: the joint's frame at zero in that of the joint before it, or in the base's.
ChainJointView joint_view(const Body& body, const Pose& X_PB, int actuator) {
  ChainJointView out{};
  out.prismatic = body.type == JointType::prismatic;
  out.actuator = actuator;
  out.lower = body.lower;
  out.upper = body.upper;
  // Rodrigues: R(q) = a a^T + cos(q) (1 - a a^T) + sin(q) [a]x, behind the frame's own rotation.
  const Mat3 R = X_PB.linear(), along = body.axis * body.axis.transpose();
  Mat3 skew;
  skew << 0, -body.axis.z(), body.axis.y(), body.axis.z(), 0, -body.axis.x(), -body.axis.y(), body.axis.x(), 0;
  put_matrix(out.prismatic ? R : Mat3(R * along), out.fixed);
  put_matrix(R * (Mat3::Identity() - along), out.cosine);
  put_matrix(R * skew, out.sine);
  put(Vec3(X_PB.translation()), out.offset);
  put(R * body.axis, out.axis);
  out.mass = body.mass;
  put(body.com, out.com);
  const Mat3& I = body.inertia;
  const double inertia[6] = {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
  std::copy(inertia, inertia + 6, out.inertia);
  out.armature = body.armature;
  return out;
}

}  // namespace

Chain::Chain(const Model& model, int frame) {
  const Frame& tip = model.frames.at(frame);
  p_BF_ = tip.X_BF.translation();
  for (int b = tip.body; b >= 0 && model.bodies[b].type != JointType::floating; b = model.bodies[b].parent) {
    const Body& body = model.bodies[b];
    const Pose X_PB = body.parent < 0 ? Pose(fixed_base_pose(model).inverse() * body.X_PB) : body.X_PB;
    joints_.push_back(joint_view(body, X_PB, actuator_of(model, b)));
    q_.push_back(body.q);
    if (joints_.back().actuator < 0) {
      throw std::invalid_argument("joint " + body.joint + " on the way is not actuated");
    }
  }
  std::reverse(joints_.begin(), joints_.end());
  std::reverse(q_.begin(), q_.end());
  if (joints_.empty()) throw std::invalid_argument(tip.name + " does not move relative to the base");
  if (size() > kMaxChainJoints) {
    throw std::invalid_argument(tip.name + " has more than " + std::to_string(kMaxChainJoints) + " joints to the base");
  }
}

ChainView Chain::view() const { return {size(), joints_.data(), {p_BF_.x(), p_BF_.y(), p_BF_.z()}}; }

Vec3 Chain::position(const Values& q) const { return to_eigen(chain_tip<double, 0>(view(), q.data())); }

Chain::Skeleton Chain::skeleton(const Values& q) const {
  ChainPose<double, 0> pose;
  walk_chain(view(), q.data(), pose, [](int, const RotT<double>&, const Vec3T<double>&) {});
  Skeleton out;
  for (int i = 0; i < size(); ++i) {
    out.origin.push_back(to_eigen(pose.origin[i]));
    out.axis.push_back(to_eigen(pose.axis[i]));
  }
  out.tip = to_eigen(pose.tip);
  return out;
}

Chain::Values Chain::select(const Eigen::VectorXd& q) const {
  Values out(size());
  for (int i = 0; i < size(); ++i) out[i] = q[q_[i]];
  return out;
}

}  // namespace graze
