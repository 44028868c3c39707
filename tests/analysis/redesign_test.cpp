// Claim: slopes are derivatives where there are any and say so where there are none, and steps bring violated limits
// back without leaving the bounds.
#include "analysis/redesign.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

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

// With a total the plain step is the shortest that leaves it: along the slope's part that leaves it, (-1, 1, 2) / 2.
TEST(Redesign, PlainStepLeavesTotals) {
  Eigen::MatrixXd J(1, 3);
  J << 3, 4, 1;
  const LimitSlopes found = exact(J);
  DesignPoint at{vec({0.5, 0.5, 0.5}), vec({-0.1}), vec({1}), &found, {{{0, 1}, {1, 1}}}};
  const Vector step = plain_step(at, 0.5);
  const double length = 0.5 * (0.1 + kAim) / 1.5;
  EXPECT_NEAR(step[0], -0.5 * length, 1e-12);
  EXPECT_NEAR(step[1], 0.5 * length, 1e-12);
  EXPECT_NEAR(step[2], 1 * length, 1e-12);
}

// A variable that comes to its bound stops there with its partner, and the third one does the rest.
TEST(Redesign, PlainStepLeavesTotalsAtBounds) {
  Eigen::MatrixXd J(1, 3);
  J << 1, 0, 0.5;
  const LimitSlopes found = exact(J);
  DesignPoint at{vec({0.95, 0.5, 0.2}), vec({-0.2}), vec({1}), &found, {{{0, 1}, {1, 2}}}};
  const Vector step = plain_step(at, 1);
  EXPECT_NEAR(step[0], 0.05, 1e-12);
  EXPECT_NEAR(step[0] + 2 * step[1], 0, 1e-12);
  EXPECT_NEAR((J * step)[0], 0.2 + kAim, 1e-12);
  EXPECT_LE((at.x + step).maxCoeff(), 1 + 1e-12);
  at.totals = {{{0, 1, 2}, {1, 1, 1}}};
  at.x = vec({1, 0, 0});
  EXPECT_NEAR(plain_step(at, 1).norm(), 0, 1e-12) << "whatever helps would change the total or leave the bounds";
}

// The damped step with totals: with one limit far inside the radius it is in closed form; else no feasible change near
// it has a lesser value, it keeps the totals and stays within radius and bounds.
TEST(Redesign, DampedStepLeavesTotals) {
  Eigen::MatrixXd one(1, 3);
  one << 3, 4, 1;
  const LimitSlopes slope = exact(one);
  const DesignPoint simple{vec({0.5, 0.5, 0.5}), vec({-0.1}), vec({1}), &slope, {{{0, 1}, {1, 1}}}};
  const double length = (0.1 + kAim) / (1.5 + 0.5);
  EXPECT_NEAR((damped_step(simple, 0.4, 0.5) - length * vec({-0.5, 0.5, 1})).norm(), 0, 1e-9);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto drawn = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return any(random); }));
  };
  for (int trial = 0; trial < 20; ++trial) {
    const LimitSlopes found = exact(drawn(4, 6));
    const DesignPoint at{(0.5 * (drawn(6, 1).array() + 1)).matrix(),
                         drawn(4, 1),
                         vec({1, 1, 1, 1}),
                         &found,
                         {{{0, 2, 4}, {1, 2, -0.5}}, {{1, 5}, {1, 3}}}};
    const double radius = 0.2, weight = 1e-2;
    const auto sum = [](const StepTotal& total, const Vector& d) {
      double out = 0;
      for (std::size_t k = 0; k < total.variables.size(); ++k) out += total.weights[k] * d[total.variables[k]];
      return out;
    };
    const auto value = [&](const Vector& d) {
      return ((kAim - at.margins.array()).matrix() - found.J * d).cwiseMax(0).squaredNorm() + weight * d.squaredNorm();
    };
    const auto fits = [&](const Vector& d) {
      return d.cwiseAbs().maxCoeff() <= radius && (at.x + d).minCoeff() >= 0 && (at.x + d).maxCoeff() <= 1;
    };
    const Vector step = damped_step(at, radius, weight);
    for (const StepTotal& total : at.totals) EXPECT_NEAR(sum(total, step), 0, 1e-12);
    EXPECT_TRUE(fits(step * (1 - 1e-12)));
    for (int k = 0; k < 200; ++k) {
      Vector beside = 1e-3 * drawn(6, 1);
      for (const StepTotal& total : at.totals) {  // the first of each makes up for the others
        beside[total.variables[0]] -= sum(total, beside) / total.weights[0];
      }
      if (!fits(step + beside)) continue;
      EXPECT_GE(value(step + beside), value(step) - 1e-10);
    }
  }
}

