#pragma once
// Joint-space inertia of one limb (all joints that hang together without the base), with the base held still. The
// actuators need it to integrate their dampers implicitly.

#include <vector>

#include "engine/model/model.h"

namespace graze {

class LimbInertia {
 public:
  /// One moving body of the limb and the joint that carries it.
  struct Link {
    int parent = -1;  // index into links(), -1: the base
    int actuator = 0, q = 0;
    bool prismatic = false;
    Pose X_PB = Pose::Identity();
    Vec3 axis = Vec3::UnitX(), com = Vec3::Zero();  // in the body frame
    double mass = 0;
    Mat3 inertia = Mat3::Zero();  // about com, body axes
  };

  const std::vector<Link>& links() const { return links_; }
  /// M for the joint positions of links(), size n x n. `M` keeps its memory from call to call.
  void evaluate(const Eigen::VectorXd& q, Eigen::MatrixXd& M);

 private:
  friend std::vector<LimbInertia> limbs_of(const Model& model);
  std::vector<Link> links_;
  // Scratch, per link: orientation and origin in the base frame, axis, and the composite body's inertia (Featherstone's
  // composite rigid bodies, about the base's origin): mass, first moment, rotational inertia.
  struct Moving {
    Mat3 R;
    Vec3 p, axis;
    double mass;
    Vec3 moment;
    Mat3 inertia;
  };
  std::vector<Moving> moving_;
};

/// The limbs of a robot, by their first actuator.
std::vector<LimbInertia> limbs_of(const Model& model);

}  // namespace graze
