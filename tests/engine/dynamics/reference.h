#pragma once
// An independent way to the equation of motion: sums of J^T (mass) J over bodies, with J from the scalar kinematics of
// the model folder and its time derivative by differences. Slow, short, and sharing no code with the lane kernels.

#include <Eigen/Dense>

#include "engine/lane_physics/lane_engine.h"
#include "engine/lanes/isa.h"
#include "engine/model/kinematics.h"
#include "engine/model/urdf.h"

namespace graze::testing {

struct BodyJacobian {
  Eigen::Matrix3Xd linear, angular;  // of the centre of mass; world axes
  Mat3 inertia_W;
};

inline BodyJacobian body_jacobian(const Model& model, const Eigen::VectorXd& q, int body) {
  std::vector<Pose> X;
  forward_kinematics(model, q, X);
  const Body& b = model.bodies[body];
  const Vec3 com = X[body] * b.com;
  BodyJacobian out;
  out.linear = point_jacobian(model, X, body, com);
  // w x e_k from the velocities of points at unit distance.
  const Eigen::Matrix3Xd x = point_jacobian(model, X, body, com + Vec3::UnitX()) - out.linear;
  const Eigen::Matrix3Xd y = point_jacobian(model, X, body, com + Vec3::UnitY()) - out.linear;
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
  }
  return M;
}

/// q moved by v for time t (exactly, for constant v).
inline Eigen::VectorXd moved(const Model& model, Eigen::VectorXd q, const Eigen::VectorXd& v, double t) {
  for (const Body& body : model.bodies) {
    if (body.type != JointType::floating) {
      q[body.q] += t * v[body.v];
      continue;
    }
    const Vec3 w = v.segment<3>(body.v);
    const Quat before(q[body.q], q[body.q + 1], q[body.q + 2], q[body.q + 3]);
    const double angle = w.norm() * t;
    const Quat turn = w.norm() > 0 ? Quat(Eigen::AngleAxisd(angle, w.normalized())) : Quat::Identity();
    const Quat after = turn * before;
    q.segment<7>(body.q) << after.w(), after.x(), after.y(), after.z(),
        Vec3(q.segment<3>(body.q + 4) + t * v.segment<3>(body.v + 3));
  }
  return q;
}

/// bias of M v' + bias = tau: sum of J_c^T m (J_c' v - g) + J_w^T (I J_w' v + w x I w).
inline Eigen::VectorXd reference_bias(const Model& model, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  // Central differences: truncation ~ e^2, rounding ~ 1e-16 / e, so about 1e-10 of the velocity products.
  const double e = 1e-5;
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(model.nv);
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const int body = static_cast<int>(i);
    const BodyJacobian J = body_jacobian(model, q, body);
    const BodyJacobian after = body_jacobian(model, moved(model, q, v, e), body);
    const BodyJacobian before = body_jacobian(model, moved(model, q, v, -e), body);
    const Vec3 linear = (after.linear - before.linear) * v / (2 * e), w = J.angular * v;
    const Vec3 angular = (after.angular - before.angular) * v / (2 * e);
    bias += model.bodies[i].mass * J.linear.transpose() * (linear - model.gravity) +
            J.angular.transpose() * (J.inertia_W * angular + w.cross(J.inertia_W * w));
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
