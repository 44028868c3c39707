#include "analysis/cause_numbers.h"

#include <fmt/format.h>

#include <cmath>

#include "analysis/json_of.h"
#include "archive/files/csv.h"

namespace graze {
namespace {

using Json = nlohmann::ordered_json;
using graze::json_of;

Json json_of(const ParameterEffect& e, const ParticleTable& table) {
  return {{"parameter", table.columns[e.column].name},
          {"test", e.test},
          {"effect", json_of(e.effect)},
          {"spearman", json_of(e.spearman)},
          {"auc", json_of(e.auc)},
          {"highest_choice", e.label.empty() ? Json(nullptr) : Json(e.label)},
          {"p_rank", json_of(e.p_rank)},
          {"hsic", json_of(e.hsic)},
          {"p_hsic", json_of(e.p_hsic)},
          {"p_value", json_of(e.p_value)},
          {"p_holm", json_of(e.p_holm)},
          {"partial", json_of(e.partial)},
          {"p_partial", json_of(e.p_partial)},
          {"share_of_variance", json_of(e.share)},
          {"share_noise", json_of(e.share_noise)}};
}

Json json_of(const DecisionTree& tree, const ParticleTable& table) {
  const Json rules = json_list(rules_of(tree), [&](const TreeRule& rule) {
    return Json{{"rule", rule_text(rule, table)}, {"traces", rule.rows}, {"mean", json_of(rule.mean)}};
  });
  return {{"depth", tree.depth},
          {"skill", json_of(tree.skill)},
          {"skill_is", tree.binary ? "balanced_accuracy" : "rank_correlation"},
          {"chance", tree.chance},
          {"standard_error", json_of(tree.standard_error)},
          {"accuracy", tree.binary ? json_of(tree.accuracy) : Json(nullptr)},
          {"majority", tree.binary ? json_of(tree.majority) : Json(nullptr)},
          {"p_value", json_of(tree.p_value)},
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
          {"effects", json_list(c.effects, [&](const ParameterEffect& e) { return json_of(e, table); })},
          {"tree_tells", c.tree_tells},
          {"tree", json_of(c.tree, table)},
          {"notes", c.notes}};
}

std::vector<std::string> cause_columns() {
  return {"parameter", "test",    "effect", "spearman", "auc",       "highest_choice",    "p_rank",     "hsic",
          "p_hsic",    "p_value", "p_holm", "partial",  "p_partial", "share_of_variance", "share_noise"};
}

std::vector<std::string> cause_cells(const ParameterEffect& e, const ParticleTable& table) {
  return {table.columns[e.column].name,
          e.test,
          csv_number(e.effect),
          csv_number(e.spearman),
          csv_number(e.auc),
          e.label,
          csv_number(e.p_rank),
          csv_number(e.hsic),
          csv_number(e.p_hsic),
          csv_number(e.p_value),
          csv_number(e.p_holm),
          csv_number(e.partial),
          csv_number(e.p_partial),
          csv_number(e.share),
          csv_number(e.share_noise)};
}

}  // namespace graze
