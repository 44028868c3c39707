#include "analysis/redesign.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace graze {
namespace {

constexpr double kKinkMatters = 0.01;  // of a limit's scale, over the whole way of a variable
constexpr int kMostSweeps = 2000;      // of coordinate descent
constexpr double kSettled = 1e-12;     // largest change of a sweep
constexpr int kHalvings = 60;          // of a way: what is left is rounding

/// The slope of one limit beside one variable; says so if it is a kink.
double slope_of(double here, double ahead, double behind, double step, double scale, bool& kink) {
  const double up = (ahead - here) / step, down = (here - behind) / step;
  kink = false;
  if (std::isnan(up) && std::isnan(down)) return 0;
  if (std::isnan(up)) return down;
  if (std::isnan(down)) return up;
  const double apart = std::abs(up - down);
  kink = apart > kSmooth * std::max(std::abs(up), std::abs(down)) && apart > kKinkMatters * scale;
  if (!kink) return 0.5 * (up + down);
  if (up * down <= 0) return 0;
  return std::abs(up) < std::abs(down) ? up : down;
}

/// By how much each limit falls short of what it is brought to, in its scale.
Eigen::VectorXd short_of_aim(const DesignPoint& at) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(at.margins.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    if (!std::isnan(at.margins[k])) out[k] = kAim - at.margins[k] / at.scales[k];
  }
  return out;
}

Eigen::MatrixXd scaled(const DesignPoint& at) { return at.scales.cwiseInverse().asDiagonal() * at.slopes->J; }

/// Projects a change of the variables `free`, all others at rest, onto those that leave every total.
void leave_totals(const std::vector<StepTotal>& totals, const std::vector<char>& free, Eigen::MatrixXd& change) {
  for (const StepTotal& total : totals) {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(change.cols());
    double squares = 0;
    for (std::size_t k = 0; k < total.variables.size(); ++k) {
      if (!free[static_cast<std::size_t>(total.variables[k])]) continue;
      sum += total.weights[k] * change.row(total.variables[k]);
      squares += total.weights[k] * total.weights[k];
    }
    for (std::size_t k = 0; k < total.variables.size(); ++k) {
      if (!free[static_cast<std::size_t>(total.variables[k])]) continue;
      change.row(total.variables[k]) -= total.weights[k] / squares * sum;
    }
  }
}

/// What of a change can be made before a variable comes to a bound; those that do are free no longer.
double way_to_bounds(const Eigen::VectorXd& x, const Eigen::VectorXd& change, std::vector<char>& free) {
  Eigen::VectorXd part = Eigen::VectorXd::Constant(x.size(), std::numeric_limits<double>::infinity());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (change[i] != 0) part[i] = std::max(0.0, ((change[i] > 0 ? 1 : 0) - x[i]) / change[i]);
  }
  const double least = part.minCoeff();
  if (least >= 1) return 1;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (part[i] <= least) free[static_cast<std::size_t>(i)] = false;
  }
  return least;
}

/// Of the largest slope: what is less is rounding, by which no step may divide.
constexpr double kNoSlope = 1e-10;

/// plain_step() with totals.
Eigen::VectorXd plain_step_within(const DesignPoint& at, double alpha) {
  const Eigen::MatrixXd all = scaled(at);
  const Eigen::VectorXd wanted = short_of_aim(at);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < all.rows(); ++k) {
    if (at.margins[k] < 0) rows.push_back(k);
  }
  std::vector<char> free(static_cast<std::size_t>(all.cols()), true);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(all.cols());
  for (Eigen::Index round = 0; round < all.cols() && !rows.empty(); ++round) {
    Eigen::MatrixXd slopes = all(rows, Eigen::all).transpose();  // [variable][limit]: P is its own transpose
    for (Eigen::Index i = 0; i < all.cols(); ++i) {
      if (!free[static_cast<std::size_t>(i)]) slopes.row(i).setZero();
    }
    leave_totals(at.totals, free, slopes);
    slopes = (slopes.array().abs() > kNoSlope * all.cwiseAbs().maxCoeff()).select(slopes, 0);
    const Eigen::VectorXd rest = alpha * wanted(rows) - all(rows, Eigen::all) * step;
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(kNoSlope);
    decomposition.compute(slopes.transpose());
    Eigen::MatrixXd change = decomposition.solve(rest);
    leave_totals(at.totals, free, change);  // but for rounding it does
    const double part = way_to_bounds(at.x + step, change, free);
    step += part * change;
    if (part == 1) break;
  }
  return step;
}

/// What damped_step() changes, and what all limits lack with it.
struct Descent {
  Eigen::MatrixXd J;
  Eigen::VectorXd lacks, step, low, high;
  double weight = 0;
};

