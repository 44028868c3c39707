// Claims: on random contact problems the lanes' solver finds the impulses that Lemke's algorithm and principal pivoting
// find where the solution is unique, satisfies Signorini, Coulomb and maximum dissipation where a pyramid could only
// come near them, and finds the least of the convex model; its own measure of residuals is the reference's.
//
// Tolerances: sweeps end when no velocity changes by more than kSweep. A sweep contracts the error by some rho < 1, so
// what is left is kSweep rho / (1 - rho); 1 / (1 - rho) stays below kSlow for the matrices drawn here (their condition
// number is below 100 by construction). Impulses are off by that over the least eigenvalue of A.

#include <gtest/gtest.h>

#include <numbers>

#include "engine/contact/lcp.h"
#include "tests/engine/contact/random_problems.h"

namespace graze::test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSweep = 1e-10;  // m/s
constexpr double kSlow = 1e3;
constexpr int kMost = 3000;

double least_eigenvalue(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

// Without friction the normal impulses solve a positive definite LCP: one solution, which pivoting finds exactly.
TEST(SolverAgainstReference, FrictionlessImpulsesAreThoseOfPivoting) {
  RandomProblems numbers(1);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 8;
    const ContactProblem problem = numbers.regular(n, 0);
    MatrixXd M(n, n);
    VectorXd q(n);
    for (int i = 0; i < n; ++i) {
      q[i] = problem.b[3 * i];
      for (int j = 0; j < n; ++j) M(i, j) = problem.A(3 * i, 3 * j);
    }
    const LcpSolution exact = solve_ppm(M, q);
    ASSERT_TRUE(exact.solved);
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(trial % 2 == 1), kMost, kSweep);
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(lanes.lambda[3 * i], exact.z[i], kSweep * kSlow / least_eigenvalue(M)) << trial;
      EXPECT_EQ(lanes.lambda.segment<2>(3 * i + 1).norm(), 0) << trial;
    }
  }
}

// In the plane (no motion and no coupling along t) the pyramid of two edges is the cone: Lemke's impulses are ours.
// With mu = 0.2 the solution is unique here: friction is too weak to jam well-conditioned A.
TEST(SolverAgainstReference, PlanarFrictionImpulsesAreThoseOfLemke) {
  RandomProblems numbers(2);
  int slips = 0, sticks = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 6;
    ContactProblem problem = numbers.regular(n, 0.2);
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
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(false), kMost, kSweep);
    EXPECT_LT((lanes.lambda - exact).norm(), 1e-9 + kSweep * kSlow / least_eigenvalue(problem.A)) << trial;
    for (int i = 0; i < n; ++i) {
      const double normal = exact[3 * i], tangent = std::abs(exact[3 * i + 1]);
      if (normal > 1e-6) ++(tangent > 0.2 * normal - 1e-9 ? slips : sticks);
    }
  }
  EXPECT_GT(slips, 50);
  EXPECT_GT(sticks, 5);
}

// In space a pyramid of k edges misses the cone by up to 1 - cos(pi / k) of the impulses, and so do Lemke's residuals;
// ours are those of the sweeps.
TEST(SolverAgainstReference, SpatialResidualsAreBelowThoseOfAManySidedPyramid) {
  RandomProblems numbers(3);
  int better = 0, trials = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 1 + trial % 4;
    const ContactProblem problem = numbers.regular(n, 0.5);
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(false), kMost, kSweep);
    const ContactResiduals ours = contact_residuals(problem.A, problem.b, problem.mu, lanes.lambda);
    EXPECT_LT(ours.signorini, kSweep * kSlow) << trial;
    EXPECT_LT(ours.coulomb, 1e-12) << trial;
    EXPECT_LT(ours.dissipation, kSweep * kSlow) << trial;
    const ContactLcp lcp = contact_lcp(problem, 16);
    const LcpSolution lemke = solve_lemke(lcp.M, lcp.q);
    if (!lemke.solved || lanes.lambda.norm() == 0) continue;
    const VectorXd theirs = lcp.impulses(lemke.z);
    const ContactResiduals pyramid = contact_residuals(problem.A, problem.b, problem.mu, theirs);
    // The pyramid's error in lambda_t is at most mu lambda_n pi / k in direction, seen through A's largest entries.
    const double allowed =
        0.5 * theirs.cwiseAbs().maxCoeff() * std::numbers::pi / 16 * problem.A.cwiseAbs().rowwise().sum().maxCoeff();
    EXPECT_LT((lanes.lambda - theirs).norm() * least_eigenvalue(problem.A), n * allowed + 1e-7) << trial;
    ++trials;
    better += ours.dissipation <= pyramid.dissipation + 1e-9;
  }
  EXPECT_GT(trials, 30);
  EXPECT_EQ(better, trials);
}

