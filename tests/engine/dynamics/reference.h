#pragma once
// An independent way to the equation of motion: sums of J^T (mass) J over bodies, and Kane's
// equations with classical accelerations, of poses and Jacobians by Eigen. Slow, short, exact but for rounding, and
// sharing no code with engine/dynamics.

#include <Eigen/Dense>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"
#include "engine/model/urdf.h"
#include "tests/reference_kinematics.h"

namespace graze::testing {

struct BodyJacobian {
  Eigen::Matrix3Xd linear, angular;  // of the centre of mass; world axes
  Mat3 inertia_W;
};

inline BodyJacobian body_jacobian(const Model& model, const Eigen::VectorXd& q, int body) {
  const std::vector<Pose> X = reference_poses(model, q);
  const Body& b = model.bodies[body];
  const Vec3 com = X[body] * b.com;
  BodyJacobian out;
  out.linear = reference_jacobian(model, X, body, com);
  // w x e_k from the velocities of points at unit distance.
  const Eigen::Matrix3Xd x = reference_jacobian(model, X, body, com + Vec3::UnitX()) - out.linear;
  const Eigen::Matrix3Xd y = reference_jacobian(model, X, body, com + Vec3::UnitY()) - out.linear;
  out.angular.resize(3, model.nv);
  out.angular.row(0) = y.row(2);
  out.angular.row(1) = -x.row(2);
  out.angular.row(2) = x.row(1);
  out.inertia_W = X[body].linear() * b.inertia * X[body].linear().transpose();
  return out;
}

inline Eigen::MatrixXd reference_mass_matrix(const Model& model, const Eigen::VectorXd& q) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(model.nv, model.nv);
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const BodyJacobian J = body_jacobian(model, q, static_cast<int>(i));
    M += model.bodies[i].mass * J.linear.transpose() * J.linear + J.angular.transpose() * J.inertia_W * J.angular;
    if (model.bodies[i].type != JointType::floating)
      M(model.bodies[i].v, model.bodies[i].v) += model.bodies[i].armature;
  }
  return M;
}

/// Velocity of a body's frame, and the part of its acceleration that does not come from v'.
struct BodyMotion {
  Vec3 w = Vec3::Zero(), alpha = Vec3::Zero();  // rad/s, rad/s^2; world axes
  Vec3 a = Vec3::Zero();                        // of the body's origin, m/s^2
};

/// One body further out: the classical rules for points and axes that move (Craig, Introduction to Robotics, §6.4).
inline BodyMotion next_motion(const Body& body, const BodyMotion& parent, const Vec3& r, const Vec3& axis_W,
                              const double* v) {
  if (body.type == JointType::floating) return {Eigen::Map<const Vec3>(v), Vec3::Zero(), Vec3::Zero()};
  BodyMotion m = parent;
  m.a += parent.alpha.cross(r) + parent.w.cross(parent.w.cross(r));
  if (body.type == JointType::revolute) {
    m.alpha += parent.w.cross(axis_W * *v);
    m.w += axis_W * *v;
  } else {
    m.a += 2 * parent.w.cross(axis_W * *v);
  }
  return m;
}

/// bias of M v' + bias = tau by Kane's equations: sum of J_c^T m (a_c - g) + J_w^T (I alpha + w x I w).
inline Eigen::VectorXd reference_bias(const Model& model, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  const std::vector<Pose> X = reference_poses(model, q);
  std::vector<BodyMotion> motion(model.bodies.size());
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(model.nv);
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const bool rooted = body.parent < 0;
    const Vec3 r = rooted ? Vec3(Vec3::Zero()) : Vec3(X[i].translation() - X[body.parent].translation());
    const BodyMotion m = motion[i] =
        next_motion(body, rooted ? BodyMotion{} : motion[body.parent], r, X[i].linear() * body.axis, v.data() + body.v);
    const Vec3 lever = X[i].linear() * body.com;
    const Vec3 a = m.a + m.alpha.cross(lever) + m.w.cross(m.w.cross(lever));
    const BodyJacobian J = body_jacobian(model, q, static_cast<int>(i));
    bias += body.mass * J.linear.transpose() * (a - model.gravity) +
            J.angular.transpose() * (J.inertia_W * m.alpha + m.w.cross(J.inertia_W * m.w));
  }
  return bias;
}

/// One particle in a scalar engine.
struct ScalarEngine {
  Model model;
  std::vector<double> q, v, a, X;
  LaneEngine engine;

  explicit ScalarEngine(const Model& m)
      : model(m),
        q(m.nq),
        v(m.nv),
        a(m.nv),
        X(12 * m.bodies.size()),
        engine(m, kernel_of(Isa::portable, 1), {q.data(), v.data(), a.data(), X.data()}) {}

  void start(const State& state) { engine.start(0, model, state); }

  Eigen::MatrixXd mass_matrix() const {
    const LaneBlock& b = engine.block();
    const TopologyView& t = b.topology;
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(t.nv, t.nv);
    for (int i = 0; i < t.nv; ++i) {
      for (int d = 0; d <= t.dof_depth[i]; ++d) {
        const int j = t.chain[t.row[i] + d];
        M(i, j) = M(j, i) = b.M[t.row[i] + d];
      }
    }
    return M;
  }
  Eigen::VectorXd bias() const { return Eigen::Map<const Eigen::VectorXd>(engine.block().bias, model.nv); }
};

/// A state with every coordinate somewhere in its range, from a fixed sequence.
inline State random_state(const Model& model, unsigned seed) {
  std::srand(seed);
  State state{Eigen::VectorXd::Random(model.nq), 3 * Eigen::VectorXd::Random(model.nv)};
  for (const Body& body : model.bodies) {
    if (body.type == JointType::floating) {
      state.q.segment<4>(body.q).normalize();
    } else if (std::isfinite(body.lower) && std::isfinite(body.upper)) {
      state.q[body.q] = body.lower + (body.upper - body.lower) * 0.5 * (1 + state.q[body.q]);
    }
  }
  return state;
}

}  // namespace graze::testing