/// Moves two variables of a total against each other to where the function is least. Returns the larger change.
double descend_pair(Descent& at, Eigen::Index i, double weight_i, Eigen::Index j, double weight_j) {
  const double size = std::hypot(weight_i, weight_j), a = weight_j / size, b = -weight_i / size;
  const Eigen::VectorXd along = a * at.J.col(i) + b * at.J.col(j);
  const double slope = at.weight * (a * at.step[i] + b * at.step[j]) - along.dot(at.lacks.cwiseMax(0));
  double by = -slope / (along.squaredNorm() + at.weight);
  for (const auto& [k, part] : {std::pair(i, a), std::pair(j, b)}) {
    const double down = (at.low[k] - at.step[k]) / part, up = (at.high[k] - at.step[k]) / part;
    by = std::clamp(by, std::min({down, up, 0.0}), std::max({down, up, 0.0}));
  }
  at.step[i] += by * a, at.step[j] += by * b;
  at.lacks -= by * along;
  return std::abs(by);
}

double descend_total(Descent& at, const StepTotal& total) {
  double changed = 0;
  for (std::size_t k = 0; k < total.variables.size(); ++k) {
    for (std::size_t l = 0; l < k; ++l) {
      const double by = descend_pair(at, total.variables[k], total.weights[k], total.variables[l], total.weights[l]);
      changed = std::max(changed, by);
    }
  }
  return changed;
}

/// The change of the variables `free` to where the function is least for the limits that lack now, as far as totals let
/// them. Small problems: normal equations with a multiplier for each total.
Eigen::VectorXd face_change(const Descent& at, const std::vector<Eigen::Index>& free,
                            const std::vector<StepTotal>& totals) {
  std::vector<Eigen::Index> lacking;
  for (Eigen::Index k = 0; k < at.lacks.size(); ++k) {
    if (at.lacks[k] > 0) lacking.push_back(k);
  }
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(totals.size()), at.step.size());
  std::vector<Eigen::Index> held;  // totals with free variables
  for (std::size_t t = 0; t < totals.size(); ++t) {
    const auto row = static_cast<Eigen::Index>(t);
    for (std::size_t k = 0; k < totals[t].variables.size(); ++k) {
      sums(row, totals[t].variables[k]) = totals[t].weights[k];
    }
    sums.row(row) /= sums.row(row).norm();
    if (!sums(row, free).isZero(0)) held.push_back(row);
  }
  const Eigen::MatrixXd J = at.J(lacking, free), C = sums(held, free);
  const Eigen::Index n = J.cols(), m = C.rows();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + m, n + m);
  K.topLeftCorner(n, n) = J.transpose() * J + at.weight * Eigen::MatrixXd::Identity(n, n);
  K.topRightCorner(n, m) = C.transpose();
  K.bottomLeftCorner(m, n) = C;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n + m);
  right.head(n) = J.transpose() * at.lacks(lacking) - at.weight * at.step(free);
  const Eigen::VectorXd solved = K.colPivHouseholderQr().solve(right);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(at.step.size());
  change(free) = solved.head(n);
  return change;
}

/// The derivative of the function along a change, after a part of it. It only grows with the part.
double slope_along(const Descent& at, const Eigen::VectorXd& change, const Eigen::VectorXd& along, double part) {
  return at.weight * change.dot(at.step + part * change) - along.dot((at.lacks - part * along).cwiseMax(0));
}

/// Where on the way to `most` of a change the function is least.
double least_part(const Descent& at, const Eigen::VectorXd& change, const Eigen::VectorXd& along, double most) {
  if (!(slope_along(at, change, along, most) > 0)) return most;
  double low = 0, high = most;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (slope_along(at, change, along, middle) > 0 ? high : low) = middle;
  }
  return low;
}

/// Moves all variables that stand at no bound to where the function is least for them together; one that comes to its
/// bound stays there, and the others go on. Single variables and pairs alone creep where limits have nearly the same
/// slopes: thousands of sweeps did not reach the least value. Returns the largest change.
double descend_face(Descent& at, const std::vector<StepTotal>& totals) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < at.step.size(); ++i) {
    if (at.step[i] > at.low[i] && at.step[i] < at.high[i]) free.push_back(i);
  }
  double changed = 0;
  for (Eigen::Index round = 0; round < at.J.rows() + at.J.cols() && !free.empty(); ++round) {
    const Eigen::VectorXd change = face_change(at, free, totals), along = at.J * change;
    if (!(slope_along(at, change, along, 0) < 0)) break;
    double most = 1;
    Eigen::Index hit = -1;
    for (const Eigen::Index i : free) {
      if (change[i] == 0) continue;
      const double part = ((change[i] > 0 ? at.high : at.low)[i] - at.step[i]) / change[i];
      if (part < most) most = part, hit = i;
    }
    const double part = least_part(at, change, along, most);
    if (part < most) hit = -1;
    Eigen::VectorXd next = (at.step + part * change).cwiseMax(at.low).cwiseMin(at.high);
    if (hit >= 0) {
      next[hit] = (change[hit] > 0 ? at.high : at.low)[hit];
      std::erase(free, hit);
    }
    const double by = (next - at.step).cwiseAbs().maxCoeff();
    at.lacks -= at.J * (next - at.step);
    at.step = next;
    changed = std::max(changed, by);
    if (hit < 0 && (part == 1 || by < kSettled)) break;
  }
  return changed;
}

}  // namespace

