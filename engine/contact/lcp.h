#pragma once
// Linear complementarity problems, scalar and exact: the reference for the lane solver's impulses and the tool of
// controllers that invert contact. Find z, w with
//   w = M z + q,   z >= 0,   w >= 0,   z . w = 0.
// Lemke's algorithm takes copositive problems (Coulomb friction, dissertation §7.4.2, Eqs. 98-102); the principal
// pivoting method takes positive (semi)definite ones (no slip, complementarity-free; Appendix B), can start from the
// last solution's active set (§7.3.6), and has a form that never builds M = N M^-1 N^T (Algorithm 4).

#include <Eigen/Dense>
#include <vector>

namespace graze {

struct LcpSolution {
  Eigen::VectorXd z, w;
  std::vector<int> active;  // indices with w = 0 by construction (the method's non-basic set), ascending
  int pivots = 0;
  bool solved = false;  // false: Lemke ended on a ray, or the pivot limit was reached
};

/// Lemke's algorithm (Management Science 11, 1965; Cottle, Pang & Stone 1992, §4.4). Against cycling q is perturbed by
/// 1e-10 of its largest entry while the basis is sought; z is then solved from the basis with q as it is, and entries
/// that this makes negative (by the same order) are zero.
LcpSolution solve_lemke(const Eigen::MatrixXd& M, const Eigen::VectorXd& q);

/// The most variables of solve_closest: 4096 linear systems.
constexpr int kMostEnumerated = 12;

/// Algorithm 5: of all solutions the one whose image D z is closest to `before` (Euclidean norm), found by enumerating
/// the 2^n complementary bases. Bases that are singular are left out: where solutions form a face, its corners count.
/// D: [rows][n], before: [rows]. `pivots` are the bases that were solved. Not solved where n > kMostEnumerated, or no
/// basis gives a solution.
LcpSolution solve_closest(const Eigen::MatrixXd& M, const Eigen::VectorXd& q, const Eigen::MatrixXd& D,
                          const Eigen::VectorXd& before);

/// Principal pivoting method I (dissertation Appendix B) in the order of Algorithm 4: most negative w in, most negative
/// z out. That order may cycle, so after 5 n + 20 pivots the least index decides (Murty 1988, §4.2: finite for
/// P-matrices). `start`: the active set of the last call, empty at first.
LcpSolution solve_ppm(const Eigen::MatrixXd& M, const Eigen::VectorXd& q, const std::vector<int>& start = {});

/// Algorithm 4: the same for M = N mass^-1 N^T, q = N v, without building M. N: [contacts][dofs], v: motion without
/// contact. (The header of the algorithm in print has N M^-1 f* where its lines 2, 12 and 14 use N f*; those lines are
/// consistent when f* is the contact-free motion itself, as here.)
LcpSolution solve_contact_ppm(const Eigen::MatrixXd& N, const Eigen::MatrixXd& mass, const Eigen::VectorXd& v,
                              const std::vector<int>& start = {});

/// Largest violation of the four conditions, in the units of w and z.
double lcp_residual(const Eigen::MatrixXd& M, const Eigen::VectorXd& q, const Eigen::VectorXd& z);

}  // namespace graze
