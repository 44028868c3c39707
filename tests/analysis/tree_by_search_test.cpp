// Decision trees against a search over all questions, and what they promise of counts, leaves and false alarms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "analysis/decision_tree.h"
#include "analysis/ranks.h"

namespace graze {
namespace {

using Column = std::vector<double>;

std::vector<TreeFeature> features_of(const std::vector<Column>& columns, const std::set<std::size_t>& choices = {}) {
  std::vector<TreeFeature> out;
  for (std::size_t k = 0; k < columns.size(); ++k) out.push_back({columns[k], choices.contains(k)});
  return out;
}

struct Question1 {
  std::size_t feature = 0;
  double gain = -1, below = 0, above = 0;  // the threshold lies between these; of a choice both are the value
};

/// The question that lowers the sum of squares most, by trying every one; rows of a class weigh 1 / (its size).
Question1 best_question(const std::vector<Column>& columns, const std::set<std::size_t>& choices, const Column& target,
                        bool binary, std::size_t least) {
  const Column response = binary ? target : midranks(target);
  const auto ones = static_cast<double>(std::count_if(target.begin(), target.end(), [](double y) { return y > 0; }));
  const double zeros = static_cast<double>(target.size()) - ones;
  const auto squares = [&](const auto& in) {  // within the rows that are in: sum of w (y - mean)^2
    double weight = 0, sum = 0, out = 0;
    const auto weigh = [&](std::size_t i) { return !binary ? 1.0 : target[i] > 0 ? 1 / ones : 1 / zeros; };
    for (std::size_t i = 0; i < target.size(); ++i) {
      if (in(i)) weight += weigh(i), sum += weigh(i) * response[i];
    }
    for (std::size_t i = 0; i < target.size(); ++i) {
      if (in(i)) out += weigh(i) * std::pow(response[i] - sum / weight, 2);
    }
    return out;
  };
  const double all = squares([](std::size_t) { return true; });
  Question1 best;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::set<double> values(columns[k].begin(), columns[k].end());
    for (auto at = values.begin(); at != values.end(); ++at) {
      const bool choice = choices.contains(k);
      if (!choice && std::next(at) == values.end()) break;
      const auto yes = [&](std::size_t i) { return choice ? columns[k][i] == *at : columns[k][i] > *at; };
      std::size_t count = 0;
      for (std::size_t i = 0; i < target.size(); ++i) count += yes(i);
      if (count < least || target.size() - count < least) continue;
      const double gain = all - squares(yes) - squares([&](std::size_t i) { return !yes(i); });
      if (gain > best.gain * (1 + 1e-9) + 1e-12) best = {k, gain, *at, choice ? *at : *std::next(at)};
    }
  }
  return best;
}

// Claim: the first question of a tree is the best of all questions, for classes and for numbers, with ties in values
// and with choices among the parameters; a threshold lies in the middle of two values that were seen.
TEST(TreeBySearch, TheFirstQuestionIsTheBest) {
  std::mt19937_64 random(131);
  std::normal_distribution<double> normal;
  int asked = 0;
  for (int round = 0; round < 40; ++round) {
    const bool binary = round % 2 == 0;
    const std::size_t n = 60 + random() % 60;
    std::vector<Column> columns(3, Column(n));
    Column target(n);
    for (std::size_t i = 0; i < n; ++i) {
      columns[0][i] = normal(random);
      columns[1][i] = static_cast<double>(random() % 5);
      columns[2][i] = static_cast<double>(random() % 4);
      const double score = round % 3 == 0   ? 2 * columns[0][i]
                           : round % 3 == 1 ? (columns[2][i] == 2 ? 2.5 : 0)
                                            : columns[1][i] - 2;
      target[i] = binary ? (score + normal(random) > 0.5 ? 1 : 0) : score + normal(random);
    }
    const DecisionTree tree = grow_tree(features_of(columns, {2}), target, binary);
    if (tree.depth == 0) continue;
    ++asked;
    const Question1 wanted = best_question(columns, {2}, target, binary, std::max<std::size_t>(2, n / 50));
    const TreeNode& root = tree.nodes[0];
    EXPECT_EQ(root.feature, static_cast<int>(wanted.feature)) << round;
    EXPECT_NEAR(root.threshold, 0.5 * (wanted.below + wanted.above), 1e-12) << round;
  }
  EXPECT_GE(asked, 35);
}

/// Walks down a tree as its documentation says.
std::size_t leaf_of(const DecisionTree& tree, const std::vector<TreeFeature>& features, std::size_t row) {
  std::size_t at = 0;
  while (tree.nodes[at].feature >= 0) {
    const TreeNode& node = tree.nodes[at];
    const TreeFeature& feature = features[static_cast<std::size_t>(node.feature)];
    const double value = feature.values[row];
    const bool yes = feature.choice ? value == node.threshold : value > node.threshold;
    at = static_cast<std::size_t>(yes ? node.yes : node.no);
  }
  return at;
}

// Claim: counts and means of all nodes are those of the rows that come to them (rows without a target do not count),
// also where more rows than 4000 were thinned to grow from; rules are the leaves, in falling order of their means.
TEST(TreeBySearch, NodesCountTheirRows) {
  std::mt19937_64 random(132);
  for (const std::size_t n : {300u, 9000u}) {
    for (const bool binary : {true, false}) {
      std::vector<Column> columns(2, Column(n));
      Column target(n);
      for (std::size_t i = 0; i < n; ++i) {
        for (Column& column : columns) column[i] = static_cast<double>(random() % 1000) / 1000;
        const double noise = static_cast<double>(random() % 1000) / 1000;
        target[i] = binary ? (columns[0][i] > 0.6 && columns[1][i] < 0.5 ? noise < 0.9 : noise < 0.1)
                           : (columns[0][i] > 0.5 ? 3 : 0) + noise;
        if (random() % 17 == 0) target[i] = std::nan("");
      }
      const auto features = features_of(columns);
      const DecisionTree tree = grow_tree(features, target, binary);
      ASSERT_GE(tree.depth, 1);
      std::vector<std::size_t> rows(tree.nodes.size());
      std::vector<double> sums(tree.nodes.size());
      std::size_t valid = 0;
      for (std::size_t i = 0; i < n; ++i) {
        if (std::isnan(target[i])) continue;
        ++valid;
        const std::size_t leaf = leaf_of(tree, features, i);
        ++rows[leaf];
        sums[leaf] += target[i];
      }
      EXPECT_EQ(tree.nodes[0].rows, valid);
      std::size_t in_rules = 0;
      double before = std::numeric_limits<double>::infinity();
      for (const TreeRule& rule : rules_of(tree)) {
        EXPECT_LE(rule.mean, before);
        EXPECT_LE(rule.conditions.size(), 3u);
        before = rule.mean;
        in_rules += rule.rows;
      }
      EXPECT_EQ(in_rules, valid) << "each row is in one rule";
      for (std::size_t k = 0; k < tree.nodes.size(); ++k) {
        if (tree.nodes[k].feature >= 0 || rows[k] == 0) continue;
        EXPECT_EQ(tree.nodes[k].rows, rows[k]);
        EXPECT_NEAR(tree.nodes[k].mean, sums[k] / static_cast<double>(rows[k]), 1e-9);
      }
    }
  }
}

// Claim: a rule's conditions, asked in their order, choose exactly the rows that it counts.
TEST(TreeBySearch, RulesChooseTheirRows) {
  std::mt19937_64 random(133);
  const std::size_t n = 400;
  std::vector<Column> columns(2, Column(n));
  Column target(n);
  for (std::size_t i = 0; i < n; ++i) {
    columns[0][i] = static_cast<double>(random() % 100);
    columns[1][i] = static_cast<double>(random() % 3);
    target[i] = columns[0][i] > 70 || columns[1][i] == 1 ? random() % 10 < 9 : random() % 10 < 1;
  }
  const DecisionTree tree = grow_tree(features_of(columns, {1}), target, true);
  const std::vector<TreeRule> rules = rules_of(tree);
  ASSERT_GE(rules.size(), 3u);
  for (const TreeRule& rule : rules) {
    std::size_t rows = 0;
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const bool in = std::all_of(rule.conditions.begin(), rule.conditions.end(), [&](const TreeRule::Condition& c) {
        const double x = columns[static_cast<std::size_t>(c.feature)][i];
        return (c.feature == 1 ? x == c.threshold : x > c.threshold) == c.yes;
      });
      rows += in;
      sum += in ? target[i] : 0;
    }
    EXPECT_EQ(rule.rows, rows);
    EXPECT_NEAR(rule.mean, sum / static_cast<double>(rows), 1e-12);
    EXPECT_GE(rule.rows, n / 50) << "leaves are not smaller";
  }
}