/// What damped_step() minimises, half of it.
double damped_value(const DesignPoint& at, double weight, const Vector& d) {
  const Vector lacks = (kAim - at.margins.array() / at.scales.array()).matrix() -
                       Vector(at.scales.cwiseInverse().asDiagonal() * (at.slopes->J * d));
  return 0.5 * (lacks.cwiseMax(0).squaredNorm() + weight * d.squaredNorm());
}

/// How far a change is above the least value at most. The function is convex, so nowhere below its tangent plane, and
/// the plane's least value among the changes that bounds and radius allow is at a corner; of a total no more than at
/// the corner that any multiple of the total, taken off the slope, leads to.
double gap(const DesignPoint& at, double radius, double weight, const Vector& d) {
  const Eigen::MatrixXd J = at.scales.cwiseInverse().asDiagonal() * at.slopes->J;
  const Vector lacks = (kAim - at.margins.array() / at.scales.array()).matrix() - J * d;
  Vector slope = weight * d - J.transpose() * lacks.cwiseMax(0);
  const Vector low = (-at.x).cwiseMax(-radius), high = (1 - at.x.array()).cwiseMin(radius).matrix();
  const auto part = [&](Eigen::Index i, double g) { return std::max(g * (d[i] - low[i]), g * (d[i] - high[i])); };
  double out = 0;
  std::vector<char> single(static_cast<std::size_t>(d.size()), true);
  for (const StepTotal& total : at.totals) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < total.variables.size(); ++j) {
      const double multiple = slope[total.variables[j]] / total.weights[j];
      double sum = 0;
      for (std::size_t k = 0; k < total.variables.size(); ++k) {
        sum += part(total.variables[k], slope[total.variables[k]] - multiple * total.weights[k]);
      }
      least = std::min(least, sum);
    }
    out += least;
    for (const Eigen::Index i : total.variables) single[static_cast<std::size_t>(i)] = false;
  }
  for (Eigen::Index i = 0; i < d.size(); ++i) out += single[static_cast<std::size_t>(i)] ? part(i, slope[i]) : 0;
  return out;
}

// Of random problems, among them such with limits of nearly equal slopes, with far more limits than variables and with
// totals, the damped step is the least there is.
TEST(Redesign, DampedStepIsTheLeastOfAll) {
  std::mt19937 random(11);
  const auto any = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto drawn = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return any(-1, 1); }));
  };
  double worst = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto limits = static_cast<Eigen::Index>(any(1, 13)), variables = static_cast<Eigen::Index>(any(4, 20));
    Eigen::MatrixXd J = drawn(limits, variables);
    if (trial % 3 == 0) J = (drawn(limits, 1) * drawn(1, variables) + 1e-2 * J).eval();
    J *= std::pow(10, any(-1, 1.5));
    const LimitSlopes found = exact(J);
    DesignPoint at{drawn(variables, 1).cwiseMax(-0.9).cwiseMin(0.9) / 1.8 + Vector::Constant(variables, 0.5),
                   drawn(limits, 1), drawn(limits, 1).cwiseAbs().array() + 0.3, &found};
    if (trial % 2 == 0) at.totals = {{{0, 2, 3}, {any(0.5, 4), any(0.5, 4), any(-4, -0.5)}}};
    const double radius = any(0.05, 0.5), weight = 1e-3;
    const Vector step = damped_step(at, radius, weight);
    const double start = damped_value(at, weight, Vector::Zero(variables));
    worst = std::max(worst, gap(at, radius, weight, step) / std::max(start, 1e-3));
  }
  EXPECT_LT(worst, 1e-9) << "as a share of what the function is without a step";
}

TEST(Redesign, LackCountsViolationsInTheirScales) { EXPECT_DOUBLE_EQ(lack(vec({-1, 3, -2}), vec({2, 1, 4})), 1); }

}  // namespace
}  // namespace graze
