#pragma once
// Causes: which uncertain parameters tell traces apart that succeed from those that do not, wide margins from narrow
// ones, one mode of behaviour from another. docs/statistics.md says what each number means and how often it is wrong.

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "analysis/decision_tree.h"

namespace graze {

/// What particles differ in: a column for each uncertain parameter, a row for each particle.
struct ParticleTable {
  struct Column {
    std::string name, unit = {};
    std::vector<std::string> labels = {};  // of a discrete choice, by value; empty: a number
    std::vector<double> values = {};       // [row]
  };
  std::vector<Column> columns;
  std::size_t rows() const { return columns.empty() ? 0 : columns[0].values.size(); }
};

/// What is to be explained: 0 or 1 for each row (whether it happened), or a number (a margin). NaN: this row does not
/// count.
struct CauseTarget {
  std::string name;
  std::vector<double> values;  // [row]
};

/// What one parameter has to do with a target.
struct ParameterEffect {
  std::size_t column = 0;  // of the table
  std::string test;        // rank-sum, spearman, fisher, kruskal-wallis
  /// In -1 .. 1, > 0: higher values of the parameter go with 1, or with higher values of the target. rank-sum: 2 AUC -
  /// 1; spearman: the correlation. Of choices in 0 .. 1: the root of the share of the ranks' variance between them.
  double effect = 0;
  double spearman = 0;          // NaN: a choice
  double auc = 0;               // P(higher where 1 than where 0), a tie counts half; NaN: a choice, or no 0/1 target
  std::string label;            // of a choice: the one with the highest mean of the target
  double p_rank = 1;            // of the test
  double hsic = 0, p_hsic = 1;  // dependence of any shape; NaN: not tested
  double p_value = 1;           // of both tests together: twice the smaller one
  double p_holm = 1;            // corrected for all parameters and targets
  double partial = 0, p_partial = 1;  // rank correlation given all other parameters; NaN: not computed
  double share = 0;        // first-order Sobol index: of the target's variance, what this parameter alone explains
  double share_noise = 0;  // standard deviation that the share of an idle parameter has; both NaN: not computed
  /// Whether the p-value is that of a dependence that rising or falling tells little of. (Of a steep step both tests
  /// are certain, and HSIC the more so: the trend is what there is to say.)
  bool of_any_shape() const { return std::abs(effect) < 0.5 && p_hsic < 1e-3 * p_rank; }
};

/// What explains one target.
struct Causes {
  std::string target;
  bool binary = false;
  std::size_t rows = 0, ones = 0;        // that count; binary: of these, where it happened
  std::vector<ParameterEffect> effects;  // of parameters that vary, the smallest p-value first
  std::size_t significant = 0;           // the first so many have p_holm < 0.05
  DecisionTree tree;                     // features: the table's columns
  bool tree_tells = false;               // better than chance
  std::vector<std::string> notes;        // what was left out, and why
  bool explained() const { return significant > 0 || tree_tells; }
};

/// False alarms: with nothing to find, any parameter is called significant for any target in at most 5 % of calls, any
/// tree better than chance in at most 1 %.
inline constexpr double kCauseLevel = 0.05, kTreeLevel = 0.01;

/// Explains each target. Everything is a function of the arguments alone. Memory: about as
/// much again as the table. Throws std::invalid_argument if columns or targets differ in length.
std::vector<Causes> find_causes(const ParticleTable& table, const std::vector<CauseTarget>& targets);

/// A table of numbers. values: [row][names.size()], row-major.
ParticleTable particle_table(std::span<const double> values, const std::vector<std::string>& names);
/// The same for one target, of the rows that `mask` has (empty: all).
Causes find_causes(const ParticleTable& table, CauseTarget target, const std::vector<bool>& mask = {});
Causes find_causes(std::span<const double> values, const std::vector<std::string>& names, CauseTarget target,
                   const std::vector<bool>& mask = {});

/// "robot.link.RF_FOOT.length > 0.1021 m and contact.model is compliant".
std::string rule_text(const TreeRule& rule, const ParticleTable& table);
/// In a sentence: the parameters that matter, in order, with direction and effect; or "no parameter explains it".
std::string verdict_text(const Causes& causes, const ParticleTable& table);

}  // namespace graze
