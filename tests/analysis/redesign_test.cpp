// Claim: slopes are derivatives where there are any and say so where there are none, and steps bring violated limits
// back without leaving the bounds.
#include "analysis/redesign.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace graze {
namespace {

using Vector = Eigen::VectorXd;

Vector vec(std::initializer_list<double> values) {
  Vector out(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

LimitSlopes exact(const Eigen::MatrixXd& J) { return {J, {}}; }

// The central difference of sin at 0.3 misses cos(0.3) by h^2 / 6 cos(0.3).
TEST(Redesign, SlopesAreCentralDifferences) {
  const double h = 1e-3, x = 0.3;
  const LimitSlopes out = slopes({std::sin(x)}, {{h, {std::sin(x + h)}, {std::sin(x - h)}, false}}, {1});
  EXPECT_TRUE(out.kinks.empty());
  EXPECT_NEAR(out.J(0, 0), std::cos(x), 1.01 * h * h / 6);
}

// |x| at 0 has no slope; max(x, 3 x) has 1 behind and 3 ahead, of which the smaller is taken; both are told, with what
// became of the contacts.
TEST(Redesign, KinksAreToldAndNotFollowed) {
  const LimitSlopes out = slopes({0, 0}, {{0.1, {0.1, 0.3}, {0.1, -0.1}, true}}, {1, 1});
  EXPECT_EQ(out.J(0, 0), 0);
  EXPECT_DOUBLE_EQ(out.J(1, 0), 1);
  ASSERT_EQ(out.kinks.size(), 2u);
  EXPECT_EQ(out.kinks[1].limit, 1);
  EXPECT_DOUBLE_EQ(out.kinks[1].ahead, 3);
  EXPECT_TRUE(out.kinks[1].contacts);
}

// At a bound one side is not known: the other one's slope is what there is.
TEST(Redesign, OneSideWillDo) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const LimitSlopes out = slopes({1}, {{0.1, {1.2}, {none}, false}, {0.1, {none}, {none}, false}}, {1});
  EXPECT_NEAR(out.J(0, 0), 2, 1e-12);
  EXPECT_EQ(out.J(0, 1), 0);
}

// -J^+ l is the shortest change that meets the aim: along (3, 4) / 25 for one limit. Limits that hold are not asked.
TEST(Redesign, PlainStepIsTheShortest) {
  Eigen::MatrixXd J(2, 2);
  J << 3, 4, -100, 0;
  const LimitSlopes found = exact(J);
  const DesignPoint at{vec({0.5, 0.5}), vec({-1, 2}), vec({1, 1}), &found};
  const Vector step = plain_step(at, 0.5);
  EXPECT_NEAR(step[0], 0.5 * (1 + kAim) * 3 / 25, 1e-12);
  EXPECT_NEAR(step[1], 0.5 * (1 + kAim) * 4 / 25, 1e-12);
}

// A variable that would leave its bounds stops there, exactly, and the other one does the rest.
TEST(Redesign, PlainStepStaysWithinBounds) {
  Eigen::MatrixXd J(1, 2);
  J << 1, 1;
  const LimitSlopes found = exact(J);
  const DesignPoint at{vec({0.9, 0.2}), vec({-0.5}), vec({1}), &found};
  const Vector step = plain_step(at, 1);
  EXPECT_DOUBLE_EQ(step[0], 0.1);
  EXPECT_NEAR(step[1], 0.5 + kAim - 0.1, 1e-12);
  const DesignPoint far{vec({0.9, 0.2}), vec({-5}), vec({1}), &found};
  EXPECT_DOUBLE_EQ((far.x + plain_step(far, 1)).minCoeff(), 1);
  EXPECT_DOUBLE_EQ((far.x + plain_step(far, 1)).maxCoeff(), 1);
}

// Far inside the radius, with one limit, the damped step is the plain one less the share that `weight` takes.
TEST(Redesign, DampedStepIsTheRegularisedOne) {
  Eigen::MatrixXd J(1, 2);
  J << 3, 4;
  const LimitSlopes found = exact(J);
  const DesignPoint at{vec({0.5, 0.5}), vec({-1}), vec({1}), &found};
  const double weight = 0.5;
  const Vector step = damped_step(at, 0.4, weight);
  EXPECT_NEAR(step[0], (1 + kAim) * 3 / (25 + weight), 1e-9);
  EXPECT_NEAR(step[1], (1 + kAim) * 4 / (25 + weight), 1e-9);
  EXPECT_LE(damped_step(at, 0.01).cwiseAbs().maxCoeff(), 0.01);
}

// What the plain step breaks, the damped one heeds: the second limit holds by little and falls with the first variable.
TEST(Redesign, DampedStepKeepsWhatHolds) {
  Eigen::MatrixXd J(2, 2);
  J << 1, 0.2, -1, 0;
  const LimitSlopes found = exact(J);
  const DesignPoint at{vec({0.1, 0.1}), vec({-0.1, 0.06}), vec({1, 1}), &found};
  const Vector plain = at.margins + J * plain_step(at, 1), damped = at.margins + J * damped_step(at, 1, 1e-6);
  EXPECT_LT(plain[1], 0);
  EXPECT_GT(damped[0], 0);
  EXPECT_GT(damped[1], 0);
}

TEST(Redesign, LackCountsViolationsInTheirScales) { EXPECT_DOUBLE_EQ(lack(vec({-1, 3, -2}), vec({2, 1, 4})), 1); }

}  // namespace
}  // namespace graze
