#pragma once
// The compiled world: fixed joints merged, everything numbered. Immutable while a trace runs. All particles of a
// campaign have the same numbering (tree, colliders, pairs) and differ only in numbers.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "engine/model/world.h"

namespace graze {

/// One moving rigid body. Body frame = joint frame; parents come before children.
struct Body {
  std::string name;                      // link whose joint moves it (or object)
  std::string joint;                     // joint name; empty for a floating base
  int parent = -1;                       // body index; -1: the world
  JointType type = JointType::floating;  // revolute, prismatic or floating
  Pose X_PB = Pose::Identity();          // body frame in the parent body's (or world's) frame at q = 0
  Vec3 axis = Vec3::UnitX();             // unit, in the body frame
  double mass = 0;                       // kg
  Vec3 com = Vec3::Zero();               // in the body frame, m
  Mat3 inertia = Mat3::Zero();           // about com, body axes, kg m^2
  int q = 0, v = 0;                      // first index in q and v
  int mimics = -1;                       // body whose joint this one's follows, and which follows none; -1: it is free
  double multiplier = 1, offset = 0;     // then q = multiplier q_other + offset; offset in rad or m
  double lower, upper, effort, velocity, damping, friction;  // as Joint
  double armature = 0;  // Joint::armature(): in M only, neither in the momentum nor in the gyroscopic forces
};

/// A collision shape on a body, or on the world (body == -1).
struct Collider {
  std::string name;  // part name: "LF_FOOT", "curb"
  std::string link;  // link or object it belongs to
  int body = -1;
  Shape shape;
  Pose X_BG = Pose::Identity();  // in the body frame (world frame if body == -1)
  bool is_object = false;
};

/// Two colliders that may touch, with their coefficients. a < b.
struct ColliderPair {
  int a, b;
  double friction, restitution;
  Spring spring = {};  // as given; NaN: as default_spring() of moving_mass()
};

/// A named frame: every link of the robot, also those merged into another body.
struct Frame {
  std::string name;
  int body = -1;
  Pose X_BF = Pose::Identity();
};

struct Model {
  std::vector<Body> bodies;
  std::vector<Collider> colliders;
  std::vector<ColliderPair> pairs;  // lexicographic order
  std::vector<Frame> frames;
  std::vector<int> actuated;  // bodies with a driven joint, in order; actuator k drives v[bodies[actuated[k]].v].
                              // Joints that follow others have none
  Vec3 gravity = {0, 0, -9.81};
  std::string contact_model;  // one of the back end's models; empty: its first
  ContactSolver contact_solver = ContactSolver::automatic;
  int nq = 0;  // floating: quaternion (w x y z) then position (x y z); other joints one each
  int nv = 0;  // floating: angular velocity then velocity of the body origin, both in world axes; other joints one each
  bool floating_base = true;  // then body 0 is the base

  int frame(const std::string& name) const;     // index, or -1
  int collider(const std::string& name) const;  // index, or -1
  int joint(const std::string& name) const;     // body index, or -1
  int na() const { return static_cast<int>(actuated.size()); }
};

/// Generalised position and velocity of all bodies (see Model::nq, nv).
struct State {
  Eigen::VectorXd q, v;
};

/// Throws InputError that names the link when a moving body has no mass or an inertia that breaks the triangle
/// inequality.
Model compile(const World& world);

/// A point mass (kg) at p_B (body frame, m) becomes part of a body: its mass, centre of mass and inertia.
void add_point_mass(Body& body, const Vec3& p_B, double mass);

/// Of all bodies, kg.
double moving_mass(const Model& model);

/// Index of the contact model `name` in `models`, those of `back_end`; empty: the first. Throws InputError that names
/// the model, the back end and what it has.
std::size_t contact_model_index(const std::string& name, const std::string& back_end,
                                const std::vector<std::string>& models);

/// World::initial as a state of `model`, `on_ground` resolved by kinematics; movable objects at their poses.
State initial_state(const World& world, const Model& model);

}  // namespace graze
