#include "analysis/redesign.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

namespace graze {
namespace {

constexpr double kKinkMatters = 0.01;  // of a limit's scale, over the whole way of a variable
constexpr int kMostSweeps = 2000;      // of coordinate descent
constexpr double kSettled = 1e-12;     // largest change of a sweep

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
  const Eigen::MatrixXd J = scaled(at);
  Eigen::VectorXd lacks = short_of_aim(at);  // kept up with the step
  Eigen::VectorXd step = Eigen::VectorXd::Zero(J.cols());
  // Of all limits, also of those that hold: then no step goes beyond the least of the function along a variable.
  const Eigen::VectorXd curvature = J.colwise().squaredNorm().transpose().array() + weight;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double changed = 0;
    for (Eigen::Index i = 0; i < J.cols(); ++i) {
      const double slope = weight * step[i] - J.col(i).dot(lacks.cwiseMax(0));
      const double low = std::max(-radius, -at.x[i]), high = std::min(radius, 1 - at.x[i]);
      const double to = std::clamp(step[i] - slope / curvature[i], low, high), by = to - step[i];
      if (by == 0) continue;
      step[i] = to;
      lacks -= by * J.col(i);
      changed = std::max(changed, std::abs(by));
    }
    if (changed < kSettled) break;
  }
  return step;
}

double lack(const Eigen::VectorXd& margins, const Eigen::VectorXd& scales) {
  double out = 0;
  for (Eigen::Index k = 0; k < margins.size(); ++k) {
    if (margins[k] < 0) out -= margins[k] / scales[k];
  }
  return out;
}

}  // namespace graze
