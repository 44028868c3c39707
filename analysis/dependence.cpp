#include "analysis/dependence.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "analysis/significance.h"

namespace graze {
namespace {

constexpr double kWideKernel = 0.2, kNarrowKernel = 0.05;  // of the kernel's halves; ranks cover (0, 1)
constexpr std::size_t kMostPoints = 64;  // that stand for a distribution; the kernel is smoother than 1/64

double gaussian(double x) { return std::exp(-0.5 * x * x); }

/// The wide half sees what rises, or rises and falls once; the narrow one also what does so twice, as what depends on
/// the sine's square of an angle does. By simulation (60 times 200 traces of yes and no, level 0.001) the sum finds as
/// many of what rises, falls or has one hill as the wide one alone, and all of what has two clear ones, of which that
/// finds none.
double kernel(double distance) { return 0.5 * (gaussian(distance / kWideKernel) + gaussian(distance / kNarrowKernel)); }

/// The kernel by twice the distance of two midranks, which is a whole number.
std::vector<float> kernel_table(std::size_t n) {
  std::vector<float> table(2 * n);
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = static_cast<float>(kernel(0.5 * static_cast<double>(i) / static_cast<double>(n)));
  }
  return table;
}

std::vector<int> doubled(std::span<const double> ranks) {
  std::vector<int> out;
  for (const double rank : ranks) out.push_back(static_cast<int>(std::lround(2 * rank)));
  return out;
}

/// A few points with weights that stand for the distribution of scaled ranks: its values, if they are few.
struct Points {
  std::vector<double> at, weight;
};
Points points_of(std::span<const double> ranks) {
  std::vector<double> sorted(ranks.begin(), ranks.end());
  std::sort(sorted.begin(), sorted.end());
  const auto n = static_cast<double>(sorted.size());
  Points values;
  for (const double rank : sorted) {
    if (values.at.empty() || values.at.back() != rank / n) {
      if (values.at.size() == kMostPoints) break;
      values.at.push_back(rank / n);
      values.weight.push_back(0);
    }
    values.weight.back() += 1 / n;
  }
  if (values.at.size() < kMostPoints) return values;
  Points quantiles;
  for (std::size_t i = 0; i < kMostPoints; ++i) {
    const double p = (static_cast<double>(i) + 0.5) / kMostPoints;
    quantiles.at.push_back(sorted[static_cast<std::size_t>(p * n)] / n);
    quantiles.weight.push_back(1.0 / kMostPoints);
  }
  return quantiles;
}

/// Those of the centred kernel operator, falling, without those that are nothing.
std::vector<double> eigenvalues_of(std::span<const double> ranks) {
  const Points points = points_of(ranks);
  const auto m = static_cast<Eigen::Index>(points.at.size());
  const Eigen::Map<const Eigen::VectorXd> at(points.at.data(), m), weight(points.weight.data(), m);
  Eigen::MatrixXd k(m, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) k(i, j) = kernel(at[i] - at[j]);
  }
  const Eigen::VectorXd mean = k * weight;
  const double all = mean.dot(weight);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      k(i, j) = std::sqrt(weight[i] * weight[j]) * (k(i, j) - mean[i] - mean[j] + all);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(k, Eigen::EigenvaluesOnly);
  std::vector<double> out;
  for (Eigen::Index i = m; i-- > 0;) {
    const double value = solver.eigenvalues()[i];
    if (value > 1e-9) out.push_back(value);
  }
  return out;
}

bool are_untied(const std::vector<int>& twice) {
  std::vector<bool> seen(2 * twice.size() + 1);
  for (const int rank : twice) {
    if (seen[static_cast<std::size_t>(rank)]) return false;
    seen[static_cast<std::size_t>(rank)] = true;
  }
  return true;
}

double sum_of_squares(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return sum;
}

}  // namespace

RankDependence::RankDependence(std::span<const double> ranks)
    : n_(ranks.size()), centred_(n_ * n_), eigenvalues_(eigenvalues_of(ranks)) {
  std::vector<double> line(n_);
  std::iota(line.begin(), line.end(), 1.0);
  untied_ = eigenvalues_of(line);
  const std::vector<float> table = kernel_table(n_);
  const std::vector<int> twice = doubled(ranks);
  std::vector<double> mean(n_, 0.0);
  double all = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t j = 0; j < n_; ++j) mean[i] += table[static_cast<std::size_t>(std::abs(twice[i] - twice[j]))];
    mean[i] /= static_cast<double>(n_);
    all += mean[i] / static_cast<double>(n_);
  }
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t j = 0; j < n_; ++j) {
      const double k = table[static_cast<std::size_t>(std::abs(twice[i] - twice[j]))];
      centred_[i * n_ + j] = static_cast<float>(k - mean[i] - mean[j] + all);
    }
  }
  norm_ = std::sqrt(sum_of_squares(eigenvalues_));
}

RankDependence::Result RankDependence::test(std::span<const double> ranks) const {
  const std::vector<int> twice = doubled(ranks);
  const std::vector<double> of_predictor = are_untied(twice) ? untied_ : eigenvalues_of(ranks);
  if (of_predictor.empty() || eigenvalues_.empty()) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  const std::vector<float> table = kernel_table(n_);
  double below = 0, diagonal = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    const float* row = &centred_[i * n_];
    float sum = 0;
    for (std::size_t j = 0; j < i; ++j) sum += table[static_cast<std::size_t>(std::abs(twice[i] - twice[j]))] * row[j];
    below += sum;
    diagonal += row[i];
  }
  const auto n = static_cast<double>(n_);
  const double hsic = (2 * below + diagonal) / (n * n);
  std::vector<double> weights;
  for (const double a : of_predictor) {
    for (const double b : eigenvalues_) {
      if (a * b > 1e-4 * of_predictor[0] * eigenvalues_[0]) weights.push_back(a * b);
    }
  }
  // Under permutations the mean is n / (n - 1) times that of the limit.
  return {std::max(0.0, hsic) / (std::sqrt(sum_of_squares(of_predictor)) * norm_),
          upper_weighted_chi_square((n - 1) * hsic, weights)};
}

}  // namespace graze
