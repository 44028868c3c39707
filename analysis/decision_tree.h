#pragma once
// A shallow decision tree: the few questions about parameters that tell traces apart best, and whether they do so for
// traces that the tree has not seen.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace graze {

/// What the tree may ask about.
struct TreeFeature {
  std::span<const double> values;  // [row]; empty: it may not ask about this
  bool choice = false;             // asked "is it this one?", else "is it larger?"
};

struct TreeNode {
  int feature = -1;      // -1: a leaf
  double threshold = 0;  // yes: values > threshold; of a choice: values == threshold
  int yes = -1, no = -1;
  std::size_t rows = 0;
  double mean = 0;  // of the target in these rows: of 0 and 1 the share of 1
  int depth = 0;
};

struct DecisionTree {
  std::vector<TreeNode> nodes;  // [0]: all rows
  int depth = 0;                // questions one after the other, at most; 0: it asks nothing
  bool binary = false;
  /// On rows that were kept out, five folds. Binary: balanced accuracy, the mean of both classes' share of right
  /// answers; `chance` 0.5 is what always naming the same class earns. Else: Spearman's correlation of prediction and
  /// target; chance 0.
  double skill = 0, chance = 0, standard_error = 0;
  double majority = 0;  // binary: the share of the larger class, the accuracy of naming it always
  double accuracy = 0;  // binary: share of right answers, unbalanced
  /// One-sided, of skill > chance. Folds are not independent of each other, so it is of a test of its own: grown on one
  /// half, asked about the other (Fisher's exact test, or Student's of the correlation), and the other way round; the
  /// smallest of both halves and three depths times six.
  double p_value = 1;
};

/// Questions in words: the way from the root to a leaf.
struct TreeRule {
  struct Condition {
    int feature;
    double threshold;
    bool yes;
  };
  std::vector<Condition> conditions;
  std::size_t rows = 0;
  double mean = 0;
};

/// Grows a tree of depth <= 3 by least squares, with both classes weighing alike where the target is 0 and 1, leaves of
/// at least max(2, 2 %) rows; the depth is the least whose cross-validated skill is within a standard error of the
/// best. Rows whose target is NaN do not count. Of more than 4000 it grows from 4000, chosen evenly, of 0 and 1 from up
/// to 2000 of the rarer; counts and means of nodes are of all. Folds are drawn with a fixed seed, class by class.
DecisionTree grow_tree(const std::vector<TreeFeature>& features, std::span<const double> target, bool binary);

/// Leaves, those with the highest mean first.
std::vector<TreeRule> rules_of(const DecisionTree& tree);

}  // namespace graze
