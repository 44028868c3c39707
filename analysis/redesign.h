#pragma once
// The mathematics of redesign (§5.2): slopes of witnesses with respect to the design, and the change of the design that
// brings violated limits back. Variables are shares of the way from their lower bound (0) to their upper bound (1), so
// that a step of each is as large as a step of any other, and lengths and masses need no weights.

#include <Eigen/Core>
#include <vector>

namespace graze {

/// A slope that is none: on its two sides the witness changes differently.
struct Kink {
  int limit = 0, variable = 0;
  double ahead = 0, behind = 0;  // one-sided slopes
  bool contacts = false;         // the contact sequence changes, too
};

/// d limit / d variable, [limit][variable], with what is no derivative.
struct LimitSlopes {
  Eigen::MatrixXd J;
  std::vector<Kink> kinks;
};

/// Values of all limits (NaN: not known there) beside one variable's own value.
struct Beside {
  double step = 0;                    // of the variable, > 0; both sides
  std::vector<double> ahead, behind;  // per limit
  bool contacts = false;              // another contact sequence on one of the sides
};

/// How far two one-sided slopes may lie apart, as a share of the larger one, before they are a kink. A smooth witness
/// has step times curvature, 1e-3 or so; one that changes its part or its contacts has anything.
inline constexpr double kSmooth = 0.2;

/// Central differences. At a kink the slope is the smaller one of both sides if they agree in sign, else 0: no step
/// follows what only one side has. `scales`: of each limit; a kink counts if it would matter by a hundredth of it over
/// the whole way of the variable. A side that is not known leaves the other one's slope.
LimitSlopes slopes(const std::vector<double>& here, const std::vector<Beside>& beside,
                   const std::vector<double>& scales);

/// A sum that no step changes: that of weights[k] x[variables[k]]. No variable is in two of them; no weight is 0.
struct StepTotal {
  std::vector<Eigen::Index> variables;
  std::vector<double> weights;
};

/// A design and what is known of it.
struct DesignPoint {
  Eigen::VectorXd x;        // [variable], each within 0 and 1
  Eigen::VectorXd margins;  // [limit]
  Eigen::VectorXd scales;   // [limit], > 0
  const LimitSlopes* slopes = nullptr;
  std::vector<StepTotal> totals = {};
};

/// What a limit is brought to, as a share of its scale: a little above 0, which steps of a part of the way never reach.
inline constexpr double kAim = 0.05;

/// -alpha J^+ l over the limits that are violated (Algorithm 2), within the bounds: a variable that would leave them
/// stops there, and the others take over its part. With totals: the shortest of the changes that leave them, (J P)^+ in
/// place of J^+ with P the projection onto these; it goes as far as the next bound, and on without that variable.
Eigen::VectorXd plain_step(const DesignPoint& at, double alpha);

/// The change d with |d_i| <= radius, within the bounds, that minimises the sum of squares of what all limits would
/// lack (in their scales, by their slopes) plus `weight` |d|^2. Limits that hold now and would not then count, too. By
/// sweeps: coordinate descent, in which variables of a total move in pairs, one up and one down (whatever change leaves
/// the total is a sum of such ones that go the same ways), then all variables that stand at no bound together, to where
/// the function is least for the limits that lack. It is convex and has a continuous slope: where no sweep changes
/// anything any more it is least.
Eigen::VectorXd damped_step(const DesignPoint& at, double radius, double weight = 1e-3);

/// What limits lack: the sum over limits of max(0, -margin) in their scales. Limits of unknown margin count as holding.
double lack(const Eigen::VectorXd& margins, const Eigen::VectorXd& scales);

}  // namespace graze
