#pragma once
// How well a step keeps the laws of contact, measured in the same way for every back end: from the state before and
// after the step and the impulses that it reports, and from nothing that its solver says about itself.
//
// For a ball against a plane, with gap phi and Jacobian J at the configuration before the step (all back ends here are
// time-stepping schemes of that kind), v the velocity after it, lambda the reported impulse, u = J v, and
//   w = u_n + max(phi, 0) / h        (a gap may close and no more; overlap, which back ends take back at their own
//                                     pace, counts as touching)
//   approach         max(0, -w)                                     m/s   Signorini: no penetration
//   complementarity  lambda_n |w|                                   mJ    Signorini: a force only where it touches
//   cone             max(0, |lambda_t| - mu lambda_n)               mN s  Coulomb
//   dissipation      |u_t| + lambda_t . u_t / (mu lambda_n)         m/s   maximum dissipation: 0 if the point sticks,
//   or
//                    slides against a friction force on the cone's edge; |u_t| if friction does nothing against
//                    sliding; 2 |u_t| if it drives it
// A contact counts where it touches: lambda_n > 0, or w < 0.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/block_physics.h"
#include "engine/dynamics/dynamics_model.h"

namespace graze::bench {

struct Residual {
  static constexpr std::array<const char*, 4> kNames = {"approach", "complementarity", "cone", "dissipation"};
  std::array<double, 4> sum{}, most{};
  double depth = 0;  // deepest overlap, m
  long contacts = 0;

  void add(const std::array<double, 4>& value) {
    for (int i = 0; i < 4; ++i) sum[i] += value[i], most[i] = std::max(most[i], value[i]);
    ++contacts;
  }
  double mean(int i) const { return contacts > 0 ? sum[i] / static_cast<double>(contacts) : 0; }
};

/// Measures one lane. The model's balls against planes that are fixed to the world; other contacts do not count.
class ResidualMeter {
 public:
  explicit ResidualMeter(const Model& model) : model_(model), robot_(model_), data_(robot_) {
    for (const ColliderPair& pair : model_.pairs) {
      const Collider &a = model_.colliders[pair.a], &b = model_.colliders[pair.b];
      if (a.shape.kind == ShapeKind::sphere && b.shape.kind == ShapeKind::plane) pairs_.push_back(pair);
    }
  }

  void before(const BlockPhysics& physics, int lane) { q_ = physics.state().q.column(lane); }

  void after(const BlockPhysics& physics, int lane, double h, Residual& out) {
    const Eigen::VectorXd v = physics.state().v.column(lane);
    update_poses(data_.tree(), q_.data());
    update_velocities(data_.tree(), v.data());
    const std::vector<Contact> contacts = physics.contacts(lane);
    for (const ColliderPair& pair : pairs_) {
      Vec3 impulse = Vec3::Zero();
      for (const Contact& contact : contacts) {
        if (contact.a == pair.a && contact.b == pair.b) impulse += contact.impulse_W;
      }
      measure(pair, impulse, h, out);
    }
  }

 private:
  void measure(const ColliderPair& pair, const Vec3& impulse, double h, Residual& out) const {
    const Collider &ball = model_.colliders[pair.a], &plane = model_.colliders[pair.b];
    const Vec3 n = plane.X_BG.linear().col(2);
    const Vec3 centre = to_eigen(data_.tree().pose[ball.body]) * ball.X_BG.translation();
    const double radius = ball.shape.size.x(), phi = n.dot(centre - plane.X_BG.translation()) - radius;
    const Vec3 p = centre - (radius + 0.5 * phi) * n,
               u = to_eigen(point_velocity(data_.tree(), ball.body, to_kernel(p)));
    const double un = n.dot(u), normal = n.dot(impulse), w = un + std::max(phi, 0.0) / h;
    if (normal <= 0 && w >= 0) return;
    const Vec3 ut = u - un * n, tangent = impulse - normal * n;
    const double limit = pair.friction * normal;
    const double dissipation = limit > 0 ? ut.norm() + tangent.dot(ut) / std::max(limit, tangent.norm()) : 0;
    out.add({std::max(0.0, -w), 1e3 * normal * std::abs(w), 1e3 * std::max(0.0, tangent.norm() - limit), dissipation});
    out.depth = std::max(out.depth, -phi);
  }

  Model model_;
  std::vector<ColliderPair> pairs_;
  Eigen::VectorXd q_;
  DynamicsModel robot_;
  DynamicsData<double> data_;
};

}  // namespace graze::bench
