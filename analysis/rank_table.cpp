#include "analysis/rank_table.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "analysis/ranks.h"
#include "analysis/significance.h"

namespace graze {
namespace {

constexpr std::size_t kMostPartialRows = 20'000;
constexpr std::size_t kNamedInNote = 3;  // parameters in a note

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

std::string some_of(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kNamedInNote); ++i) out += (i > 0 ? ", " : "") + names[i];
  return names.size() > kNamedInNote ? out + ", …" : out;
}

void note(const std::vector<std::string>& names, const char* what, RankTable& out) {
  if (names.empty()) return;
  const char* plural = names.size() == 1 ? "" : "s";
  out.notes.push_back(fmt::format("left out {} {} parameter{}: {}", names.size(), what, plural, some_of(names)));
}

/// Ranks less their mean, of the rows that count; `place`: of each row among these, or -1.
std::vector<float> centred_ranks(const std::vector<double>& values, const std::vector<std::uint32_t>& order,
                                 const std::vector<std::int64_t>& place, std::size_t rows, double& ties) {
  std::vector<float> out(rows);
  const double mean = 0.5 * static_cast<double>(rows + 1);
  std::vector<std::uint32_t> equal;  // rows of one value
  double rank = 1;
  const auto close = [&] {
    const auto t = static_cast<double>(equal.size());
    for (const std::uint32_t row : equal) {
      out[static_cast<std::size_t>(place[row])] = static_cast<float>(rank + 0.5 * (t - 1) - mean);
    }
    ties += t * t * t - t;
    rank += t;
    equal.clear();
  };
  for (const std::uint32_t row : order) {
    if (place[row] < 0) continue;
    if (!equal.empty() && values[equal.back()] != values[row]) close();
    equal.push_back(row);
  }
  if (!equal.empty()) close();
  return out;
}

}  // namespace

struct PartialRanks::Solved {
  std::size_t rows = 0, stride_of = 0;  // used, of so many
  Eigen::MatrixXd columns;              // [row][predictor], each of length 1 about its mean
  Eigen::LLT<Eigen::MatrixXd> correlations;
  Eigen::VectorXd inverse_diagonal;
};

PartialRanks::PartialRanks() = default;
PartialRanks::~PartialRanks() = default;
PartialRanks::PartialRanks(PartialRanks&&) noexcept = default;

void PartialRanks::prepare(const std::vector<const std::vector<float>*>& ranks) {
  const std::size_t count = ranks.size(), all = count == 0 ? 0 : ranks[0]->size(), needed = 2 * count + 10;
  if (count < 2 || all < needed) {
    doubt_ = count < 2 ? "there is one parameter only"
                       : fmt::format("{} parameters need {} traces, and there are {}", count, needed, all);
    return;
  }
  solved_ = std::make_unique<Solved>();
  Solved& to = *solved_;
  to.rows = std::min(all, kMostPartialRows);
  to.stride_of = all;
  const auto rows = static_cast<Eigen::Index>(to.rows), width = static_cast<Eigen::Index>(count);
  to.columns.resize(rows, width);
  for (Eigen::Index j = 0; j < width; ++j) {
    const std::vector<float>& column = *ranks[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < to.rows; ++i) to.columns(static_cast<Eigen::Index>(i), j) = column[i * all / to.rows];
    to.columns.col(j).array() -= to.columns.col(j).mean();
    const double length = to.columns.col(j).norm();
    to.columns.col(j) /= length > 0 ? length : 1.0;
  }
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(width, width);
  r.selfadjointView<Eigen::Lower>().rankUpdate(to.columns.transpose());
  for (Eigen::Index i = 0; i < width; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      if (std::abs(r(i, j)) <= largest_) continue;
      largest_ = std::abs(r(i, j));
      first_ = static_cast<std::size_t>(j);
      second_ = static_cast<std::size_t>(i);
    }
  }
  to.correlations.compute(r);
  const bool solvable =
      to.correlations.info() == Eigen::Success && to.correlations.matrixLLT().diagonal().minCoeff() > 1e-4;
  if (!solvable) {
    doubt_ = "some parameters follow from others";
    return;
  }
  to.inverse_diagonal = to.correlations.solve(Eigen::MatrixXd::Identity(width, width)).diagonal();
}

std::vector<PartialRanks::Result> PartialRanks::of(const std::vector<double>& ranks) const {
  const Solved& by = *solved_;
  Eigen::VectorXd y(static_cast<Eigen::Index>(by.rows));
  for (std::size_t i = 0; i < by.rows; ++i) y[static_cast<Eigen::Index>(i)] = ranks[i * by.stride_of / by.rows];
  y.array() -= y.mean();
  const double length = y.norm();
  y /= length > 0 ? length : 1.0;
  const Eigen::VectorXd r = by.columns.transpose() * y, beta = by.correlations.solve(r);
  const double rest = std::max(0.0, 1 - r.dot(beta));  // of y's variance, given all predictors
  const double freedom = static_cast<double>(by.rows) - static_cast<double>(beta.size()) - 1;
  std::vector<Result> out;
  for (Eigen::Index j = 0; j < beta.size(); ++j) {
    const double partial = beta[j] / std::sqrt(rest * by.inverse_diagonal[j] + beta[j] * beta[j]);
    const double t = partial * std::sqrt(freedom / std::max(1 - partial * partial, 1e-300));
    out.push_back({partial, two_sided_student(t, freedom)});
  }
  return out;
}

std::vector<std::vector<std::uint32_t>> orders_of(const ParticleTable& table) {
  std::vector<std::vector<std::uint32_t>> out;
  for (const ParticleTable::Column& column : table.columns) {
    out.push_back(all_finite(column.values) ? order_of(column.values) : std::vector<std::uint32_t>{});
  }
  return out;
}

RankTable rank_table(const ParticleTable& table, const std::vector<std::vector<std::uint32_t>>& orders,
                     const std::vector<bool>& counts) {
  RankTable out;
  std::vector<std::int64_t> place(table.rows(), -1);
  for (std::uint32_t row = 0; row < table.rows(); ++row) {
    if (!counts[row]) continue;
    place[row] = static_cast<std::int64_t>(out.rows.size());
    out.rows.push_back(row);
  }
  std::vector<std::string> constant, strange;
  for (std::size_t k = 0; k < table.columns.size(); ++k) {
    const ParticleTable::Column& column = table.columns[k];
    if (orders[k].size() != table.rows()) {
      strange.push_back(column.name);
      continue;
    }
    double ties = 0;
    std::vector<float> ranks = centred_ranks(column.values, orders[k], place, out.rows.size(), ties);
    if (std::all_of(ranks.begin(), ranks.end(), [](float rank) { return rank == 0; })) {
      constant.push_back(column.name);
      continue;
    }
    out.columns.push_back(k);
    out.ranks.push_back(std::move(ranks));
    out.ties.push_back(ties);
  }
  note(constant, "constant", out);
  note(strange, "not finite", out);
  std::vector<const std::vector<float>*> numbers;
  for (std::size_t k = 0; k < out.columns.size(); ++k) {
    if (table.columns[out.columns[k]].labels.empty()) numbers.push_back(&out.ranks[k]);
  }
  out.partial.prepare(numbers);
  return out;
}

}  // namespace graze
