#include "analysis/causes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "analysis/dependence.h"
#include "analysis/rank_table.h"
#include "analysis/ranks.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

constexpr std::size_t kLeastRows = 8, kLeastForShape = 30, kMostForShape = 1000, kLeastForShares = 200;

/// One target among the rows that count, and all that tests of it share.
class Case {
 public:
  Case(const ParticleTable& table, const RankTable& ranks, const std::vector<double>& target, bool binary);
  ParameterEffect effect(std::size_t k) const;  // of the k-th column of `ranks`
  std::size_t ones() const { return ones_; }
  const std::vector<double>& target_ranks() const { return y_ranks_; }

 private:
  void test_number(std::size_t k, ParameterEffect& out) const;
  void test_choice(std::size_t k, ParameterEffect& out) const;
  void test_shape(std::size_t k, ParameterEffect& out) const;
  void find_share(std::size_t k, ParameterEffect& out) const;

  const ParticleTable& table_;
  const RankTable& ranks_;
  bool binary_;
  std::vector<double> y_, y_ranks_;  // by row that counts
  std::size_t ones_ = 0;
  double y_length_ = 0;  // of the centred ranks
  std::optional<RankSumTest> rank_sum_;
  std::optional<SpearmanTest> spearman_;
  std::vector<std::uint32_t> few_;  // of the rows that count: those for the test of any shape
  std::optional<RankDependence> shape_;
};

/// Of a choice; files of others may hold any number.
std::uint32_t category(double value) { return static_cast<std::uint32_t>(std::clamp(value, 0.0, 1e6)); }

double tied_squares(double n, double ties) { return (n * n * n - n - ties) / 12; }

Case::Case(const ParticleTable& table, const RankTable& ranks, const std::vector<double>& target, bool binary)
    : table_(table), ranks_(ranks), binary_(binary) {
  for (const std::uint32_t row : ranks.rows) y_.push_back(target[row]);
  y_ranks_ = midranks(y_);
  const std::size_t n = y_.size();
  y_length_ = std::sqrt(tied_squares(static_cast<double>(n), tie_sum(y_ranks_)));
  if (binary) {
    ones_ = static_cast<std::size_t>(std::count(y_.begin(), y_.end(), 1.0));
    rank_sum_.emplace(ones_, n);
  } else {
    spearman_.emplace(y_ranks_);
  }
  if (n < kLeastForShape) return;
  const std::size_t few = std::min(n, kMostForShape);
  std::vector<double> y;
  for (std::size_t i = 0; i < few; ++i) {
    few_.push_back(static_cast<std::uint32_t>(i * n / few));
    y.push_back(y_[few_.back()]);
  }
  shape_.emplace(midranks(y));
}

void Case::test_number(std::size_t k, ParameterEffect& out) const {
  const std::vector<float>& x = ranks_.ranks[k];
  const auto n = static_cast<double>(x.size()), ones = static_cast<double>(ones_);
  double product = 0, sum = 0;  // of centred ranks
  for (std::size_t i = 0; i < x.size(); ++i) {
    product += static_cast<double>(x[i]) * y_ranks_[i];
    if (binary_ && y_[i] == 1) sum += x[i];
  }
  out.spearman = std::clamp(product / (std::sqrt(tied_squares(n, ranks_.ties[k])) * y_length_), -1.0, 1.0);
  if (binary_) {
    out.test = "rank-sum";
    out.auc = 0.5 + sum / (ones * (n - ones));
    out.effect = 2 * out.auc - 1;
    out.p_rank = rank_sum_->p_value(sum + ones * (n + 1) / 2, ranks_.ties[k]);
  } else {
    out.test = "spearman";
    out.effect = out.spearman;
    out.p_rank = spearman_->p_value(out.spearman);
  }
}

void Case::test_choice(std::size_t k, ParameterEffect& out) const {
  const ParticleTable::Column& column = table_.columns[ranks_.columns[k]];
  std::vector<std::uint32_t> group;
  std::map<std::uint32_t, std::pair<double, double>> sums;  // rows and target, by value
  for (std::size_t i = 0; i < y_.size(); ++i) {
    group.push_back(category(column.values[ranks_.rows[i]]));
    auto& [rows, sum] = sums[group.back()];
    ++rows;
    sum += y_[i];
  }
  out.test = "kruskal-wallis";
  if (sums.size() < 2) return;  // of others: fractions that mean one choice
  const GroupTest test = kruskal_wallis(y_ranks_, group);
  out.effect = std::sqrt(test.epsilon);
  out.p_rank = test.p_value;
  double most = -std::numeric_limits<double>::infinity();
  for (const auto& [value, rows_and_sum] : sums) {
    const double mean = rows_and_sum.second / rows_and_sum.first;
    if (mean <= most) continue;
    most = mean;
    out.label = value < column.labels.size() ? column.labels[value] : fmt::format("{}", value);
  }
  if (!binary_ || sums.size() != 2) return;
  const auto& [rows, hits] = sums.begin()->second;
  FourfoldTable counts;
  counts.both = static_cast<std::uint64_t>(hits);
  counts.only_a = static_cast<std::uint64_t>(rows - hits);
  counts.only_b = ones_ - counts.both;
  counts.neither = y_.size() - counts.both - counts.only_a - counts.only_b;
  out.test = "fisher";
  out.p_rank = fisher_two_sided(counts);
}

