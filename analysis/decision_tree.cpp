#include "analysis/decision_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "analysis/ranks.h"
#include "analysis/significance.h"

namespace graze {
namespace {

constexpr int kMostDepth = 3;
constexpr std::size_t kMostFolds = 5, kMostRows = 4000;

/// What the rows of a node, or on one side of a split, amount to.
struct Sums {
  double weight = 0, response = 0;
  std::size_t rows = 0;
  double gain() const { return weight > 0 ? response * response / weight : 0; }
  void add(double w, double r) {
    weight += w;
    response += w * r;
    ++rows;
  }
  Sums minus(const Sums& other) const {
    Sums out;
    out.weight = weight - other.weight;
    out.response = response - other.response;
    out.rows = rows - other.rows;
    return out;
  }
};

struct Split {
  double gain = 0, threshold = 0;
  int feature = -1;
};

/// Rows, responses and weights that trees are grown from: of all of them, or of all but a fold.
class Ground {
 public:
  Ground(const std::vector<TreeFeature>& features, std::span<const double> target, bool binary);
  std::size_t rows() const { return response_.size(); }
  const std::vector<double>& response() const { return response_; }
  /// From the rows with used[row].
  std::vector<TreeNode> grow(const std::vector<bool>& used) const;
  /// The response that a tree of that depth gives a row.
  double predict(const std::vector<TreeNode>& nodes, std::size_t row, int depth) const;

 private:
  /// Where the rows of a level are, and what they amount to by node.
  struct Level {
    std::vector<int> node;  // of each row; -1: not used, or in a leaf further up
    std::vector<int> slot;  // of each node; -1: not of this level
    std::vector<Sums> all;  // of each slot
    std::vector<Split> best;
  };
  /// Counts the rows of the nodes from `begin` on.
  Level level_of(const std::vector<int>& node, int begin, std::vector<TreeNode>& nodes) const;
  /// Gives the nodes of a level the children that their best splits make.
  void split(const Level& level, int begin, std::vector<TreeNode>& nodes) const;
  void try_number(std::size_t feature, Level& level) const;
  void try_choice(std::size_t feature, Level& level) const;
  void offer(const Sums& no, const Sums& all, Split split, Split& best) const;
  bool answers_yes(const TreeNode& node, std::size_t row) const;

