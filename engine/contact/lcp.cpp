#include "engine/contact/lcp.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>

namespace graze {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// q, a little larger, each entry by its own amount (1 to 2 times 1e-10 of the largest; multiples of the golden ratio
/// never meet). Larger entries keep a solvable copositive problem solvable.
VectorXd perturbed(const VectorXd& q) {
  const double size = 1e-10 * q.cwiseAbs().maxCoeff();
  VectorXd out = q;
  for (int i = 0; i < q.size(); ++i) {
    const double golden = 0.6180339887498949 * (i + 1);
    out[i] += size * (1 + golden - std::floor(golden));
  }
  return out;
}

/// Pivots after which the inverse of a basis is computed afresh, and the least pivot, as a share of its column's
/// largest entry, by which it is brought up to date (our choices).
constexpr int kFreshAfter = 250;
constexpr double kLeastPivot = 1e-4;

/// The system w - M z - e z0 = q with n basic variables: w are numbered 0 to n - 1, z from n, z0 is 2 n. The inverse of
/// the basis is brought up to date by each pivot, and computed afresh after `fresh_after` and after small ones:
/// redundant contacts let the errors of updates grow.
class LemkeBasis {
 public:
  LemkeBasis(const MatrixXd& M, const VectorXd& q, int fresh_after)
      : M_(M), q_(perturbed(q)), n_(static_cast<int>(q.size())), fresh_after_(fresh_after) {
    for (int i = 0; i < n_; ++i) basic_.push_back(i);
    inverse_ = MatrixXd::Identity(n_, n_);
    values_ = q_;
  }

  int artificial() const { return 2 * n_; }
  int complement(int variable) const { return variable < n_ ? variable + n_ : variable - n_; }
  const std::vector<int>& basic() const { return basic_; }

  /// Row that leaves first when z0 enters: the most negative q.
  int first_row() const {
    int row = 0;
    values_.minCoeff(&row);
    return row;
  }
  /// Row that blocks `entering` first, or -1 (a ray).
  int blocking_row(int entering) const {
    const VectorXd change = change_by(entering);
    const double tolerance = 1e-10 * change.cwiseAbs().maxCoeff();
    int row = -1;
    for (int i = 0; i < n_; ++i) {
      if (change[i] <= tolerance) continue;
      if (row < 0 || values_[i] * change[row] < values_[row] * change[i]) row = i;
    }
    return row;
  }
  /// Puts `entering` into the basis at `row`; returns what left.
  int exchange(int row, int entering) {
    VectorXd change = change_by(entering);
    std::swap(basic_[row], entering);
    const double pivot = change[row];
    if (++since_fresh_ < fresh_after_ && std::abs(pivot) > kLeastPivot * change.cwiseAbs().maxCoeff()) {
      const double step = values_[row] / pivot;
      values_ -= step * change;
      values_[row] = step;
      const VectorXd of_row = inverse_.row(row).transpose() / pivot;
      change[row] -= 1;
      inverse_.noalias() -= change * of_row.transpose();
    } else {
      MatrixXd basis(n_, n_);
      for (int i = 0; i < n_; ++i) basis.col(i) = column(basic_[i]);
      inverse_ = basis.partialPivLu().inverse();
      values_.noalias() = inverse_ * q_;
      since_fresh_ = 0;
    }
    return entering;
  }

 private:
  /// By how much the basic variables fall as one that is not rises by 1.
  VectorXd change_by(int variable) const {
    if (variable < n_) return inverse_.col(variable);
    return inverse_ * column(variable);
  }
  VectorXd column(int variable) const {
    if (variable < n_) return VectorXd::Unit(n_, variable);
    return variable == artificial() ? VectorXd(-VectorXd::Ones(n_)) : VectorXd(-M_.col(variable - n_));
  }

  const MatrixXd& M_;
  VectorXd q_;
  int n_, fresh_after_, since_fresh_ = 0;
  std::vector<int> basic_;
  MatrixXd inverse_;
  VectorXd values_;
};

/// z of the complementary basis in which the listed z are free and the other w.
LcpSolution from_active(const MatrixXd& M, const VectorXd& q, std::vector<int> active, int pivots) {
  LcpSolution out;
  std::sort(active.begin(), active.end());
  out.z = VectorXd::Zero(q.size());
  if (!active.empty()) {
    const VectorXd free = M(active, active).fullPivLu().solve(-q(active));
    out.z(active) = free.cwiseMax(0.0);
  }
  out.w = M * out.z + q;
  out.active = std::move(active);
  out.pivots = pivots;
  out.solved = true;
  return out;
}

LcpSolution unsolved(const VectorXd& q, int pivots) {
  LcpSolution out;
  out.z = VectorXd::Zero(q.size());
  out.w = q;
  out.pivots = pivots;
  return out;
}

/// What principal pivoting needs of M and q.
struct PpmProblem {
  int n;
  double scale;                                                              // of q
  std::function<VectorXd(const std::vector<int>&)> solve;                    // z of the active set, w = 0 there
  std::function<VectorXd(const std::vector<int>&, const VectorXd&)> result;  // all w
};

/// The set of active indices while it changes.
class ActiveSet {
 public:
  explicit ActiveSet(std::vector<int> start) : indices_(std::move(start)) {
    std::sort(indices_.begin(), indices_.end());
  }
  const std::vector<int>& indices() const { return indices_; }
  bool has(int i) const { return std::binary_search(indices_.begin(), indices_.end(), i); }
  void flip(int i) {
    const auto at = std::lower_bound(indices_.begin(), indices_.end(), i);
    if (at != indices_.end() && *at == i) {
      indices_.erase(at);
    } else {
      indices_.insert(at, i);
    }
  }