void Case::test_shape(std::size_t k, ParameterEffect& out) const {
  if (!shape_ || !std::isnan(out.hsic)) return;
  std::vector<double> x;
  for (const std::uint32_t i : few_) x.push_back(ranks_.ranks[k][i]);
  const RankDependence::Result result = shape_->test(midranks(x));
  out.hsic = result.share;
  out.p_hsic = result.p_value;
}

/// Equally many rows in each bin; a choice has a bin for each value. With B bins an idle parameter's R^2 has the
/// distribution Beta((B - 1) / 2, (n - B) / 2), whose mean is taken off.
void Case::find_share(std::size_t k, ParameterEffect& out) const {
  const ParticleTable::Column& column = table_.columns[ranks_.columns[k]];
  const std::size_t n = y_.size(), labels = column.labels.size();
  if (n < kLeastForShares) return;
  const std::size_t bins = labels == 0 ? std::min<std::size_t>(32, n / 25) : labels;
  const auto rows = static_cast<double>(n), mean = std::accumulate(y_.begin(), y_.end(), 0.0) / rows;
  std::vector<double> count(bins), sum(bins);
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double place = (static_cast<double>(ranks_.ranks[k][i]) + 0.5 * (rows - 1)) / rows;  // from 0, below 1
    const double bin = labels == 0 ? place * static_cast<double>(bins) : category(column.values[ranks_.rows[i]]);
    const std::size_t to = std::min(bins - 1, static_cast<std::size_t>(bin));
    ++count[to];
    sum[to] += y_[i] - mean;
    total += (y_[i] - mean) * (y_[i] - mean);
  }
  double between = 0, used = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    between += count[bin] > 0 ? sum[bin] * sum[bin] / count[bin] : 0;
    used += count[bin] > 0;
  }
  if (used < 2 || !(total > 0)) return;
  out.share = 1 - (1 - between / total) * (rows - 1) / (rows - used);
  out.share_noise = std::sqrt(2 * (used - 1) / ((rows - used) * (rows + 1)));
}

ParameterEffect Case::effect(std::size_t k) const {
  ParameterEffect out;
  out.column = ranks_.columns[k];
  out.spearman = out.auc = out.hsic = out.p_hsic = out.partial = out.p_partial = out.share = out.share_noise = kNaN;
  const bool choice = !table_.columns[out.column].labels.empty();
  choice ? test_choice(k, out) : test_number(k, out);
  if (!choice) test_shape(k, out);
  out.p_value = std::isnan(out.p_hsic) ? out.p_rank : std::min(1.0, 2 * std::fmin(out.p_rank, out.p_hsic));
  find_share(k, out);
  return out;
}

bool is_binary(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double y) { return std::isnan(y) || y == 0 || y == 1; });
}

bool varies(const std::vector<double>& values, const std::vector<std::uint32_t>& rows) {
  return std::any_of(rows.begin(), rows.end(), [&](std::uint32_t row) { return values[row] != values[rows[0]]; });
}

void add_partial(const ParticleTable& table, const RankTable& ranks, const std::vector<double>& target_ranks,
                 Causes& out) {
  if (!ranks.partial.doubt().empty()) {
    out.notes.push_back("no partial correlations: " + ranks.partial.doubt());
    return;
  }
  const std::vector<PartialRanks::Result> results = ranks.partial.of(target_ranks);
  std::size_t number = 0;
  for (ParameterEffect& effect : out.effects) {
    if (!table.columns[effect.column].labels.empty()) continue;
    effect.partial = results[number].correlation;
    effect.p_partial = results[number++].p_value;
  }
}

void note_correlation(const ParticleTable& table, const RankTable& ranks, Causes& out) {
  constexpr double kMuch = 0.5;
  if (ranks.partial.largest() < kMuch) return;
  std::vector<std::size_t> numbers;
  for (const std::size_t column : ranks.columns) {
    if (table.columns[column].labels.empty()) numbers.push_back(column);
  }
  out.notes.push_back(fmt::format(
      "{} and {} go together (rank correlation {:.2f}): what one of such parameters does shows in the other, too, and "
      "their shares of variance overlap",
      table.columns[numbers[ranks.partial.first()]].name, table.columns[numbers[ranks.partial.second()]].name,
      ranks.partial.largest()));
}