// Claim: where nothing decides, the tree's p-value is below 5 % in at most 5 % of 200 campaigns, for classes and
// numbers together (false alarm: 4 standard errors), and its skill on unseen rows is chance's on average (5 standard
// errors).
TEST(TreeBySearch, FalseAlarmsAreAsRareAsTheySay) {
  std::mt19937_64 random(134);
  int alarms = 0;
  double skill[2] = {0, 0};
  constexpr int kCampaigns = 200;
  for (int campaign = 0; campaign < kCampaigns; ++campaign) {
    const bool binary = campaign % 2 == 0;
    std::vector<Column> columns(4, Column(80));
    Column target(80);
    for (std::size_t i = 0; i < 80; ++i) {
      for (Column& column : columns) column[i] = static_cast<double>(random() % 10000);
      target[i] = binary ? static_cast<double>(random() % 3 == 0) : static_cast<double>(random() % 1000);
    }
    const DecisionTree tree = grow_tree(features_of(columns), target, binary);
    alarms += tree.p_value < 0.05;
    skill[binary] += (tree.skill - tree.chance) / (0.5 * kCampaigns);
    EXPECT_EQ(tree.chance, binary ? 0.5 : 0.0);
  }
  EXPECT_LE(alarms, (0.05 + 4 * std::sqrt(0.0475 / kCampaigns)) * kCampaigns);
  EXPECT_NEAR(skill[1], 0, 5 * 0.065 / std::sqrt(0.5 * kCampaigns) + 0.02);
  EXPECT_NEAR(skill[0], 0, 5 * 0.15 / std::sqrt(0.5 * kCampaigns) + 0.05);
}

