// Claims: Lemke's algorithm and principal pivoting solve random LCPs, agree where the solution is unique, and reproduce
// contact problems that are solved by hand; the residuals measure what they say.

#include "engine/contact/lcp.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/contact/reference_contact.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class Numbers {
 public:
  explicit Numbers(unsigned seed) : generator_(seed) {}
  double normal() { return std::normal_distribution()(generator_); }
  int below(int n) { return static_cast<int>(generator_() % static_cast<unsigned>(n)); }
  MatrixXd matrix(int rows, int columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(); });
  }
  VectorXd vector(int n) { return matrix(n, 1); }
  MatrixXd positive_definite(int n) {
    const MatrixXd B = matrix(n, n);
    return B * B.transpose() + 0.1 * MatrixXd::Identity(n, n);
  }

 private:
  std::mt19937 generator_;
};

// A positive definite LCP has one solution; both methods find it. (Tolerance: condition numbers up to 1e5 here.)
TEST(Lcp, positive_definite_problems_have_one_solution) {
  Numbers numbers(1);
  for (int trial = 0; trial < test::trials(300); ++trial) {
    const int n = 1 + numbers.below(30);
    const MatrixXd M = numbers.positive_definite(n);
    const VectorXd q = numbers.vector(n);
    const LcpSolution lemke = solve_lemke(M, q), ppm = solve_ppm(M, q);
    ASSERT_TRUE(lemke.solved && ppm.solved) << trial;
    EXPECT_LT(lcp_residual(M, q, lemke.z), 1e-10) << trial;
    EXPECT_LT(lcp_residual(M, q, ppm.z), 1e-9) << trial;
    EXPECT_LT((lemke.z - ppm.z).norm(), 1e-8 * (1 + lemke.z.norm())) << trial;
  }
}

// An unsymmetric positive definite M has one solution, too, and every sub-block is regular.
TEST(Lcp, unsymmetric_problems) {
  Numbers numbers(2);
  for (int trial = 0; trial < test::trials(200); ++trial) {
    const int n = 1 + numbers.below(12);
    const MatrixXd S = numbers.matrix(n, n), M = numbers.positive_definite(n) + S - S.transpose();
    const VectorXd q = numbers.vector(n);
    const LcpSolution lemke = solve_lemke(M, q), ppm = solve_ppm(M, q);
    ASSERT_TRUE(lemke.solved && ppm.solved) << trial;
    EXPECT_LT((lemke.z - ppm.z).norm(), 1e-8 * (1 + lemke.z.norm())) << trial;
  }
}

// More contacts than degrees of freedom, some twice: N mass^-1 N^T is singular. Impulses are then not unique, but the
// motion is (Anitescu & Potra 1997): all three methods give the same w and the same velocities.
TEST(Lcp, redundant_contacts_give_one_motion) {
  Numbers numbers(3);
  for (int trial = 0; trial < test::trials(300); ++trial) {
    const int dofs = 2 + numbers.below(6), contacts = dofs + numbers.below(20);
    MatrixXd N = numbers.matrix(contacts, dofs);
    N.row(contacts - 1) = N.row(0);
    // A motion with N v > 0 exists, so that the contacts can all be left: the problem is feasible.
    for (int i = 0; i < contacts; ++i) N.row(i) *= N(i, 0) < 0 ? -1 : 1;
    const MatrixXd mass = numbers.positive_definite(dofs);
    const VectorXd v = 3 * numbers.vector(dofs);
    const MatrixXd inverse = mass.inverse(), M = N * inverse * N.transpose();
    const LcpSolution lemke = solve_lemke(M, N * v), ppm = solve_ppm(M, N * v), lean = solve_contact_ppm(N, mass, v);
    ASSERT_TRUE(lemke.solved && ppm.solved && lean.solved) << trial;
    const VectorXd motion = v + inverse * N.transpose() * lean.z;
    for (const LcpSolution* other : {&lemke, &ppm}) {
      const VectorXd theirs = v + inverse * N.transpose() * other->z;
      EXPECT_LT((theirs - motion).norm(), 1e-7 * (1 + motion.norm())) << trial;
      EXPECT_LT(lcp_residual(M, N * v, other->z), 1e-7) << trial;
    }
    // No more positive impulses than degrees of freedom (Appendix D).
    EXPECT_LE(static_cast<int>(lean.active.size()), dofs) << trial;
  }
}

// Started from the solution's own active set, principal pivoting ends at once and changes nothing (§7.3.6).
TEST(Lcp, warm_start_keeps_the_solution) {
  Numbers numbers(4);
  for (int trial = 0; trial < test::trials(100); ++trial) {
    const int n = 2 + numbers.below(20);
    const MatrixXd M = numbers.positive_definite(n);
    const VectorXd q = numbers.vector(n);
    const LcpSolution first = solve_ppm(M, q), again = solve_ppm(M, q, first.active);
    ASSERT_TRUE(again.solved);
    EXPECT_EQ(again.pivots, 0);
    EXPECT_EQ((again.z - first.z).norm(), 0);
  }
}