void grow(const ParticleTable& table, const RankTable& ranks, const CauseTarget& target, Causes& out) {
  std::vector<TreeFeature> features(table.columns.size());
  for (const std::size_t column : ranks.columns) {
    features[column] = {table.columns[column].values, !table.columns[column].labels.empty()};
  }
  out.tree = grow_tree(features, target.values, out.binary);
}

/// All but what needs the other targets.
Causes causes_of(const ParticleTable& table, const RankTable& ranks, const CauseTarget& target) {
  Causes out;
  out.target = target.name;
  out.binary = is_binary(target.values);
  out.rows = ranks.rows.size();
  out.notes = ranks.notes;
  for (const std::uint32_t row : ranks.rows) out.ones += out.binary && target.values[row] == 1;
  if (out.rows < kLeastRows) {
    out.notes.push_back(fmt::format("not tested: {} traces, and it takes {}", out.rows, kLeastRows));
    return out;
  }
  if (!varies(target.values, ranks.rows)) {
    out.notes.push_back("not tested: it is the same in all traces");
    return out;
  }
  const Case one(table, ranks, target.values, out.binary);
  for (std::size_t k = 0; k < ranks.columns.size(); ++k) out.effects.push_back(one.effect(k));
  add_partial(table, ranks, one.target_ranks(), out);
  note_correlation(table, ranks, out);
  if (out.rows < kLeastForShape)
    out.notes.push_back("dependence beyond rising and falling is not tested below 30 traces");
  if (out.rows < kLeastForShares) out.notes.push_back("no shares of variance below 200 traces");
  grow(table, ranks, target, out);
  return out;
}

/// Corrects for all tests of all targets, and sorts.
void judge(std::vector<Causes>& all) {
  std::vector<double> p_values;
  std::size_t trees = 0;
  for (const Causes& one : all) {
    for (const ParameterEffect& effect : one.effects) p_values.push_back(effect.p_value);
    trees += !one.effects.empty();
  }
  const std::vector<double> adjusted = holm(p_values);
  std::size_t next = 0;
  for (Causes& one : all) {
    for (ParameterEffect& effect : one.effects) effect.p_holm = adjusted[next++];
    std::stable_sort(one.effects.begin(), one.effects.end(), [](const ParameterEffect& a, const ParameterEffect& b) {
      return a.p_value != b.p_value ? a.p_value < b.p_value : std::abs(a.effect) > std::abs(b.effect);
    });
    const auto matters = [](const ParameterEffect& effect) { return effect.p_holm < kCauseLevel; };
    one.significant = static_cast<std::size_t>(std::count_if(one.effects.begin(), one.effects.end(), matters));
    one.tree_tells = one.tree.depth > 0 && one.tree.p_value * static_cast<double>(trees) < kTreeLevel;
  }
}

}  // namespace

std::vector<Causes> find_causes(const ParticleTable& table, const std::vector<CauseTarget>& targets) {
  for (const ParticleTable::Column& column : table.columns) {
    if (column.values.size() != table.rows()) throw std::invalid_argument("columns of different lengths");
  }
  const std::vector<std::vector<std::uint32_t>> orders = orders_of(table);
  std::vector<Causes> out;
  std::vector<bool> before;
  std::optional<RankTable> ranks;  // most targets are about the same rows
  for (const CauseTarget& target : targets) {
    if (target.values.size() != table.rows()) throw std::invalid_argument("a target of another length than the table");
    std::vector<bool> counts;
    for (const double y : target.values) counts.push_back(!std::isnan(y));
    if (!ranks || counts != before) ranks.emplace(rank_table(table, orders, counts));
    out.push_back(causes_of(table, *ranks, target));
    before = std::move(counts);
  }
  judge(out);
  return out;
}

ParticleTable particle_table(std::span<const double> values, const std::vector<std::string>& names) {
  ParticleTable table;
  for (std::size_t k = 0; k < names.size(); ++k) {
    table.columns.push_back({names[k]});
    for (std::size_t i = k; i < values.size(); i += names.size()) table.columns.back().values.push_back(values[i]);
  }
  return table;
}

Causes find_causes(const ParticleTable& table, CauseTarget target, const std::vector<bool>& mask) {
  if (!mask.empty() && mask.size() != target.values.size()) {
    throw std::invalid_argument("a mask of another length than the target");
  }
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) target.values[i] = kNaN;
  }
  return std::move(find_causes(table, std::vector<CauseTarget>{std::move(target)})[0]);
}

Causes find_causes(std::span<const double> values, const std::vector<std::string>& names, CauseTarget target,
                   const std::vector<bool>& mask) {
  return find_causes(particle_table(values, names), std::move(target), mask);
}

}  // namespace graze
