#include "engine/control/contact_pivoting.h"

#include <algorithm>
#include <cmath>

#include "engine/contact/lcp.h"
#include "engine/dynamics/factor.h"

namespace graze {

namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr int kEdges = 4;  // of the friction pyramid, as published
/// A tangent whose part that is independent of those before is less than this share of it counts as dependent.
constexpr double kIndependent = 1e-9;

/// Algorithm 3: rows of the tangents (in the numbering of J) on which forces can be told apart, found by a Cholesky
/// factorisation that grows row by row; no more than there are free velocities.
std::vector<int> independent_tangents(const MatrixXd& W, Eigen::Index velocities) {
  std::vector<int> rows;
  MatrixXd L(velocities, velocities);
  for (int i = 0; i < W.rows() && static_cast<Eigen::Index>(rows.size()) < velocities; ++i) {
    if (i % 3 == 0) continue;  // a normal
    const int n = static_cast<int>(rows.size());
    VectorXd a(n);
    for (int k = 0; k < n; ++k) a[k] = W(i, rows[k]);
    const VectorXd l = L.topLeftCorner(n, n).triangularView<Eigen::Lower>().solve(a);
    const double rest = W(i, i) - l.squaredNorm();
    if (!(rest > kIndependent * W(i, i))) continue;
    L.row(n).head(n) = l.transpose();
    L(n, n) = std::sqrt(rest);
    rows.push_back(i);
  }
  return rows;
}

bool is_solution(const LcpSolution& solution) { return solution.solved && solution.z.allFinite(); }

}  // namespace

VectorXd pivot_coulomb(const BaseContacts& contacts, const VectorXd* closest) {
  const int n = static_cast<int>(contacts.friction.size()), f = n, e = n + kEdges * n, size = e + n;
  // Directions of the impulses: normals, then the edges s, -s, t, -t of each contact.
  MatrixXd D = MatrixXd::Zero(3 * n, e);
  for (int i = 0; i < n; ++i) {
    D(3 * i, i) = 1;
    const int at = f + kEdges * i;
    D(3 * i + 1, at) = 1, D(3 * i + 1, at + 1) = -1, D(3 * i + 2, at + 2) = 1, D(3 * i + 2, at + 3) = -1;
  }
  MatrixXd M = MatrixXd::Zero(size, size);
  M.topLeftCorner(e, e) = D.transpose() * contacts.delassus() * D;
  VectorXd q = VectorXd::Zero(size);
  q.head(e) = D.transpose() * contacts.u;
  for (int i = 0; i < n; ++i) {
    M.block(f + kEdges * i, e + i, kEdges, 1).setOnes();
    M.block(e + i, f + kEdges * i, 1, kEdges).setConstant(-1);
    M(e + i, i) = contacts.friction[i];
  }
  if (closest && size <= kMostEnumerated) {
    MatrixXd shown = MatrixXd::Zero(3 * n, size);
    shown.leftCols(e) = D;
    const LcpSolution nearest = solve_closest(M, q, shown, *closest);
    if (is_solution(nearest)) return D * nearest.z.head(e);
  }
  const LcpSolution solution = solve_lemke(M, q);
  if (!is_solution(solution)) return {};
  return D * solution.z.head(e);
}

VectorXd pivot_no_slip(const BaseContacts& contacts, std::vector<int>& active) {
  const int n = static_cast<int>(contacts.friction.size());
  const MatrixXd W = contacts.delassus();
  const std::vector<int> tangents = independent_tangents(W, contacts.A.rows());
  std::vector<int> normals(n);
  for (int i = 0; i < n; ++i) normals[i] = 3 * i;
  // The tangents' forces are what keeps their velocities at zero (Eqs. 72, 73), whatever the normals do.
  const MatrixXd B = W(tangents, normals);
  const Eigen::LLT<MatrixXd> factor(MatrixXd(W(tangents, tangents)));
  const VectorXd still = factor.solve(contacts.u(tangents));
  const MatrixXd with = factor.solve(B);
  const MatrixXd Q = W(normals, normals) - B.transpose() * with;
  const VectorXd r = contacts.u(normals) - B.transpose() * still;
  const LcpSolution solution = solve_ppm(0.5 * (Q + Q.transpose()), r, active);
  active.clear();
  if (!is_solution(solution)) return {};
  active = solution.active;
  const VectorXd along = -(still + with * solution.z);
  VectorXd out = VectorXd::Zero(3 * n);
  for (int i = 0; i < n; ++i) out[3 * i] = solution.z[i];
  for (std::size_t k = 0; k < tangents.size(); ++k) out[tangents[k]] = along[k];
  return out;
}

