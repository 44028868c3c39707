#include "analysis/cause_numbers.h"

#include <fmt/format.h>

#include <cmath>

namespace graze {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN and no infinity.
Json of(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

template <class T, class Function>
Json list(const std::vector<T>& values, const Function& function) {
  Json out = Json::array();
  for (const T& value : values) out.push_back(function(value));
  return out;
}

std::string cell(double x) { return std::isnan(x) ? "" : fmt::format("{}", x); }

Json of(const ParameterEffect& e, const ParticleTable& table) {
  return {{"parameter", table.columns[e.column].name},
          {"test", e.test},
          {"effect", of(e.effect)},
          {"spearman", of(e.spearman)},
          {"auc", of(e.auc)},
          {"highest_choice", e.label.empty() ? Json(nullptr) : Json(e.label)},
          {"p_rank", of(e.p_rank)},
          {"hsic", of(e.hsic)},
          {"p_hsic", of(e.p_hsic)},
          {"p_value", of(e.p_value)},
          {"p_holm", of(e.p_holm)},
          {"partial", of(e.partial)},
          {"p_partial", of(e.p_partial)},
          {"share_of_variance", of(e.share)},
          {"share_noise", of(e.share_noise)}};
}

Json of(const DecisionTree& tree, const ParticleTable& table) {
  const Json rules = list(rules_of(tree), [&](const TreeRule& rule) {
    return Json{{"rule", rule_text(rule, table)}, {"traces", rule.rows}, {"mean", of(rule.mean)}};
  });
  return {{"depth", tree.depth},
          {"skill", of(tree.skill)},
          {"skill_is", tree.binary ? "balanced_accuracy" : "rank_correlation"},
          {"chance", tree.chance},
          {"standard_error", of(tree.standard_error)},
          {"accuracy", tree.binary ? of(tree.accuracy) : Json(nullptr)},
          {"majority", tree.binary ? of(tree.majority) : Json(nullptr)},
          {"p_value", of(tree.p_value)},
          {"rules", rules}};
}

}  // namespace

Json causes_json(const Causes& c, const ParticleTable& table) {
  return {{"target", c.target},
          {"binary", c.binary},
          {"traces", c.rows},
          {"ones", c.binary ? Json(c.ones) : Json(nullptr)},
          {"explained", c.explained()},
          {"verdict", verdict_text(c, table)},
          {"significant", c.significant},
          {"effects", list(c.effects, [&](const ParameterEffect& e) { return of(e, table); })},
          {"tree_tells", c.tree_tells},
          {"tree", of(c.tree, table)},
          {"notes", c.notes}};
}

std::vector<std::string> cause_columns() {
  return {"parameter", "test",    "effect", "spearman", "auc",       "highest_choice",    "p_rank",     "hsic",
          "p_hsic",    "p_value", "p_holm", "partial",  "p_partial", "share_of_variance", "share_noise"};
}

std::vector<std::string> cause_cells(const ParameterEffect& e, const ParticleTable& table) {
  return {table.columns[e.column].name,
          e.test,
          cell(e.effect),
          cell(e.spearman),
          cell(e.auc),
          e.label,
          cell(e.p_rank),
          cell(e.hsic),
          cell(e.p_hsic),
          cell(e.p_value),
          cell(e.p_holm),
          cell(e.partial),
          cell(e.p_partial),
          cell(e.share),
          cell(e.share_noise)};
}

}  // namespace graze
