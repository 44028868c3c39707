#pragma once
// Random contact problems, for solvers to be measured against each other.

#include <random>

#include "tests/engine/contact/lane_problem.h"

namespace graze::test {

inline ContactLawT<double> contact_law(bool convex) {
  ContactLawT<double> out{};
  out.convex = convex ? 1 : 0;
  return out;
}

/// Drawn from a seed.
class RandomProblems {
 public:
  explicit RandomProblems(unsigned seed) : generator_(seed) {}
  double normal() { return std::normal_distribution()(generator_); }
  Eigen::VectorXd vector(int n) {
    return Eigen::VectorXd::NullaryExpr(n, [&] { return normal(); });
  }
  /// A with eigenvalues from 1 to at most about 50: Gram matrix of as many random directions as twice its size.
  ContactProblem regular(int contacts, double mu) {
    const int n = 3 * contacts;
    const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(n, 2 * n, [&] { return normal(); });
    ContactProblem out;
    out.A = B * B.transpose() / n + Eigen::MatrixXd::Identity(n, n);
    out.b = vector(n);
    out.mu = Eigen::VectorXd::Constant(contacts, mu);
    return out;
  }
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }

  /// Points in the plane under one free body of mass `mass` and box-like inertia: A of rank 6 however many there are.
  /// It falls at up to 1 m/s, turns and slides.
  ContactProblem table(int contacts, double mass, double mu) {
    Eigen::MatrixXd J(3 * contacts, 6);
    for (int i = 0; i < contacts; ++i) {
      const Eigen::Vector3d r{between(-1, 1), between(-1, 1), -0.3};
      Eigen::Matrix3d turn;
      turn << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
      Eigen::Matrix<double, 3, 6> rows;
      rows << turn, Eigen::Matrix3d::Identity();
      J.middleRows<3>(3 * i) << rows.row(2), rows.row(0), rows.row(1);  // normal first
    }
    Eigen::Matrix<double, 6, 1> inertia, v;
    inertia << mass * 0.3, mass * 0.4, mass * 0.6, mass, mass, mass;
    for (int k = 0; k < 6; ++k) v[k] = between(-1, 1);
    v[5] = between(-1, -0.1);
    ContactProblem out;
    out.A = J * inertia.cwiseInverse().asDiagonal() * J.transpose();
    out.b = J * v;
    out.mu = Eigen::VectorXd::Constant(contacts, mu);
    return out;
  }

 private:
  std::mt19937 generator_;
};

}  // namespace graze::test