void ContactPivoting::serve(InverseDynamicsView& view) {
  view_ = &view;
  view.solver = this;
  view.pivot = [](void* self, int lane, int count) { static_cast<ContactPivoting*>(self)->solve(lane, count); };
}

BaseContacts ContactPivoting::read(int lane, int count) {
  const InverseDynamicsMemory& m = view_->memory;
  contacts_.clear();
  for (int i = 0; i < count; ++i) {
    if (m.lanes_of_contact[i] >> lane & 1u) contacts_.push_back(i);
  }
  const int n = static_cast<int>(contacts_.size()), nv = view_->topology.nv, velocities = 6 * view_->free_count;
  BaseContacts out{MatrixXd::Zero(velocities, velocities), MatrixXd::Zero(3 * n, velocities), VectorXd(3 * n),
                   VectorXd(n)};
  for (int i = 0; i < view_->free_count; ++i) {
    const double* M = m.M + kLanes * view_->free[i].mass + lane;
    for (int k = 0; k < 6; ++k) {
      for (int d = 0; d <= k; ++d) {
        out.A(6 * i + k, 6 * i + d) = out.A(6 * i + d, 6 * i + k) = M[kLanes * base_entry(k, d)];
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    const double* row = m.pivot + kLanes * kPivotRows * contacts_[i] + lane;
    const int reached = std::min(velocities, view_->program.dof_depth[m.dof_of_contact[contacts_[i]]] + 1);
    const double* jacobian = m.jacobian + kLanes * 3 * nv * contacts_[i] + lane;
    for (int k = 0; k < 3; ++k) {
      out.u[3 * i + k] = row[kLanes * (kPivotVelocity + k)];
      for (int d = 0; d < reached; ++d) out.J(3 * i + k, d) = jacobian[kLanes * (3 * d + k)];
    }
    out.friction[i] = row[kLanes * kPivotFriction];
  }
  return out;
}

VectorXd ContactPivoting::solve_no_slip(int lane, const BaseContacts& contacts) {
  const InverseDynamicsMemory& m = view_->memory;
  std::vector<int>& pressing = pressing_[lane];
  std::vector<int> active;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const int link = m.link_of_contact[contacts_[i]];
    if (std::find(pressing.begin(), pressing.end(), link) != pressing.end()) active.push_back(static_cast<int>(i));
  }
  const VectorXd impulse = pivot_no_slip(contacts, active);
  pressing.clear();
  for (const int i : active) pressing.push_back(m.link_of_contact[contacts_[i]]);
  return impulse;
}

VectorXd ContactPivoting::solve_closest(int lane, const BaseContacts& contacts) {
  const InverseDynamicsMemory& m = view_->memory;
  std::vector<int>& pressing = pressing_[lane];
  std::vector<double>& impulses = impulses_[lane];
  VectorXd before = VectorXd::Zero(3 * static_cast<Eigen::Index>(contacts_.size()));
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const auto found = std::find(pressing.begin(), pressing.end(), m.link_of_contact[contacts_[i]]);
    if (found == pressing.end()) continue;
    const auto at = static_cast<std::size_t>(found - pressing.begin());
    for (std::size_t k = 0; k < 3; ++k) before[static_cast<Eigen::Index>(3 * i + k)] = impulses[3 * at + k];
  }
  const VectorXd impulse = pivot_coulomb(contacts, &before);
  pressing.clear();
  if (impulse.size() > 0) {
    for (const int contact : contacts_) pressing.push_back(m.link_of_contact[contact]);
  }
  impulses.assign(impulse.begin(), impulse.end());
  return impulse;
}

void ContactPivoting::solve(int lane, int count) {
  const BaseContacts contacts = read(lane, count);
  const VectorXd impulse = which_ == Pivoting::no_slip   ? solve_no_slip(lane, contacts)
                           : which_ == Pivoting::closest ? solve_closest(lane, contacts)
                                                         : pivot_coulomb(contacts);
  for (int k = 0; k < impulse.size(); ++k) {
    view_->memory.pivot[kLanes * (kPivotRows * contacts_[k / 3] + kPivotImpulse + k % 3) + lane] = impulse[k];
  }
}

}  // namespace graze