  std::vector<std::vector<double>> values_;
  std::vector<bool> choice_;
  std::vector<std::vector<std::uint32_t>> order_;
  std::vector<double> response_, weight_;
  std::size_t least_;  // rows of a leaf
};

/// `most` of `rows`, evenly.
void thin(std::vector<std::uint32_t>& rows, std::size_t most) {
  if (rows.size() <= most) return;
  for (std::size_t i = 0; i < most; ++i) rows[i] = rows[i * rows.size() / most];
  rows.resize(most);
}

/// The rows to grow from.
std::vector<std::uint32_t> chosen_rows(std::span<const double> target, bool binary) {
  std::vector<std::uint32_t> zeros, ones;
  for (std::uint32_t row = 0; row < target.size(); ++row) {
    if (!std::isnan(target[row])) (binary && target[row] > 0 ? ones : zeros).push_back(row);
  }
  if (zeros.size() + ones.size() > kMostRows) {
    std::vector<std::uint32_t>&rarer = zeros.size() < ones.size() ? zeros : ones,
    &other = &rarer == &ones ? zeros : ones;
    thin(rarer, kMostRows / 2);
    thin(other, kMostRows - rarer.size());
  }
  zeros.insert(zeros.end(), ones.begin(), ones.end());
  std::sort(zeros.begin(), zeros.end());
  return zeros;
}

Ground::Ground(const std::vector<TreeFeature>& features, std::span<const double> target, bool binary) {
  const std::vector<std::uint32_t> rows = chosen_rows(target, binary);
  std::vector<double> chosen;
  for (const std::uint32_t row : rows) chosen.push_back(target[row]);
  for (const TreeFeature& feature : features) {
    std::vector<double>& values = values_.emplace_back();
    for (const std::uint32_t row : rows) values.push_back(feature.values.empty() ? 0 : feature.values[row]);
    order_.push_back(order_of(values));
    choice_.push_back(feature.choice);
  }
  response_ = binary ? chosen : midranks(chosen);
  const double ones = std::accumulate(chosen.begin(), chosen.end(), 0.0);
  const double zeros = static_cast<double>(rows.size()) - ones;
  for (const double y : chosen) weight_.push_back(!binary ? 1.0 : y > 0 ? 1 / ones : 1 / zeros);
  least_ = std::max<std::size_t>(2, rows.size() / 50);
}

void Ground::offer(const Sums& no, const Sums& all, Split split, Split& best) const {
  const Sums yes = all.minus(no);
  if (no.rows < least_ || yes.rows < least_) return;
  split.gain = no.gain() + yes.gain() - all.gain();
  if (split.gain > best.gain * (1 + 1e-9) + 1e-12) best = split;  // of equal ones the first parameter
}

void Ground::try_number(std::size_t feature, Level& level) const {
  const std::vector<double>& values = values_[feature];
  std::vector<Sums> below(level.all.size());
  std::vector<double> last(level.all.size());
  for (const std::uint32_t row : order_[feature]) {
    if (level.node[row] < 0) continue;
    const auto slot = static_cast<std::size_t>(level.slot[static_cast<std::size_t>(level.node[row])]);
    if (below[slot].rows > 0 && values[row] > last[slot]) {
      const Split split{0, last[slot] + 0.5 * (values[row] - last[slot]), static_cast<int>(feature)};
      offer(below[slot], level.all[slot], split, level.best[slot]);
    }
    below[slot].add(weight_[row], response_[row]);
    last[slot] = values[row];
  }
}

void Ground::try_choice(std::size_t feature, Level& level) const {
  std::map<std::pair<std::size_t, double>, Sums> chosen;  // by slot and value
  for (std::size_t row = 0; row < rows(); ++row) {
    if (level.node[row] < 0) continue;
    const auto slot = static_cast<std::size_t>(level.slot[static_cast<std::size_t>(level.node[row])]);
    chosen[{slot, values_[feature][row]}].add(weight_[row], response_[row]);
  }
  for (const auto& [key, sums] : chosen) {
    const auto& [slot, value] = key;
    offer(level.all[slot].minus(sums), level.all[slot], {0, value, static_cast<int>(feature)}, level.best[slot]);
  }
}

bool Ground::answers_yes(const TreeNode& node, std::size_t row) const {
  const auto feature = static_cast<std::size_t>(node.feature);
  const double value = values_[feature][row];
  return choice_[feature] ? value == node.threshold : value > node.threshold;
}

Ground::Level Ground::level_of(const std::vector<int>& node, int begin, std::vector<TreeNode>& nodes) const {
  Level level;
  level.node = node;
  level.slot.assign(nodes.size(), -1);
  for (std::size_t k = static_cast<std::size_t>(begin); k < nodes.size(); ++k)
    level.slot[k] = static_cast<int>(k) - begin;
  level.all.resize(nodes.size() - static_cast<std::size_t>(begin));
  level.best.resize(level.all.size());
  for (std::size_t row = 0; row < rows(); ++row) {
    if (node[row] >= 0) level.all[static_cast<std::size_t>(node[row] - begin)].add(weight_[row], response_[row]);
  }
  for (std::size_t k = 0; k < level.all.size(); ++k) {
    const Sums& sums = level.all[k];
    TreeNode& one = nodes[static_cast<std::size_t>(begin) + k];
    one.rows = sums.rows;
    one.mean = sums.weight > 0 ? sums.response / sums.weight : 0;
  }
  return level;
}

void Ground::split(const Level& level, int begin, std::vector<TreeNode>& nodes) const {
  for (std::size_t k = 0; k < level.best.size(); ++k) {
    const Split& best = level.best[k];
    if (best.feature < 0) continue;
    const int yes = static_cast<int>(nodes.size());
    nodes.resize(nodes.size() + 2);
    TreeNode& node = nodes[static_cast<std::size_t>(begin) + k];
    node.feature = best.feature;
    node.threshold = best.threshold;
    node.yes = yes;
    node.no = yes + 1;
    nodes[static_cast<std::size_t>(node.yes)].depth = nodes[static_cast<std::size_t>(node.no)].depth = node.depth + 1;
  }
}

std::vector<TreeNode> Ground::grow(const std::vector<bool>& used) const {
  std::vector<TreeNode> nodes(1);
  std::vector<int> at(rows());  // node of each row; -1: not used, or in a leaf further up
  for (std::size_t row = 0; row < rows(); ++row) at[row] = used[row] ? 0 : -1;
  for (int depth = 0, begin = 0; begin < static_cast<int>(nodes.size()); ++depth) {
    const int end = static_cast<int>(nodes.size());
    Level level = level_of(at, begin, nodes);
    if (depth == kMostDepth) break;
    for (std::size_t feature = 0; feature < values_.size(); ++feature) {
      choice_[feature] ? try_choice(feature, level) : try_number(feature, level);
    }
    split(level, begin, nodes);
    for (std::size_t row = 0; row < rows(); ++row) {
      if (at[row] < 0) continue;
      const TreeNode& node = nodes[static_cast<std::size_t>(at[row])];
      at[row] = node.feature < 0 ? -1 : answers_yes(node, row) ? node.yes : node.no;
    }
    begin = end;
  }
  return nodes;
}

double Ground::predict(const std::vector<TreeNode>& nodes, std::size_t row, int depth) const {
  const TreeNode* node = &nodes[0];
  while (node->feature >= 0 && node->depth < depth) {
    node = &nodes[static_cast<std::size_t>(answers_yes(*node, row) ? node->yes : node->no)];
  }
  return node->mean;
}

/// The fold of each row: classes (or all rows) are dealt out one by one, shuffled.
std::vector<std::size_t> folds_of(const std::vector<double>& response, bool binary, std::size_t folds) {
  std::vector<std::uint32_t> order(response.size());
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937_64 random(2);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  if (binary) std::stable_partition(order.begin(), order.end(), [&](std::uint32_t row) { return response[row] > 0; });
  std::vector<std::size_t> fold(response.size());
  for (std::size_t i = 0; i < order.size(); ++i) fold[order[i]] = i % folds;
  return fold;
}

struct Skill {
  double value = 0, error = 0, p_value = 1;
  double right_ones = 0, right_zeros = 0;  // shares
};

Skill binary_skill(const std::vector<double>& predicted, const std::vector<double>& response) {
  FourfoldTable table;  // a: predicted, b: is
  for (std::size_t i = 0; i < response.size(); ++i) {
    const bool says = predicted[i] > 0.5, is = response[i] > 0;
    ++(says ? is ? table.both : table.only_a : is ? table.only_b : table.neither);
  }
  const auto both = static_cast<double>(table.both), neither = static_cast<double>(table.neither);
  const double ones = both + static_cast<double>(table.only_b), zeros = neither + static_cast<double>(table.only_a);
  if (ones == 0 || zeros == 0) return {0.5};
  const double one = both / ones, zero = neither / zeros;
  return {0.5 * (one + zero), 0.5 * std::sqrt(one * (1 - one) / ones + zero * (1 - zero) / zeros), fisher_upper(table),
          one, zero};
}

Skill number_skill(const std::vector<double>& predicted, const std::vector<double>& response) {
  const double r = correlation(predicted, response);
  if (std::isnan(r) || response.size() < 4) return {};
  const auto n = static_cast<double>(response.size());
  const double t = r * std::sqrt((n - 2) / std::max(1 - r * r, 1e-300));
  const double two_sided = two_sided_student(t, n - 2);
  return {r, (1 - r * r) / std::sqrt(n - 1), r > 0 ? two_sided / 2 : 1};
}

/// What trees that have not seen a row say of it.
struct Predictions {
  std::vector<double> response;
  std::vector<std::vector<double>> by_depth = std::vector<std::vector<double>>(kMostDepth);