// Claim: a cause that decides alone is found with (nearly) full skill, a p-value that could not come by chance, and no
// deeper tree than it takes; the majority and the accuracy are shares of all rows.
TEST(TreeBySearch, OneCauseTakesOneQuestion) {
  std::mt19937_64 random(135);
  std::vector<Column> columns(3, Column(200));
  Column target(200);
  for (std::size_t i = 0; i < 200; ++i) {
    for (Column& column : columns) column[i] = static_cast<double>(random() % 10000) / 10000;
    target[i] = columns[1][i] > 0.8 ? 1 : 0;
  }
  const DecisionTree tree = grow_tree(features_of(columns), target, true);
  EXPECT_EQ(tree.depth, 1);
  EXPECT_EQ(tree.nodes[0].feature, 1);
  EXPECT_GT(tree.skill, 0.95);
  EXPECT_LT(tree.p_value, 1e-8);
  const double share = static_cast<double>(std::count(target.begin(), target.end(), 1.0)) / 200;
  EXPECT_DOUBLE_EQ(tree.majority, std::max(share, 1 - share));
  EXPECT_GT(tree.accuracy, 0.95);
  EXPECT_EQ(rules_of(tree)[0].mean, 1);
  EXPECT_TRUE(rules_of(tree)[0].conditions[0].yes);
}

// Claim: what cannot be asked is not: no rows, seven rows, one class, one row of a class, constant parameters,
// parameters that may not be asked about; all with the counts that there are.
TEST(TreeBySearch, WhatCannotBeAskedIsALeaf) {
  const Column line = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, flat(10, 3.0), half = {0, 0, 0, 0, 0, 1, 1, 1, 1, 1};
  const auto asks = [](const std::vector<TreeFeature>& features, const Column& target, bool binary) {
    const DecisionTree tree = grow_tree(features, target, binary);
    EXPECT_EQ(rules_of(tree).size(), tree.depth == 0 ? 1u : rules_of(tree).size());
    return tree.depth;
  };
  EXPECT_EQ(asks({{line, false}}, half, true), 1);
  EXPECT_EQ(asks({{flat, false}}, half, true), 0);
  EXPECT_EQ(asks({{{}, false}}, half, true), 0);
  EXPECT_EQ(asks({}, half, true), 0);
  EXPECT_EQ(asks({{line, false}}, Column(10, 1.0), true), 0);
  EXPECT_EQ(asks({{line, false}}, {0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, true), 0);
  EXPECT_EQ(asks({{Column{1, 2, 3, 4, 5, 6, 7}, false}}, {1, 2, 3, 4, 5, 6, 7}, false), 0);
  const DecisionTree none = grow_tree({{Column{}, false}}, Column{}, true);
  EXPECT_EQ(none.nodes[0].rows, 0u);
  EXPECT_EQ(none.p_value, 1);
  EXPECT_TRUE(rules_of(DecisionTree{}).empty());
}

// Claim: of two parameters that are the same the first is asked about, and a monotone change of a parameter changes no
// answer.
TEST(TreeBySearch, EqualParametersAndOtherScales) {
  std::mt19937_64 random(136);
  Column x(150), y(150);
  for (std::size_t i = 0; i < 150; ++i) {
    x[i] = static_cast<double>(random() % 10000) / 10000;
    y[i] = x[i] > 0.4 ? 1 : 0;
    if (random() % 12 == 0) y[i] = 1 - y[i];
  }
  Column stretched = x;
  for (double& value : stretched) value = std::exp(5 * value);
  const DecisionTree twice = grow_tree(features_of({x, x}), y, true),
                     other = grow_tree(features_of({stretched}), y, true);
  ASSERT_GE(twice.depth, 1);
  for (const TreeNode& node : twice.nodes) EXPECT_LE(node.feature, 0);
  EXPECT_EQ(other.depth, twice.depth);
  EXPECT_EQ(other.nodes[0].rows, twice.nodes[0].rows);
  ASSERT_EQ(other.nodes.size(), twice.nodes.size());
  for (std::size_t k = 0; k < other.nodes.size(); ++k) EXPECT_EQ(other.nodes[k].rows, twice.nodes[k].rows);
  EXPECT_NEAR(other.skill, twice.skill, 0.05) << "a threshold lies in the middle of two values, which moves";
}

}  // namespace
}  // namespace graze
