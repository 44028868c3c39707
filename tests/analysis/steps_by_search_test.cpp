// Steps of a redesign against other roads to the same answer: the conditions that a least function satisfies, and
// random changes, none of which does better.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "analysis/redesign.h"

namespace graze {
namespace {

struct RandomDesign {
  LimitSlopes found;
  DesignPoint at;
};

/// Up to five limits, some of them violated, and variables anywhere within their bounds, now and then at one.
RandomDesign random_design(std::mt19937_64& random, Eigen::Index limits, Eigen::Index variables) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> within(0, 1);
  RandomDesign out;
  out.found.J.resize(limits, variables);
  out.at.x.resize(variables);
  out.at.margins.resize(limits);
  out.at.scales.resize(limits);
  for (Eigen::Index k = 0; k < limits; ++k) {
    for (Eigen::Index i = 0; i < variables; ++i) out.found.J(k, i) = normal(random);
    out.at.margins[k] = 0.5 * normal(random);
    out.at.scales[k] = 0.2 + within(random);
  }
  for (Eigen::Index i = 0; i < variables; ++i) {
    out.at.x[i] = within(random);
    if (random() % 8 == 0) out.at.x[i] = std::round(out.at.x[i]);
  }
  return out;
}

// Claim: where no bound is near, the plain step meets alpha times the aim of every violated limit exactly, and is
// shorter than any other change that does (which differs from it by a change of no effect on them).
TEST(StepsBySearch, ThePlainStepIsShortest) {
  std::mt19937_64 random(183);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 60; ++round) {
    RandomDesign design = random_design(random, 2, 5);
    design.at.slopes = &design.found;
    design.at.x.setConstant(0.5);
    design.at.margins *= 0.02;
    design.at.scales.setConstant(0.01);
    const double alpha = 0.25 + 0.25 * static_cast<double>(round % 4);
    const Eigen::VectorXd step = plain_step(design.at, alpha);
    if (step.cwiseAbs().maxCoeff() > 0.45) continue;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index k = 0; k < 2; ++k) {
      if (design.at.margins[k] >= 0) continue;
      rows.push_back(k);
      const double wanted = alpha * (kAim * 0.01 - design.at.margins[k]);
      EXPECT_NEAR(design.found.J.row(k).dot(step), wanted, 1e-12);
    }
    if (rows.empty()) {
      EXPECT_EQ(step.norm(), 0) << "nothing is violated";
      continue;
    }
    const Eigen::MatrixXd J = design.found.J(rows, Eigen::all);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::VectorXd idle(5);
      for (Eigen::Index i = 0; i < 5; ++i) idle[i] = normal(random);
      idle -= J.transpose() * (J * J.transpose()).inverse() * (J * idle);
      EXPECT_GE((step + 0.1 * idle).norm(), step.norm() - 1e-12);
      EXPECT_NEAR(step.dot(idle), 0, 1e-9) << "the shortest change has no idle part";
    }
  }
}

// Claim: whatever the slopes and however far it is, no step leaves the bounds, a variable at a bound is not pushed
// through it, and totals stay.
TEST(StepsBySearch, StepsStayWithinBounds) {
  std::mt19937_64 random(184);
  for (int round = 0; round < 300; ++round) {
    RandomDesign design = random_design(random, 3, 4);
    design.at.slopes = &design.found;
    design.at.margins *= 20;
    if (round % 2 == 1) design.at.totals = {{{0, 1}, {1, 3}}, {{2, 3}, {2, 2}}};
    for (const Eigen::VectorXd& step :
         {plain_step(design.at, 1), damped_step(design.at, 0.5), damped_step(design.at, 2)}) {
      EXPECT_GE((design.at.x + step).minCoeff(), -1e-12);
      EXPECT_LE((design.at.x + step).maxCoeff(), 1 + 1e-12);
      if (round % 2 == 0) continue;
      EXPECT_NEAR(step[0] + 3 * step[1], 0, 1e-9);
      EXPECT_NEAR(step[2] + step[3], 0, 1e-9);
    }
  }
}

// Claim: slopes of polynomials of second degree are exact by central differences, one-sided ones are off by the
// curvature times the step, and a slope that jumps is the smaller of both sides, or none if they point in different
// directions.
TEST(StepsBySearch, SlopesOfKnownFunctions) {
  std::mt19937_64 random(185);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 100; ++round) {
    const double a = 1 + std::abs(normal(random)), b = 0.2 * normal(random), x = normal(random), h = 1e-2;
    const auto f = [&](double at) { return (5 + a) * at + b * at * at; };
    const LimitSlopes both = slopes({f(x)}, {{h, {f(x + h)}, {f(x - h)}, false}}, {1});
    EXPECT_NEAR(both.J(0, 0), 5 + a + 2 * b * x, 1e-9);
    EXPECT_TRUE(both.kinks.empty());
    const LimitSlopes ahead = slopes({f(x)}, {{h, {f(x + h)}, {std::nan("")}, false}}, {1});
    EXPECT_NEAR(ahead.J(0, 0), 5 + a + 2 * b * x + b * h, 1e-9);
    const double left = normal(random), right = normal(random);
    const bool kinked = std::abs(left - right) > kSmooth * std::max(std::abs(left), std::abs(right)) + 0.02;
    const LimitSlopes jump = slopes({0}, {{h, {right * h}, {-left * h}, round % 2 == 0}}, {1});
    if (!kinked) continue;
    const double smaller = std::abs(left) < std::abs(right) ? left : right;
    EXPECT_NEAR(jump.J(0, 0), left * right > 0 ? smaller : 0, 1e-12);
    ASSERT_EQ(jump.kinks.size(), 1u);
    EXPECT_NEAR(jump.kinks[0].ahead, right, 1e-9);
    EXPECT_NEAR(jump.kinks[0].behind, left, 1e-9);
    EXPECT_EQ(jump.kinks[0].contacts, round % 2 == 0);
  }
}

// Claim: what is lacking is a sum over the violated limits alone, in their scales; NaN counts as holding.
TEST(StepsBySearch, LackIsASum) {
  Eigen::VectorXd margins(4), scales(4);
  margins << -2, 5, std::nan(""), -0.5;
  scales << 4, 1, 1, 0.25;
  EXPECT_DOUBLE_EQ(lack(margins, scales), 0.5 + 2);
  EXPECT_EQ(lack(Eigen::VectorXd(0), Eigen::VectorXd(0)), 0);
  EXPECT_EQ(lack(margins.segment(1, 2), scales.segment(1, 2)), 0);
}

}  // namespace
}  // namespace graze