  Skill skill(int depth, bool binary) const {
    const auto& predicted = by_depth[static_cast<std::size_t>(depth - 1)];
    return binary ? binary_skill(predicted, response) : number_skill(predicted, response);
  }
};

/// Grows from all folds but one and asks about that one.
void ask_about(std::size_t asked, const std::vector<std::size_t>& fold, const Ground& ground, Predictions& out) {
  std::vector<bool> used(ground.rows());
  for (std::size_t row = 0; row < ground.rows(); ++row) used[row] = fold[row] != asked;
  const std::vector<TreeNode> nodes = ground.grow(used);
  for (std::size_t row = 0; row < ground.rows(); ++row) {
    if (used[row]) continue;
    out.response.push_back(ground.response()[row]);
    for (int depth = 1; depth <= kMostDepth; ++depth) {
      out.by_depth[static_cast<std::size_t>(depth - 1)].push_back(ground.predict(nodes, row, depth));
    }
  }
}

Predictions cross_validate(const Ground& ground, bool binary, std::size_t folds) {
  const std::vector<std::size_t> fold = folds_of(ground.response(), binary, folds);
  Predictions out;
  for (std::size_t k = 0; k < folds; ++k) ask_about(k, fold, ground, out);
  return out;
}

double tree_p_value(const Ground& ground, bool binary) {
  const std::vector<std::size_t> half = folds_of(ground.response(), binary, 2);
  double least = 1;
  for (const std::size_t asked : {0u, 1u}) {
    Predictions out;
    ask_about(asked, half, ground, out);
    for (int depth = 1; depth <= kMostDepth; ++depth) least = std::min(least, out.skill(depth, binary).p_value);
  }
  return std::min(1.0, 2 * kMostDepth * least);
}

/// Cuts below `depth`, and takes back last questions whose answers say the same class.
void prune(std::vector<TreeNode>& nodes, int depth, bool binary) {
  const auto leaf = [&](int k) { return nodes[static_cast<std::size_t>(k)].feature < 0; };
  const auto says = [&](int k) { return nodes[static_cast<std::size_t>(k)].mean > 0.5; };
  for (std::size_t k = nodes.size(); k-- > 0;) {
    TreeNode& node = nodes[k];
    if (node.feature < 0) continue;
    const bool idle = binary && leaf(node.yes) && leaf(node.no) && says(node.yes) == says(node.no);
    if (node.depth >= depth || idle) node.feature = -1;
  }
}

/// Rows and plain means of the target, of all rows rather than those that the tree grew from.
void count_rows(const std::vector<TreeFeature>& features, std::span<const double> target,
                std::vector<TreeNode>& nodes) {
  for (TreeNode& node : nodes) node.rows = 0, node.mean = 0;
  for (std::size_t row = 0; row < target.size(); ++row) {
    for (int at = std::isnan(target[row]) ? -1 : 0; at >= 0;) {
      TreeNode& node = nodes[static_cast<std::size_t>(at)];
      ++node.rows;
      node.mean += target[row];
      if (node.feature < 0) break;
      const TreeFeature& feature = features[static_cast<std::size_t>(node.feature)];
      const double value = feature.values[row];
      at = (feature.choice ? value == node.threshold : value > node.threshold) ? node.yes : node.no;
    }
  }
  for (TreeNode& node : nodes) node.mean /= static_cast<double>(std::max<std::size_t>(node.rows, 1));
}

void collect(const DecisionTree& tree, int at, TreeRule rule, std::vector<TreeRule>& out) {
  const TreeNode& node = tree.nodes[static_cast<std::size_t>(at)];
  if (node.feature < 0) {
    rule.rows = node.rows;
    rule.mean = node.mean;
    out.push_back(rule);
    return;
  }
  for (const bool yes : {true, false}) {
    TreeRule next = rule;
    next.conditions.push_back({node.feature, node.threshold, yes});
    collect(tree, yes ? node.yes : node.no, next, out);
  }
}

}  // namespace

DecisionTree grow_tree(const std::vector<TreeFeature>& features, std::span<const double> target, bool binary) {
  DecisionTree out;
  out.nodes.resize(1);
  out.binary = binary;
  out.skill = out.chance = binary ? 0.5 : 0.0;
  const Ground ground(features, target, binary);
  const auto ones = static_cast<std::size_t>(
      std::count_if(ground.response().begin(), ground.response().end(), [](double y) { return y > 0; }));
  const std::size_t fewest = binary ? std::min(ones, ground.rows() - ones) : ground.rows();
  Skill skill;
  if (fewest >= 2 && ground.rows() >= 8) {
    const Predictions kept_out = cross_validate(ground, binary, std::min(kMostFolds, fewest));
    Skill best;
    for (int depth = kMostDepth; depth >= 1; --depth) {
      const Skill one = kept_out.skill(depth, binary);
      if (depth == kMostDepth || one.value >= best.value) best = one;
    }
    int depth = 1;
    while (kept_out.skill(depth, binary).value < best.value - best.error) ++depth;
    skill = kept_out.skill(depth, binary);
    out.skill = skill.value;
    out.standard_error = skill.error;
    out.p_value = tree_p_value(ground, binary);
    out.nodes = ground.grow(std::vector<bool>(ground.rows(), true));
    prune(out.nodes, depth, binary);
  }
  count_rows(features, target, out.nodes);
  if (binary) {
    const double share = out.nodes[0].mean;
    out.majority = std::max(share, 1 - share);
    out.accuracy = share * skill.right_ones + (1 - share) * skill.right_zeros;
  }
  for (const TreeRule& rule : rules_of(out)) out.depth = std::max(out.depth, static_cast<int>(rule.conditions.size()));
  return out;
}

std::vector<TreeRule> rules_of(const DecisionTree& tree) {
  std::vector<TreeRule> out;
  if (tree.nodes.empty()) return out;  // nothing was asked
  collect(tree, 0, {}, out);
  std::stable_sort(out.begin(), out.end(), [](const TreeRule& a, const TreeRule& b) { return a.mean > b.mean; });
  return out;
}

}  // namespace graze
