#include "engine/contact/reference_contact.h"

#include <cassert>
#include <cmath>
#include <numbers>

#include "engine/lanes/scalar.h"

namespace graze {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

/// Unit tangent of edge k of `edges`.
Vector2d edge_direction(int k, int edges) {
  const double angle = 2 * std::numbers::pi * k / edges;
  return {pinned::cos(angle), pinned::sin(angle)};
}

/// F: impulses (3 per contact) of unit z; columns f_N, then f_F.
MatrixXd generators(int contacts, int edges) {
  MatrixXd out = MatrixXd::Zero(3 * contacts, contacts * (1 + edges));
  for (int i = 0; i < contacts; ++i) {
    out(3 * i, i) = 1;
    for (int k = 0; k < edges; ++k) {
      out.block<2, 1>(3 * i + 1, contacts + i * edges + k) = edge_direction(k, edges);
    }
  }
  return out;
}

Vector2d onto_disc(const Vector2d& x, double radius) {
  const double length = x.norm();
  return length <= radius ? x : Vector2d(x * (radius / length));
}

}  // namespace

ContactProblem make_contact_problem(const MatrixXd& J, const MatrixXd& mass, const VectorXd& v_free,
                                    const VectorXd& phi, double h, const VectorXd& mu) {
  assert(J.rows() == 3 * mu.size() && phi.size() == mu.size());
  ContactProblem out;
  if (J.rows() > 0) out.A = J * mass.llt().solve(J.transpose());  // Eigen binds a null pointer to solve for no columns
  out.b = J * v_free;
  for (int i = 0; i < phi.size(); ++i) out.b[3 * i] += phi[i] / h;
  out.mu = mu;
  return out;
}

ContactLcp contact_lcp(const ContactProblem& problem, int edges) {
  const int n = problem.contacts(), forces = n * (1 + edges), size = forces + n;
  const MatrixXd G = generators(n, edges);
  ContactLcp out{MatrixXd::Zero(size, size), VectorXd::Zero(size), edges};
  out.M.topLeftCorner(forces, forces) = G.transpose() * problem.A * G;
  out.q.head(forces) = G.transpose() * problem.b;
  for (int i = 0; i < n; ++i) {
    out.M(forces + i, i) = problem.mu[i];
    for (int k = 0; k < edges; ++k) {
      const int f = n + i * edges + k;
      out.M(f, forces + i) = 1;   // E of Eq. 86
      out.M(forces + i, f) = -1;  // -E^T of Eq. 87
    }
  }
  return out;
}

VectorXd ContactLcp::impulses(const VectorXd& z) const {
  const int contacts = static_cast<int>(z.size()) / (edges + 2);
  return generators(contacts, edges) * z.head(contacts * (1 + edges));
}

ContactResiduals contact_residuals(const MatrixXd& A, const VectorXd& b, const VectorXd& mu, const VectorXd& lambda) {
  const VectorXd u = A * lambda + b;
  ContactResiduals out;
  for (int i = 0; i < mu.size(); ++i) {
    const double normal = lambda[3 * i], a_n = A(3 * i, 3 * i);
    const double a_t = 0.5 * (A(3 * i + 1, 3 * i + 1) + A(3 * i + 2, 3 * i + 2));
    const Vector2d tangent = lambda.segment<2>(3 * i + 1), slip = u.segment<2>(3 * i + 1);
    const double radius = mu[i] * std::max(normal, 0.0);
    out.signorini = std::max(out.signorini, a_n * std::abs(normal - std::max(normal - u[3 * i] / a_n, 0.0)));
    out.coulomb = std::max(out.coulomb, a_t * std::max(tangent.norm() - radius, 0.0));
    const Vector2d best = onto_disc(tangent - slip / a_t, radius);
    out.dissipation = std::max(out.dissipation, a_t * (tangent - best).norm());
  }
  return out;
}

}  // namespace graze