// w = -z - 1 has no solution with z >= 0: Lemke must end on a ray and say so.
TEST(Lcp, unsolvable_problems_are_named) {
  EXPECT_FALSE(solve_lemke(-MatrixXd::Identity(1, 1), -VectorXd::Ones(1)).solved);
  EXPECT_FALSE(solve_ppm(-MatrixXd::Identity(1, 1), -VectorXd::Ones(1)).solved);
  EXPECT_TRUE(solve_lemke(-MatrixXd::Identity(1, 1), VectorXd::Ones(1)).solved);
}

/// A point mass on a floor.
ContactProblem point_on_floor(const VectorXd& v, double mass, double mu, double phi, double h) {
  return make_contact_problem(MatrixXd::Identity(3, 3), mass * MatrixXd::Identity(3, 3), v, VectorXd::Constant(1, phi),
                              h, VectorXd::Constant(1, mu));
}
VectorXd solve(const ContactProblem& problem, int edges) {
  const ContactLcp lcp = contact_lcp(problem, edges);
  const LcpSolution solution = solve_lemke(lcp.M, lcp.q);
  EXPECT_TRUE(solution.solved);
  return lcp.impulses(solution.z);
}

// A point of 2 kg falls on the floor at 3 m/s: slow tangents stick, fast ones keep v_t - mu v_n; along an edge of the
// polygon the pyramid is exact. From a height it is only stopped as far as the gap asks.
TEST(ReferenceContact, point_on_floor_by_hand) {
  const VectorXd sticking = solve(point_on_floor(Eigen::Vector3d(-3, 1, 0), 2, 0.5, 0, 1e-3), 8);
  EXPECT_LT((sticking - Eigen::Vector3d(6, -2, 0)).norm(), 1e-12);
  const VectorXd sliding = solve(point_on_floor(Eigen::Vector3d(-3, 4, 0), 2, 0.5, 0, 1e-3), 8);
  EXPECT_LT((sliding - Eigen::Vector3d(6, -3, 0)).norm(), 1e-12);
  const VectorXd falling = solve(point_on_floor(Eigen::Vector3d(-3, 0, 0), 2, 0.5, 0.001, 1e-3), 8);
  EXPECT_NEAR(falling[0], 4, 1e-12);  // u_n = -phi / h = -1 m/s stays
  const VectorXd far = solve(point_on_floor(Eigen::Vector3d(-3, 1, 0), 2, 0.5, 0.01, 1e-3), 8);
  EXPECT_EQ(far.norm(), 0);
}

ContactProblem random_contacts(Numbers& numbers, int contacts, int dofs) {
  const MatrixXd J = numbers.matrix(3 * contacts, dofs);
  VectorXd mu(contacts), phi(contacts);
  for (int i = 0; i < contacts; ++i) {
    mu[i] = 0.1 + 0.2 * numbers.below(6);
    phi[i] = numbers.below(2) ? 0.0 : 1e-4 * std::abs(numbers.normal());
  }
  return make_contact_problem(J, numbers.positive_definite(dofs), numbers.vector(dofs), phi, 1e-3, mu);
}

// Random contacts with friction: Lemke's solution has no Signorini and no Coulomb residual, and misses full dissipation
// by no more than the polygon's half angle pi / edges: lambda_t . u_t <= -cos(pi / edges) mu lambda_n |u_t|.
TEST(ReferenceContact, lemke_solves_random_contacts) {
  Numbers numbers(5);
  for (int trial = 0; trial < test::trials(150); ++trial) {
    const int edges = trial % 2 ? 8 : 16;
    const ContactProblem problem = random_contacts(numbers, 1 + numbers.below(5), 6 + 3 * numbers.below(4));
    const ContactLcp lcp = contact_lcp(problem, edges);
    const LcpSolution solution = solve_lemke(lcp.M, lcp.q);
    ASSERT_TRUE(solution.solved) << trial;
    const VectorXd lambda = lcp.impulses(solution.z), u = problem.A * lambda + problem.b;
    const ContactResiduals residuals = contact_residuals(problem.A, problem.b, problem.mu, lambda);
    EXPECT_LT(residuals.signorini, 1e-8) << trial;
    EXPECT_LT(residuals.coulomb, 1e-8) << trial;
    for (int i = 0; i < problem.contacts(); ++i) {
      const auto slip = u.segment<2>(3 * i + 1);
      const double most = problem.mu[i] * lambda[3 * i] * slip.norm();
      EXPECT_LE(lambda.segment<2>(3 * i + 1).dot(slip), -std::cos(std::numbers::pi / edges) * most + 1e-8) << trial;
    }
  }
}