 private:
  std::vector<int> indices_;
};

/// Index of the least entry below -tolerance, or -1.
int most_negative(const VectorXd& x, double tolerance) {
  int at = -1;
  for (int i = 0; i < x.size(); ++i) {
    if (x[i] < -tolerance && (at < 0 || x[i] < x[at])) at = i;
  }
  return at;
}

/// One round of Algorithm 4 (lines 16-37). False when the set solves the problem.
bool exchange_most_negative(const VectorXd& z, const VectorXd& w, double w_tolerance, double z_tolerance,
                            ActiveSet& set) {
  const int enters = most_negative(w, w_tolerance), leaves = most_negative(z, z_tolerance);
  const int leaving_index = leaves < 0 ? -1 : set.indices()[leaves];
  if (enters < 0 && leaves < 0) return false;
  if (enters >= 0) set.flip(enters);
  if (leaving_index >= 0) set.flip(leaving_index);
  return true;
}

/// Flips the least index that violates its sign. False when there is none.
bool exchange_least_index(const VectorXd& z, const VectorXd& w, double w_tolerance, double z_tolerance,
                          ActiveSet& set) {
  std::vector<double> violation(w.size());
  for (int i = 0; i < w.size(); ++i) violation[i] = -w[i] - w_tolerance;
  for (std::size_t k = 0; k < set.indices().size(); ++k) violation[set.indices()[k]] = -z[k] - z_tolerance;
  for (int i = 0; i < w.size(); ++i) {
    if (violation[i] > 0) {
      set.flip(i);
      return true;
    }
  }
  return false;
}

LcpSolution pivot_principally(const PpmProblem& problem, const std::vector<int>& start) {
  ActiveSet set(start);
  const int greedy = 5 * problem.n + 20, most = 50 * problem.n + 200;
  for (int pivots = 0; pivots < most; ++pivots) {
    const VectorXd z = problem.solve(set.indices());
    VectorXd w = problem.result(set.indices(), z);
    for (int i : set.indices()) w[i] = 0;
    // Rows that depend on active ones have w = 0 but for rounding: they must not enter (Appendix D).
    const double largest = z.size() > 0 ? z.cwiseAbs().maxCoeff() : 0.0;
    const double w_tolerance = 1e-10 * problem.scale, z_tolerance = 1e-12 * largest;
    const auto exchange = pivots < greedy ? exchange_most_negative : exchange_least_index;
    if (exchange(z, w, w_tolerance, z_tolerance, set)) continue;
    LcpSolution out;
    out.z = VectorXd::Zero(problem.n);
    out.z(set.indices()) = z.cwiseMax(0.0);
    out.w = w;
    out.active = set.indices();
    out.pivots = pivots;
    out.solved = true;
    return out;
  }
  LcpSolution out;
  out.z = VectorXd::Zero(problem.n);
  out.w = VectorXd::Zero(problem.n);
  out.pivots = most;
  return out;
}

VectorXd solve_block(const MatrixXd& A, const VectorXd& right) {
  if (right.size() == 0) return right;
  // Rank-revealing: a start from the last call may hold rows that have become dependent.
  return A.completeOrthogonalDecomposition().solve(right);
}

}  // namespace

namespace {

LcpSolution pivot_by_lemke(const MatrixXd& M, const VectorXd& q, int fresh_after) {
  const int n = static_cast<int>(q.size());
  LemkeBasis basis(M, q, fresh_after);
  int left = basis.exchange(basis.first_row(), basis.artificial());
  for (int pivots = 1; pivots < 50 * n + 200; ++pivots) {
    const int entering = basis.complement(left);
    const int row = basis.blocking_row(entering);
    if (row < 0) return unsolved(q, pivots);
    left = basis.exchange(row, entering);
    if (left != basis.artificial()) continue;
    std::vector<int> active;
    for (int variable : basis.basic()) {
      if (variable >= n) active.push_back(variable - n);
    }
    return from_active(M, q, std::move(active), pivots);
  }
  return unsolved(q, 50 * n + 200);
}

}  // namespace

