#include "engine/control/contact_pivoting.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/contact/lcp.h"
#include "engine/dynamics/factor.h"

namespace graze {

namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr int kEdges = 4;  // of the friction pyramid, as published

/// A contact that is left out approaches by more than this share of the fastest velocity (the error that Lemke's
/// algorithm is granted).
constexpr double kApproach = 1e-9;
/// So many contacts are solved at once, which is faster than one after the other (measured: 17 us instead of 26).
constexpr int kTogether = 4;
/// Of so many all may press. Of more, twice as many as there are velocities: with more than those, some depend on
/// others.
constexpr int kFew = 8;
int most_pressing(const BaseContacts& contacts) { return std::max(kFew, 2 * static_cast<int>(contacts.A.rows())); }
/// The largest impulse that is believed, in units of the robot's weight times the horizon (our choice: no leg bears a
/// tenth of it). Where normals oppose each other, or tangents hardly differ, a problem without slip has solutions of
/// 1e17 N.
constexpr double kMostWeights = 100;
/// From so many contacts on there is no trying with all of them, which would take seconds, if a few do not do.
constexpr int kMany = 20;

/// Algorithm 3: rows of the tangents (in the numbering of J) on which forces can be told apart, found by a Cholesky
/// factorisation that grows row by row; no more than there are free velocities.
std::vector<int> independent_tangents(const MatrixXd& W, Eigen::Index velocities, double share) {
  std::vector<int> rows;
  MatrixXd L(velocities, velocities);
  for (int i = 0; i < W.rows() && static_cast<Eigen::Index>(rows.size()) < velocities; ++i) {
    if (i % 3 == 0) continue;  // a normal
    const int n = static_cast<int>(rows.size());
    VectorXd a(n);
    for (int k = 0; k < n; ++k) a[k] = W(i, rows[k]);
    const VectorXd l = L.topLeftCorner(n, n).triangularView<Eigen::Lower>().solve(a);
    const double rest = W(i, i) - l.squaredNorm();
    if (!(rest > share * W(i, i))) continue;
    L.row(n).head(n) = l.transpose();
    L(n, n) = std::sqrt(rest);
    rows.push_back(i);
  }
  return rows;
}

bool is_solution(const LcpSolution& solution) { return solution.solved && solution.z.allFinite(); }

/// Impulses of contacts by one problem for all of them, or none if Lemke's algorithm ends on a ray.
VectorXd pivot_all(const BaseContacts& contacts, const VectorXd* closest) {
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

/// Those contacts alone, in this order.
BaseContacts part_of(const BaseContacts& contacts, const std::vector<int>& chosen) {
  const auto n = static_cast<Eigen::Index>(chosen.size());
  BaseContacts out{contacts.A, MatrixXd(3 * n, contacts.J.cols()), VectorXd(3 * n), VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const int from = chosen[static_cast<std::size_t>(i)];
    out.J.middleRows(3 * i, 3) = contacts.J.middleRows(3 * from, 3);
    out.u.segment(3 * i, 3) = contacts.u.segment(3 * from, 3);
    out.friction[i] = contacts.friction[from];
  }
  return out;
}

/// The contact that approaches fastest, and faster than `tolerance`, of those that are not chosen, or -1. `velocity`:
/// of all along their normals.
template <class Velocity>
int fastest_other(const Velocity& velocity, const std::vector<int>& chosen, double tolerance) {
  int fastest = -1;
  for (int i = 0; i < velocity.size(); ++i) {
    if (velocity[i] >= (fastest < 0 ? -tolerance : velocity[fastest])) continue;
    if (std::find(chosen.begin(), chosen.end(), i) == chosen.end()) fastest = i;
  }
  return fastest;
}

/// Impulses of a few contacts under which no other approaches, so that all are solved with none for the others: bodies
/// have six velocities each, of which few contacts take all. The one that approaches fastest joins until none does.
/// None if this takes more than most_pressing().
VectorXd pivot_few(const BaseContacts& contacts) {
  const int n = static_cast<int>(contacts.friction.size());
  const Eigen::LLT<MatrixXd> inertia(contacts.A);
  const double tolerance = kApproach * contacts.u.cwiseAbs().maxCoeff();
  VectorXd impulse = VectorXd::Zero(3 * n), velocity = contacts.u;
  std::vector<int> chosen;
  for (int most = most_pressing(contacts); most >= 0; --most) {
    const int fastest = fastest_other(velocity(Eigen::seqN(0, n, 3)), chosen, tolerance);
    if (fastest < 0) return impulse;
    chosen.push_back(fastest);
    const VectorXd of_chosen = pivot_all(part_of(contacts, chosen), nullptr);
    if (of_chosen.size() == 0) return {};
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      impulse.segment(3 * chosen[i], 3) = of_chosen.segment(3 * static_cast<Eigen::Index>(i), 3);
    }
    velocity = contacts.u + contacts.J * inertia.solve(contacts.J.transpose() * impulse);
  }
  return {};
}

/// The same for contacts that press by z with Q z + r >= 0, from those that pressed in the last solution. Not solved if
/// this takes more than `most`.
LcpSolution press_few(const MatrixXd& Q, const VectorXd& r, const std::vector<int>& active, int most) {
  const int n = static_cast<int>(r.size());
  const double tolerance = kApproach * r.cwiseAbs().maxCoeff();
  std::vector<int> chosen = active, pressing(active.size());
  std::iota(pressing.begin(), pressing.end(), 0);
  LcpSolution all;
  while (static_cast<int>(chosen.size()) <= most) {
    const LcpSolution few = solve_ppm(Q(chosen, chosen), r(chosen), pressing);
    if (!is_solution(few)) break;
    pressing = few.active;
    all.z = VectorXd::Zero(n);
    all.z(chosen) = few.z;
    all.w = Q * all.z + r;
    const int fastest = fastest_other(all.w, chosen, tolerance);
    all.solved = fastest < 0;
    if (all.solved) break;
    chosen.push_back(fastest);
  }
  for (const int i : pressing) all.active.push_back(chosen[static_cast<std::size_t>(i)]);
  return all;
}

}  // namespace

