// Claims: Newton's method finds the impulses that Lemke's algorithm and principal pivoting find where the solution is
// unique, on 10,000 problems, and the least of the convex model; it also converges where sweeps creep: many points
// under one body, which make A singular; and what is jammed gets bounded impulses.

#include <gtest/gtest.h>

#include "engine/contact/lcp.h"
#include "tests/engine/contact/random_problems.h"
#include "tests/sanitized.h"

namespace graze::test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTolerance = 1e-9;  // m/s

/// As `contact.solver: auto` has it (SolverSettings).
constexpr SolveBounds kShipped{60, 16, 100, 1e-6};

/// Newton's method from nothing, and one sweep where it does not converge.
constexpr SolveBounds kNewton{1, 0, 200, kTolerance};

// In the plane the pyramid of two edges is the cone, and with mu = 0.2 and such A the solution is unique.
TEST(Newton, ImpulsesAreThoseOfLemke) {
  RandomProblems problems(11);
  int slips = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const int n = 1 + trial % 4;
    ContactProblem problem = problems.regular(n, 0.2);
    for (int i = 0; i < n; ++i) {
      const int t = 3 * i + 2;
      problem.A.row(t).setZero(), problem.A.col(t).setZero();
      problem.A(t, t) = 1;
      problem.b[t] = 0;
    }
    const ContactLcp lcp = contact_lcp(problem, 2);
    const LcpSolution lemke = solve_lemke(lcp.M, lcp.q);
    ASSERT_TRUE(lemke.solved) << trial;
    const VectorXd exact = lcp.impulses(lemke.z);
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(false), kNewton);
    // The residual bounds the error by the condition of the problem, which is below 100 here.
    EXPECT_LT((lanes.lambda - exact).norm(), 1e3 * kTolerance) << trial;
    EXPECT_LE(lanes.residual, kTolerance) << trial;
    for (int i = 0; i < n; ++i) slips += exact[3 * i] > 1e-6 && std::abs(exact[3 * i + 1]) > 0.199 * exact[3 * i];
  }
  EXPECT_GT(slips, 1000);
}

TEST(Newton, FrictionlessImpulsesAreThoseOfPivoting) {
  RandomProblems problems(12);
  for (int trial = 0; trial < 500; ++trial) {
    const int n = 1 + trial % 8;
    const ContactProblem problem = problems.regular(n, 0);
    MatrixXd M(n, n);
    VectorXd q(n);
    for (int i = 0; i < n; ++i) {
      q[i] = problem.b[3 * i];
      for (int j = 0; j < n; ++j) M(i, j) = problem.A(3 * i, 3 * j);
    }
    const LcpSolution exact = solve_ppm(M, q);
    ASSERT_TRUE(exact.solved);
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(trial % 2 == 1), kNewton);
    for (int i = 0; i < n; ++i) EXPECT_NEAR(lanes.lambda[3 * i], exact.z[i], 1e3 * kTolerance) << trial;
  }
}

// Both solvers seek the same point of a convex programme.
TEST(Newton, ConvexImpulsesAreThoseOfSweeps) {
  RandomProblems problems(13);
  for (int trial = 0; trial < 500; ++trial) {
    const ContactProblem problem = problems.regular(1 + trial % 6, problems.between(0.1, 2));
    const LaneSolution newton = LaneProblem(problem).solve(contact_law(true), kNewton);
    const LaneSolution sweeps = LaneProblem(problem).solve(contact_law(true), 5000, 1e-12);
    EXPECT_LE(newton.residual, kTolerance) << trial;
    EXPECT_LT((newton.lambda - sweeps.lambda).norm(), 1e3 * kTolerance) << trial;
  }
}

/// Shares of random tables that Newton's method and 60 sweeps finish, and the worst that Newton's method leaves.
struct Shares {
  int newton = 0, sweeps = 0;
  double worst = 0;
};

Shares tables(unsigned seed, int trials, bool convex) {
  RandomProblems problems(seed);
  Shares out;
  for (int trial = 0; trial < trials; ++trial) {
    const double mass = trial % 2 ? 1 : 1000;
    const ContactProblem problem = problems.table(3 + trial % 30, mass, problems.between(0.1, 1.2));
    const LaneSolution newton = LaneProblem(problem).solve(contact_law(convex), kShipped);
    const LaneSolution sweeps = LaneProblem(problem).solve(contact_law(convex), 60, 1e-6);
    // By the independent measure, not by the solver's own.
    out.newton += newton.measured.own < 1e-5;
    out.sweeps += sweeps.measured.own < 1e-5;
    out.worst = std::max(out.worst, newton.measured.own);
  }
  return out;
}

/// A ball of 0.1 kg between ground and wall, which both ask it to part at `apart`, m/s, from each other's direction:
/// the line through its two points lies in both cones, and along it they cannot move.
ContactProblem jam(double apart, double mu) {
  const double r = 0.02, inertia = 0.4 * 0.1 * r * r;
  Eigen::Matrix<double, 6, 6> J;
  Eigen::Matrix<double, 6, 1> inverse;
  inverse << 1 / inertia, 1 / inertia, 1 / inertia, 10, 10, 10;
  const Eigen::Vector3d ground{0, 0, -r}, wall{r, 0, 0};
  const auto row = [&](int i, const Eigen::Vector3d& at, const Eigen::Vector3d& along) {
    J.row(i) << at.cross(along).transpose(), along.transpose();
  };
  row(0, ground, Eigen::Vector3d::UnitZ()), row(1, ground, Eigen::Vector3d::UnitX());
  row(2, ground, Eigen::Vector3d::UnitY());
  row(3, wall, -Eigen::Vector3d::UnitX()), row(4, wall, Eigen::Vector3d::UnitY());
  row(5, wall, -Eigen::Vector3d::UnitZ());
  ContactProblem out;
  out.A = J * inverse.asDiagonal() * J.transpose();
  out.b = Eigen::VectorXd::Zero(6);
  out.b[0] = out.b[3] = -apart;
  out.mu = Eigen::VectorXd::Constant(2, mu);
  return out;
}

// With friction the ball cannot leave both at once unless it slides; what asks it to is met by a spring, not by
// impulses that squeeze it: at most the speed asked for over the spring's compliance.
TEST(Newton, JamsHaveBoundedImpulses) {
  for (const double mu : {1.01, 1.2, 1.5, 10.0}) {
    for (const double apart : {1e-4, 0.05}) {
      const ContactProblem problem = jam(apart, mu);
      const LaneSolution lanes = LaneProblem(problem).solve(contact_law(false), kShipped);
      EXPECT_LE(lanes.residual, 1e-6) << mu << " " << apart;
      EXPECT_LT(lanes.lambda.norm(), 2 * apart / (1e-2 * problem.A.diagonal().minCoeff())) << mu << " " << apart;
    }
  }
}

TEST(Newton, ManyPointsUnderOneBodyConverge) {
  for (bool convex : {false, true}) {
    const int count = trials(2000);
    const Shares found = tables(convex ? 15 : 14, count, convex);
    EXPECT_GE(found.newton, count - count / 1000) << "sweeps: " << found.sweeps << ", worst " << found.worst;
  }
}

}  // namespace
}  // namespace graze::test