// The residuals that the kernel measures are the reference's, also far from a solution.
TEST(SolverAgainstReference, MeasuresResidualsAsTheReference) {
  RandomProblems numbers(4);
  for (int trial = 0; trial < 50; ++trial) {
    const ContactProblem problem = numbers.regular(1 + trial % 5, 0.7);
    const LaneSolution lanes = LaneProblem(problem).solve(contact_law(false), 1, kSweep);
    const ContactResiduals reference = contact_residuals(problem.A, problem.b, problem.mu, lanes.lambda);
    EXPECT_NEAR(lanes.measured.signorini, reference.signorini, 1e-9);
    EXPECT_NEAR(lanes.measured.coulomb, reference.coulomb, 1e-9);
    EXPECT_NEAR(lanes.measured.dissipation, reference.dissipation, 1e-9);
  }
}

// The convex model: no impulse on the cones has less energy 1/2 lambda^T A lambda + lambda^T b, and the gradient lies
// in the dual cones: u_n >= mu |u_t| with equality where a contact slides (so it opens as it slides: Anitescu 2006).
TEST(SolverAgainstReference, ConvexImpulsesHaveTheLeastEnergy) {
  RandomProblems numbers(5);
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 1 + trial % 4;
    const double mu = 0.8;
    const ContactProblem problem = numbers.regular(n, mu);
    const VectorXd x = LaneProblem(problem).solve(contact_law(true), kMost, kSweep).lambda;
    const VectorXd u = problem.A * x + problem.b;
    const double close = kSweep * kSlow;
    for (int i = 0; i < n; ++i) {
      const double slide = u.segment<2>(3 * i + 1).norm();
      EXPECT_LE(x.segment<2>(3 * i + 1).norm(), mu * x[3 * i] + 1e-12) << trial;
      EXPECT_GE(u[3 * i], mu * slide - close) << trial;
    }
    EXPECT_NEAR(x.dot(u), 0, n * close * (1 + x.norm())) << trial;
    const auto energy = [&](const VectorXd& y) { return 0.5 * y.dot(problem.A * y) + y.dot(problem.b); };
    for (int k = 0; k < 50; ++k) {
      VectorXd y = x + 0.1 * numbers.vector(3 * n);
      for (int i = 0; i < n; ++i) y[3 * i] = std::max(y[3 * i], y.segment<2>(3 * i + 1).norm() / mu);
      EXPECT_GE(energy(y), energy(x) - close * (1 + x.norm())) << trial;
    }
  }
}

// One contact alone always has a solution, and every visit finds one: any A, any friction, any start of the slip rate.
TEST(SolverAgainstReference, OneContactIsSolvedAtAnyFriction) {
  RandomProblems numbers(6);
  for (int trial = 0; trial < 500; ++trial) {
    ContactProblem problem = numbers.regular(1, trial % 2 ? 10 : 1);
    problem.A -= 0.99 * MatrixXd::Identity(3, 3);  // as badly conditioned as 1 : 1000
    for (bool convex : {false, true}) {
      LaneProblem lanes(problem);
      const LaneSolution solution = lanes.solve(contact_law(convex), 200, 1e-9);
      EXPECT_LT(solution.measured.own, 1e-6) << trial << " " << convex;
    }
  }
}

}  // namespace
}  // namespace graze::test