LcpSolution solve_lemke(const MatrixXd& M, const VectorXd& q) {
  const int n = static_cast<int>(q.size());
  assert(M.rows() == n && M.cols() == n);
  if (n == 0 || q.minCoeff() >= 0) return from_active(M, q, {}, 0);
  LcpSolution solution = pivot_by_lemke(M, q, kFreshAfter);
  if (solution.solved && lcp_residual(M, q, solution.z) <= 1e-9 * q.cwiseAbs().maxCoeff()) return solution;
  return pivot_by_lemke(M, q, 1);  // errors of updates may have led to another basis
}

LcpSolution solve_closest(const MatrixXd& M, const VectorXd& q, const MatrixXd& D, const VectorXd& before) {
  const int n = static_cast<int>(q.size());
  assert(M.rows() == n && M.cols() == n && D.cols() == n && D.rows() == before.size());
  if (n > kMostEnumerated) return unsolved(q, 0);
  constexpr double kRounding = 1e-9;  // of the largest entries: signs within it are zeros
  const double scale = n > 0 ? q.cwiseAbs().maxCoeff() : 0;
  LcpSolution best = unsolved(q, 0);
  double distance = std::numeric_limits<double>::infinity();
  int solved = 0;
  std::vector<int> active;
  for (unsigned basis = 0; basis < 1u << n; ++basis) {
    active.clear();
    for (int i = 0; i < n; ++i) {
      if (basis >> i & 1u) active.push_back(i);
    }
    VectorXd z = VectorXd::Zero(n);
    if (!active.empty()) {
      const Eigen::FullPivLU<MatrixXd> factor(MatrixXd(M(active, active)));
      if (!factor.isInvertible()) continue;
      const VectorXd some = factor.solve(VectorXd(-q(active)));
      // Entry by entry: GCC 12 warns of an array of indices that Eigen copies here and frees.
      for (std::size_t i = 0; i < active.size(); ++i) z[active[i]] = some[static_cast<Eigen::Index>(i)];
    }
    ++solved;
    if (!(z.minCoeff() >= -kRounding * z.cwiseAbs().maxCoeff())) continue;
    z = z.cwiseMax(0.0);
    const VectorXd w = M * z + q;
    if (!(w.minCoeff() >= -kRounding * scale)) continue;
    const double off = (D * z - before).norm();
    if (!(off < distance)) continue;
    distance = off;
    best.z = z;
    best.w = w;
    for (const int i : active) best.w[i] = 0;
    best.active = active;
    best.solved = true;
  }
  best.pivots = solved;
  return best;
}

LcpSolution solve_ppm(const MatrixXd& M, const VectorXd& q, const std::vector<int>& start) {
  PpmProblem problem;
  problem.n = static_cast<int>(q.size());
  problem.scale = problem.n > 0 ? std::max(q.cwiseAbs().maxCoeff(), 1e-300) : 1;
  problem.solve = [&](const std::vector<int>& active) { return solve_block(M(active, active), VectorXd(-q(active))); };
  problem.result = [&](const std::vector<int>& active, const VectorXd& z) {
    return VectorXd(M(Eigen::all, active) * z + q);
  };
  return pivot_principally(problem, start);
}

LcpSolution solve_contact_ppm(const MatrixXd& N, const MatrixXd& mass, const VectorXd& v,
                              const std::vector<int>& start) {
  const Eigen::LLT<MatrixXd> factor(mass);
  const VectorXd q = N * v;
  PpmProblem problem;
  problem.n = static_cast<int>(N.rows());
  problem.scale = problem.n > 0 ? std::max(q.cwiseAbs().maxCoeff(), 1e-300) : 1;
  problem.solve = [&](const std::vector<int>& active) {
    if (active.empty()) return VectorXd();  // Eigen solves for no columns by looking at the first
    const MatrixXd rows = N(active, Eigen::all);
    return solve_block(rows * factor.solve(rows.transpose()), VectorXd(-q(active)));  // lines 11-13
  };
  problem.result = [&](const std::vector<int>& active, const VectorXd& z) {
    const VectorXd impulse = N(active, Eigen::all).transpose() * z;
    return VectorXd(N * (factor.solve(impulse) + v));  // lines 14, 15
  };
  return pivot_principally(problem, start);
}

double lcp_residual(const MatrixXd& M, const VectorXd& q, const VectorXd& z) {
  const VectorXd w = M * z + q;
  double worst = 0;
  for (int i = 0; i < q.size(); ++i) {
    worst = std::max({worst, -z[i], -w[i], std::min(std::abs(z[i]), std::abs(w[i]))});
  }
  return worst;
}

}  // namespace graze