LimitSlopes slopes(const std::vector<double>& here, const std::vector<Beside>& beside,
                   const std::vector<double>& scales) {
  LimitSlopes out;
  out.J.setZero(static_cast<Eigen::Index>(here.size()), static_cast<Eigen::Index>(beside.size()));
  for (std::size_t i = 0; i < beside.size(); ++i) {
    const Beside& one = beside[i];
    for (std::size_t k = 0; k < here.size(); ++k) {
      bool kink = false;
      const auto row = static_cast<Eigen::Index>(k), column = static_cast<Eigen::Index>(i);
      out.J(row, column) = slope_of(here[k], one.ahead[k], one.behind[k], one.step, scales[k], kink);
      if (!kink) continue;
      out.kinks.push_back({static_cast<int>(k), static_cast<int>(i), (one.ahead[k] - here[k]) / one.step,
                           (here[k] - one.behind[k]) / one.step, one.contacts});
    }
  }
  return out;
}

Eigen::VectorXd plain_step(const DesignPoint& at, double alpha) {
  if (!at.totals.empty()) return plain_step_within(at, alpha);
  const Eigen::MatrixXd all = scaled(at);
  const Eigen::VectorXd wanted = short_of_aim(at);
  std::vector<Eigen::Index> rows, free;
  for (Eigen::Index k = 0; k < all.rows(); ++k) {
    if (at.margins[k] < 0) rows.push_back(k);
  }
  for (Eigen::Index i = 0; i < all.cols(); ++i) free.push_back(i);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(all.cols());
  // Variables that reach a bound are set there; the rest is asked again. Each round takes one out at least.
  while (!free.empty() && !rows.empty()) {
    const Eigen::VectorXd rest = alpha * wanted(rows) - all(rows, Eigen::all) * step;
    const Eigen::VectorXd more = all(rows, free).completeOrthogonalDecomposition().solve(rest);
    std::vector<Eigen::Index> still;
    for (std::size_t j = 0; j < free.size(); ++j) {
      const Eigen::Index i = free[j];
      const double to = at.x[i] + more[static_cast<Eigen::Index>(j)];
      if (to >= 0 && to <= 1) {
        still.push_back(i);
      } else {
        step[i] = std::clamp(to, 0.0, 1.0) - at.x[i];
      }
    }
    if (still.size() == free.size()) {
      for (std::size_t j = 0; j < free.size(); ++j) step[free[j]] = more[static_cast<Eigen::Index>(j)];
      break;
    }
    free = std::move(still);
  }
  return step;
}

Eigen::VectorXd damped_step(const DesignPoint& at, double radius, double weight) {
  Descent now{scaled(at),
              short_of_aim(at),
              Eigen::VectorXd::Zero(at.x.size()),
              (-at.x).cwiseMax(-radius),
              (1 - at.x.array()).cwiseMin(radius).matrix(),
              weight};
  std::vector<char> single(static_cast<std::size_t>(at.x.size()), true);
  for (const StepTotal& total : at.totals) {
    for (const Eigen::Index i : total.variables) single[static_cast<std::size_t>(i)] = false;
  }
  // Of all limits, also of those that hold: then no step goes beyond the least of the function along a variable.
  const Eigen::VectorXd curvature = now.J.colwise().squaredNorm().transpose().array() + weight;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double changed = 0;
    for (Eigen::Index i = 0; i < now.J.cols(); ++i) {
      if (!single[static_cast<std::size_t>(i)]) continue;
      const double slope = weight * now.step[i] - now.J.col(i).dot(now.lacks.cwiseMax(0));
      const double to = std::clamp(now.step[i] - slope / curvature[i], now.low[i], now.high[i]), by = to - now.step[i];
      if (by == 0) continue;
      now.step[i] = to;
      now.lacks -= by * now.J.col(i);
      changed = std::max(changed, std::abs(by));
    }
    for (const StepTotal& total : at.totals) changed = std::max(changed, descend_total(now, total));
    changed = std::max(changed, descend_face(now, at.totals));
    if (changed < kSettled) break;
  }
  return now.step;
}

double lack(const Eigen::VectorXd& margins, const Eigen::VectorXd& scales) {
  double out = 0;
  for (Eigen::Index k = 0; k < margins.size(); ++k) {
    if (margins[k] < 0) out -= margins[k] / scales[k];
  }
  return out;
}

}  // namespace graze
