#pragma once
// Bodies of a Model as btMultiBody trees, and their state in the Model's convention. Bullet wants every body's frame C
// at its centre of mass along its principal axes; a Model's body frame B is the joint frame. The constant X_BC of each
// body converts exactly both ways.

#include <BulletDynamics/Featherstone/btMultiBody.h>

#include <memory>
#include <vector>

#include "engine/model/model.h"

namespace graze::bullet {

/// Motion of a body: angular velocity and velocity of its origin, world axes.
struct Twist {
  Vec3 angular = Vec3::Zero(), linear = Vec3::Zero();
  Vec3 at(const Vec3& offset) const { return linear + angular.cross(offset); }  // offset from the origin, world axes
};

/// One tree: a floating body with all that hangs on it, or everything that hangs on the world.
struct Tree {
  struct Damper {
    int row;         // in Bullet's velocity vector
    double damping;  // N m s/rad or N s/m
  };
  std::unique_ptr<btMultiBody> body;
  int base = -1;           // Model body that floats; -1: fixed to the world
  std::vector<int> links;  // Model body of each Bullet link
  std::vector<Damper> damped;
};

/// All trees of a model with one state.
class Forest {
 public:
  Forest(const Model& model, const State& initial);

  std::vector<Tree>& trees() { return trees_; }
  /// Where a Model body is: tree, and link in it (-1: its base).
  btMultiBody* multibody(int body) const { return trees_[place_[body].tree].body.get(); }
  int link(int body) const { return place_[body].link; }

  /// Bullet's own state of each tree: base rotation (world to base, x y z w) and position, velocities, joint positions.
  using Raw = std::vector<std::vector<double>>;
  Raw raw() const;
  /// Takes over every bit of it.
  void restore(const Raw& raw);

  /// Refreshes poses and twists from Bullet's state.
  void refresh();
  /// Refreshes twists only: Bullet's velocities at the poses of the last refresh().
  void refresh_twists();
  const Pose& pose(int body) const { return X_WB_[body]; }
  const Twist& twist(int body) const { return twist_[body]; }
  /// Bullet's frame of a body in the body frame, X_BC.
  const Pose& principal(int body) const { return X_BC_[body]; }
  /// q and v of the whole model, see Model; valid after refresh().
  const Eigen::VectorXd& q() const { return q_; }
  const Eigen::VectorXd& v() const { return v_; }

  /// Adds gravity and joint forces (indexed by v) for the next step; clears the old ones.
  void set_forces(const Eigen::VectorXd& joint_force);
  /// Adds a force (N, world axes) on a body at p_B (body frame, m) to those of set_forces().
  void add_force(int body, const Vec3& p_B, const Vec3& force);
  /// Velocities change by h times the acceleration of the unconstrained, undamped motion.
  void accelerate(double h);
  /// Viscous joint damping, implicit in all joint velocities of a tree together: with A = the damped joints' block of
  /// M^-1, the impulses p = -h D v+ solve (A + 1/(h D)) p = -v, so that no stiffness of D can make it overshoot.
  void damp(double h);
  /// Takes over what the solver added to the velocities.
  void apply_impulses();
  /// Positions move by h times the velocities.
  void move(double h);

 private:
  struct Place {
    int tree = -1, link = -1;
  };
  void place_bodies();
  void build(Tree& tree);
  void setup_link(btMultiBody& multibody, int link, int body);
  void write_state(const State& state);
  void read_pose(int body);
  void read_twist(int body);

  const Model& model_;
  std::vector<Tree> trees_;
  std::vector<Place> place_;                  // per body
  std::vector<Pose> X_BC_;                    // per body
  std::vector<Quat> q_BC_;                    // per body, rotation of X_BC
  std::vector<Vec3> principal_inertia_;       // per body, along the axes of C, kg m^2
  std::vector<Pose> X_WB_;                    // per body
  std::vector<Twist> twist_;                  // per body
  Eigen::VectorXd q_, v_;                     // nq, nv
  btAlignedObjectArray<btScalar> scratch_r_;  // Bullet's own scratch memory
  btAlignedObjectArray<btVector3> scratch_v_;
  btAlignedObjectArray<btMatrix3x3> scratch_m_;
  btAlignedObjectArray<btQuaternion> scratch_q_;
  Eigen::VectorXd unit_impulse_;  // generalised impulse of one joint
  Eigen::MatrixXd response_;      // velocity change per unit impulse of each damped joint
};

}  // namespace graze::bullet
