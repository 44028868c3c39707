#pragma once
// Frictional contact of one step as plain matrices: what solvers of any kind can be measured against. Contact
// velocities are u = A lambda + b, three rows per contact: normal, then two tangents. Small and slow on purpose.

#include <Eigen/Dense>

namespace graze {

struct ContactProblem {
  Eigen::MatrixXd A;   // J M^-1 J^T (Delassus), 1/kg, [3 contacts][3 contacts]
  Eigen::VectorXd b;   // J v* with phi / h on the normal rows (Eq. 67: n . u >= -phi / h), m/s
  Eigen::VectorXd mu;  // per contact

  int contacts() const { return static_cast<int>(mu.size()); }
};

/// J: [3 contacts][dofs], v_free: velocity after the step without contact, phi: gaps (m).
ContactProblem make_contact_problem(const Eigen::MatrixXd& J, const Eigen::MatrixXd& mass,
                                    const Eigen::VectorXd& v_free, const Eigen::VectorXd& phi, double h,
                                    const Eigen::VectorXd& mu);

/// The problem as an LCP with a friction cone of `edges` sides (Stewart & Trinkle 1996, Anitescu & Potra 1997;
/// dissertation Eqs. 86, 87, 98). Unknowns: f_N (contacts), f_F (edges per contact), lambda (contacts). The first row
/// of blocks of Eq. 98 in print holds the E that belongs to the second (Eq. 86), and the third has its blocks exchanged
/// and signs reversed (Eq. 87); here they stand as those equations say.
struct ContactLcp {
  Eigen::MatrixXd M;
  Eigen::VectorXd q;
  int edges;

  /// lambda of a ContactProblem from a solution z.
  Eigen::VectorXd impulses(const Eigen::VectorXd& z) const;
};
ContactLcp contact_lcp(const ContactProblem& problem, int edges);

/// How far impulses are from the complementarity model, each the largest over the contacts, in m/s:
struct ContactResiduals {
  double signorini = 0;    // 0 <= lambda_n  _|_  u_n >= 0
  double coulomb = 0;      // |lambda_t| <= mu lambda_n
  double dissipation = 0;  // lambda_t opposes sliding as much as that disc allows
};

/// By projection: a condition "x minimises over a set" holds if and only if x = P(x - r u), with P the projection on
/// the set and r > 0; the residual is |x - P(x - r u)| / r with 1/r the contact's own entries of A.
ContactResiduals contact_residuals(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& mu,
                                   const Eigen::VectorXd& lambda);

}  // namespace graze
