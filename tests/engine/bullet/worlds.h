#pragma once
// Small worlds for physics tests, built by hand through World and compile(), and a one-lane runner.

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/physics.h"

namespace graze::test {

inline constexpr double kGravity = 9.81;  // m/s^2

inline Shape box(double x, double y, double z) { return {ShapeKind::box, {x, y, z}, nullptr, nullptr}; }
inline Shape sphere(double r) { return {ShapeKind::sphere, {r, 0, 0}, nullptr, nullptr}; }
inline Shape cylinder(double r, double l) { return {ShapeKind::cylinder, {r, l, 0}, nullptr, nullptr}; }
inline Shape capsule(double r, double l) { return {ShapeKind::capsule, {r, l, 0}, nullptr, nullptr}; }
inline Shape plane() { return {ShapeKind::plane, {0, 0, 0}, nullptr, nullptr}; }

inline Pose at(double x, double y, double z, const Mat3& R = Mat3::Identity()) {
  Pose X = Pose::Identity();
  X.linear() = R;
  X.translation() = Vec3(x, y, z);
  return X;
}
inline Mat3 turn(double angle, const Vec3& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).matrix(); }

/// A link of one homogeneous shape whose frame lies at X_LG^-1 from the shape.
inline Link link(const std::string& name, const Shape& shape, double mass, const Pose& X_LG = Pose::Identity(),
                 bool collides = true) {
  Link out;
  out.name = name;
  out.inertia = MassMoments::of_shape(shape, mass / shape.volume()).transformed(X_LG.linear(), X_LG.translation());
  if (collides) out.collisions.push_back({name, shape, X_LG});
  return out;
}

inline Joint joint(const std::string& name, const std::string& parent, const std::string& child, JointType type,
                   const Pose& X_PJ, const Vec3& axis) {
  Joint out;
  out.name = name;
  out.parent = parent;
  out.child = child;
  out.type = type;
  out.X_PJ = X_PJ;
  out.axis = axis;
  return out;
}

inline Object fixed(const std::string& name, const Shape& shape, const Pose& X_WO = Pose::Identity()) {
  Object out;
  out.name = name;
  out.shape = shape;
  out.X_WO = X_WO;
  return out;
}

inline Object movable(const std::string& name, const Shape& shape, double mass, const Pose& X_WO) {
  Object out = fixed(name, shape, X_WO);
  out.movable = true;
  out.inertia = MassMoments::of_shape(shape, mass / shape.volume());
  return out;
}

/// A robot of one free body, with its origin at the centre of its shape, in an otherwise empty world.
inline World free_body(const Shape& shape, double mass) {
  World world;
  world.robot.name = "body";
  world.robot.links.push_back(link("body", shape, mass));
  return world;
}

/// A floating chain of `joints` hinges, 6 cm apart, with axes across each other in turn; a sphere of 2 cm and 70 g per
/// link. It lies limp on the ground.
inline World lying_chain(int joints) {
  const Shape bead = sphere(0.02);
  World world = free_body(bead, 0.07);
  world.objects.push_back(fixed("ground", plane()));
  for (int i = 1; i <= joints; ++i) {
    const std::string name = "bead" + std::to_string(i), parent = i > 1 ? "bead" + std::to_string(i - 1) : "body";
    world.robot.links.push_back(link(name, bead, 0.07, at(0.06, 0, 0)));
    world.robot.joints.push_back(joint("j" + std::to_string(i), parent, name, JointType::revolute,
                                       at(i > 1 ? 0.06 : 0, 0, 0), i % 2 ? Vec3::UnitY() : Vec3::UnitZ()));
    world.robot.joints.back().damping = 1e-3;
  }
  world.contact.self_collision = false;
  world.initial.on_ground = true;
  return world;
}

inline Particle particle_of(const World& world) {
  Particle particle;
  particle.model = compile(world);
  particle.initial = initial_state(world, particle.model);
  return particle;
}

/// One particle in one lane of a back end.
class Bench {
 public:
  Bench(const std::string& physics, const World& world) : Bench(physics, particle_of(world)) {}
  Bench(const std::string& physics, Particle particle, int lane = 0)
      : particle_(std::move(particle)),
        physics_(make_physics(physics, particle_.model)),
        tau(particle_.model.na()),
        lane_(lane) {
    physics_->start(lane, particle_);
  }

  void step(double h) {
    LaneMask mask;
    mask.set(lane_);
    physics_->step(h, mask, tau);
  }
  /// Steps for `seconds`; `each` is called after every step.
  void run(double seconds, double h, const std::function<void()>& each = {}) {
    for (long k = std::lround(seconds / h); k > 0; --k) {
      step(h);
      if (each) each();
    }
  }

  const Model& model() const { return particle_.model; }
  BlockPhysics& physics() { return *physics_; }
  double q(int i) const { return physics_->state().q(i, lane_); }
  double v(int i) const { return physics_->state().v(i, lane_); }
  Eigen::VectorXd q() const { return physics_->state().q.column(lane_); }
  Eigen::VectorXd v() const { return physics_->state().v.column(lane_); }
  Vec3 position(int body) const { return physics_->state().position(body, lane_); }
  Mat3 rotation(int body) const { return physics_->state().rotation(body, lane_); }
  std::vector<Contact> contacts() const { return physics_->contacts(lane_); }
  std::string fault() const { return physics_->fault(lane_).value_or(""); }
  Vec3 contact_impulse() const {  // on the first collider of each pair
    Vec3 sum = Vec3::Zero();
    for (const Contact& c : contacts()) sum += c.impulse_W;
    return sum;
  }

 private:
  Particle particle_;
  std::unique_ptr<BlockPhysics> physics_;

 public:
  BlockArray tau;

 private:
  int lane_;
};

}  // namespace graze::test