VectorXd pivot_coulomb(const BaseContacts& contacts, const VectorXd* closest) {
  if (contacts.friction.size() > kTogether) {
    VectorXd impulse = pivot_few(contacts);
    if (impulse.size() > 0 || contacts.friction.size() > kMany) return impulse;
  }
  return pivot_all(contacts, closest);
}

VectorXd pivot_no_slip(const BaseContacts& contacts, std::vector<int>& active, double independent) {
  const int n = static_cast<int>(contacts.friction.size());
  const MatrixXd W = contacts.delassus();
  const std::vector<int> tangents = independent_tangents(W, contacts.A.rows(), independent);
  std::vector<int> normals(n);
  for (int i = 0; i < n; ++i) normals[i] = 3 * i;
  // The tangents' forces are what keeps their velocities at zero (Eqs. 72, 73), whatever the normals do.
  const MatrixXd B = W(tangents, normals);
  const Eigen::LLT<MatrixXd> factor(MatrixXd(W(tangents, tangents)));
  const VectorXd still = factor.solve(contacts.u(tangents));
  const MatrixXd with = factor.solve(B);
  const MatrixXd Q = W(normals, normals) - B.transpose() * with;
  const VectorXd r = contacts.u(normals) - B.transpose() * still;
  const MatrixXd symmetric = 0.5 * (Q + Q.transpose());
  LcpSolution solution;
  if (n > kTogether) solution = press_few(symmetric, r, active, most_pressing(contacts));
  if (!solution.solved && n <= kMany) solution = solve_ppm(symmetric, r, active);
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
  // Where there is no solution the convex program's impulses stand.
  if (impulse.size() > 0 && !(impulse.lpNorm<Eigen::Infinity>() <= kMostWeights * view_->weight * view_->h)) return;
  for (int k = 0; k < impulse.size(); ++k) {
    view_->memory.pivot[kLanes * (kPivotRows * contacts_[k / 3] + kPivotImpulse + k % 3) + lane] = impulse[k];
  }
}

}  // namespace graze
