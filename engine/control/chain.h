#pragma once
// A leg or arm as a serial chain: forward kinematics and Jacobian of one frame of the nominal model relative to the
// base, without touching the heap, for controllers that run every control step.

#include "engine/model/model.h"

namespace graze {

class Chain {
 public:
  static constexpr int kMaxJoints = 12;
  using Values = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxJoints, kMaxJoints>;
  using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxJoints>;

  struct Joint {
    Pose X_PB = Pose::Identity();  // joint frame in its parent at zero
    Vec3 axis = Vec3::UnitX();     // unit, in the joint frame
    bool prismatic = false;
    double lower = 0, upper = 0;  // rad or m
    int actuator = -1;            // row in na-sized arrays
    int q = 0;                    // row in q
    double mass = 0;              // of the body that the joint moves, kg
    Vec3 com = Vec3::Zero();      // its centre of mass in the joint frame, m
    Mat3 inertia = Mat3::Zero();  // about com, axes of the joint frame, kg m^2
  };

  /// From the base (body 0 of a floating base, else the world) to `frame`, an index into Model::frames. Throws
  /// std::invalid_argument with a sentence if the frame is fixed to the base, a joint on the way is not actuated, or
  /// there are more than kMaxJoints.
  Chain(const Model& model, int frame);

  int size() const { return static_cast<int>(joints_.size()); }
  const std::vector<Joint>& joints() const { return joints_; }

  /// Position of the frame's origin in the base frame, m.
  Vec3 position(const Values& q) const;
  /// The same with J = d position / d q, 3 x size(), base axes.
  Vec3 position(const Values& q, Jacobian& J) const;

  /// Joint-space inertia of the chain's bodies with the base held still, size() x size().
  Matrix inertia(const Values& q) const;

  /// Origins and axes of the joints, and the frame's origin, in the base frame for q.
  struct Skeleton {
    std::vector<Vec3> origin, axis;
    Vec3 tip;
  };
  Skeleton skeleton(const Values& q) const;

  /// The chain's part of a vector over q (for example of a State).
  Values select(const Eigen::VectorXd& q) const;

 private:
  std::vector<Joint> joints_;
  Vec3 p_BF_ = Vec3::Zero();  // the frame's origin in the last joint's frame
};

}  // namespace graze