// The residuals see each kind of fault, in m/s, and nothing else: a sliding point of 2 kg, right and wrong by hand.
TEST(ReferenceContact, residuals_name_the_fault) {
  const ContactProblem problem = point_on_floor(Eigen::Vector3d(-3, 4, 0), 2, 0.5, 0, 1e-3);
  const auto at = [&](double n, double x, double y) {
    return contact_residuals(problem.A, problem.b, problem.mu, Eigen::Vector3d(n, x, y));
  };
  const ContactResiduals right = at(6, -3, 0);
  EXPECT_LT(std::max({right.signorini, right.coulomb, right.dissipation}), 1e-12);
  EXPECT_NEAR(at(5, -2.5, 0).signorini, 0.5, 1e-12);  // still approaching at 0.5 m/s
  EXPECT_NEAR(at(7, -3.5, 0).signorini, 0.5, 1e-12);  // leaving at 0.5 m/s while pressed
  EXPECT_NEAR(at(6, -4, 0).coulomb, 0.5, 1e-12);      // 1 N s too much on 2 kg
  EXPECT_NEAR(at(6, -1, 0).dissipation, 1, 1e-12);    // 2 N s of 3 left unused
  EXPECT_GT(at(6, 0, -3).dissipation, 1);             // across the slip
  EXPECT_NEAR(at(-1, 0, 0).signorini, 3.5, 1e-12);    // pulls
}

// Where there is one solution, that is the closest to anything.
TEST(Lcp, closest_of_one_solution) {
  Numbers numbers(11);
  for (int trial = 0; trial < test::trials(60); ++trial) {
    const int n = 1 + numbers.below(7);
    const MatrixXd M = numbers.positive_definite(n);
    const VectorXd q = numbers.vector(n);
    const LcpSolution lemke = solve_lemke(M, q);
    const LcpSolution closest = solve_closest(M, q, MatrixXd::Identity(n, n), numbers.vector(n));
    ASSERT_TRUE(closest.solved) << trial;
    EXPECT_EQ(closest.pivots, 1 << n);
    EXPECT_LT(lcp_residual(M, q, closest.z), 1e-9) << trial;
    EXPECT_LT((lemke.z - closest.z).norm(), 1e-8 * (1 + lemke.z.norm())) << trial;
  }
}

// z = (1, 0), (0, 1) and (1/3, 1/3) solve this one; which comes out is a question of what was before, in the measure of
// D.
TEST(Lcp, closest_of_three_solutions) {
  const MatrixXd M{{1, 2}, {2, 1}};
  const VectorXd q{{-1, -1}};
  const MatrixXd plain = MatrixXd::Identity(2, 2);
  const auto near = [&](const MatrixXd& D, double a, double b) { return solve_closest(M, q, D, VectorXd{{a, b}}).z; };
  EXPECT_LT((near(plain, 0.9, 0.2) - VectorXd{{1, 0}}).norm(), 1e-14);
  EXPECT_LT((near(plain, -1, 0.8) - VectorXd{{0, 1}}).norm(), 1e-14);
  EXPECT_LT((near(plain, 0.4, 0.5) - VectorXd{{1, 1}} / 3).norm(), 1e-14);
  const MatrixXd first{{1, 0}, {0, 0}};  // the second does not count
  EXPECT_LT((near(first, 0.05, 100) - VectorXd{{0, 1}}).norm(), 1e-14);
}

// Of any problem, Lemke's solution is none that is closer; and what has none, or is large, is not called solved.
TEST(Lcp, closest_is_no_farther_than_lemke) {
  Numbers numbers(12);
  int several = 0;
  for (int trial = 0; trial < test::trials(100); ++trial) {
    const int n = 2 + numbers.below(5);
    const MatrixXd M = numbers.matrix(n, n).cwiseAbs();  // strictly copositive: solvable, often in several ways
    const VectorXd q = -numbers.vector(n).cwiseAbs(), before = numbers.vector(n).cwiseAbs();
    const LcpSolution lemke = solve_lemke(M, q), closest = solve_closest(M, q, MatrixXd::Identity(n, n), before);
    ASSERT_TRUE(lemke.solved && closest.solved) << trial;
    EXPECT_LT(lcp_residual(M, q, closest.z), 1e-7 * (1 + closest.z.maxCoeff())) << trial;
    EXPECT_LE((closest.z - before).norm(), (lemke.z - before).norm() * (1 + 1e-9) + 1e-12) << trial;
    several += (closest.z - lemke.z).norm() > 1e-6;
  }
  EXPECT_GT(several, test::trials(100) / 10);
  EXPECT_FALSE(
      solve_closest(-MatrixXd::Identity(1, 1), VectorXd{{-1}}, MatrixXd::Identity(1, 1), VectorXd{{0}}).solved);
  const int many = kMostEnumerated + 1;
  const MatrixXd large = MatrixXd::Identity(many, many);
  EXPECT_FALSE(solve_closest(large, VectorXd::Constant(many, -1), large, VectorXd::Zero(many)).solved);
}

}  // namespace
}  // namespace graze
