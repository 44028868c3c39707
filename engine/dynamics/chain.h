#pragma once
// The serial form of a tree's kinematics: a leg or arm, the joints from the base to one frame of the nominal model, for
// controllers that run every control step. Its numbers are the same in all lanes and its length is known when it is
// compiled, so that it is straight code on constants; what is computed of it stands in chain_motion.h, and is what
// tree.h, frames.h and equation.h have for the same joints (tests/engine/dynamics/chain_test.cpp).

#include "engine/dynamics/chain_view.h"
#include "engine/model/model.h"

namespace graze {

class Chain {
 public:
  using Values = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxChainJoints, 1>;

  /// From the base (body 0 of a floating base, else fixed_base_pose()) to `frame`, an index into Model::frames. Throws
  /// std::invalid_argument with a sentence if the frame is fixed to the base, a joint on the way is not actuated, or
  /// there are more than kMaxChainJoints.
  Chain(const Model& model, int frame);

  int size() const { return static_cast<int>(joints_.size()); }
  const std::vector<ChainJointView>& joints() const { return joints_; }
  /// For kernels; valid as long as this, or what this is moved to, lives.
  ChainView view() const;

  /// Position of the frame's origin in the base frame, m.
  Vec3 position(const Values& q) const;

  /// Origins and axes of the joints, and the frame's origin, in the base frame for q.
  struct Skeleton {
    std::vector<Vec3> origin, axis;
    Vec3 tip;
  };
  Skeleton skeleton(const Values& q) const;

  /// The chain's part of a vector over q (for example of a State).
  Values select(const Eigen::VectorXd& q) const;

 private:
  std::vector<ChainJointView> joints_;
  std::vector<int> q_;        // row in q of each joint
  Vec3 p_BF_ = Vec3::Zero();  // the frame's origin in the last joint's frame
};

}  // namespace graze
