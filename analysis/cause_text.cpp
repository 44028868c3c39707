// Causes in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/causes.h"
#include "analysis/number_words.h"

namespace graze {
namespace {

constexpr std::size_t kNamed = 5;  // parameters in a verdict

std::string with_unit(double value, const std::string& unit) {
  return fmt::format("{:.4g}{}{}", value, unit.empty() || unit == "1" ? "" : " ", unit == "1" ? "" : unit);
}

std::string condition_text(const TreeRule::Condition& condition, const ParticleTable::Column& column) {
  if (column.labels.empty()) {
    return fmt::format("{} {} {}", column.name,
                       condition.yes ? ">" : "<=", with_unit(condition.threshold, column.unit));
  }
  auto value = static_cast<std::size_t>(std::clamp(condition.threshold, 0.0, 1e6));
  const bool other = !condition.yes && column.labels.size() == 2 && value < 2;
  if (other) value = 1 - value;
  const std::string label = value < column.labels.size() ? column.labels[value] : fmt::format("{}", value);
  return fmt::format("{} {} {}", column.name, condition.yes || other ? "is" : "is not", label);
}

/// Of the bounds of a number on one side the last alone: a tree only ever tightens them.
std::vector<TreeRule::Condition> tightest(const std::vector<TreeRule::Condition>& all, const ParticleTable& table) {
  std::vector<TreeRule::Condition> out;
  for (const TreeRule::Condition& one : all) {
    const auto wider = std::find_if(out.begin(), out.end(), [&](const TreeRule::Condition& other) {
      return other.feature == one.feature && other.yes == one.yes;
    });
    const bool number = table.columns[static_cast<std::size_t>(one.feature)].labels.empty();
    if (number && wider != out.end()) {
      wider->threshold = one.threshold;
    } else {
      out.push_back(one);
    }
  }
  return out;
}

/// "more often where a.b is larger (AUC 0.83, p = 2e-05)".
std::string effect_text(const ParameterEffect& effect, bool binary, const ParticleTable& table) {
  const ParticleTable::Column& column = table.columns[effect.column];
  const std::string p = p_equation(effect.p_holm, 1);
  if (!column.labels.empty()) {
    return fmt::format("{} where {} is {} (effect {:.2f}, {})", binary ? "most often" : "highest", column.name,
                       effect.label, effect.effect, p);
  }
  if (effect.of_any_shape()) {
    return fmt::format("it depends on {}, not by rising or falling with it alone (HSIC {:.2f}, {})", column.name,
                       effect.hsic, p);
  }
  const char* where = effect.effect > 0 ? "larger" : "smaller";
  return binary ? fmt::format("more often where {} is {} (AUC {:.2f}, {})", column.name, where, effect.auc, p)
                : fmt::format("higher where {} is {} (rank correlation {:+.2f}, {})", column.name, where,
                              effect.spearman, p);
}

}  // namespace

std::string rule_text(const TreeRule& rule, const ParticleTable& table) {
  std::string out;
  for (const TreeRule::Condition& condition : tightest(rule.conditions, table)) {
    out += (out.empty() ? "" : " and ") +
           condition_text(condition, table.columns[static_cast<std::size_t>(condition.feature)]);
  }
  return out.empty() ? "always" : out;
}

std::string verdict_text(const Causes& causes, const ParticleTable& table) {
  if (causes.effects.empty()) return causes.notes.empty() ? "not tested: there are no parameters" : causes.notes.back();
  if (!causes.explained()) return "no parameter explains it";
  std::string out;
  const std::size_t named = std::min(causes.significant, kNamed);
  for (std::size_t i = 0; i < named; ++i) {
    out += (i > 0 ? "; " : "") + effect_text(causes.effects[i], causes.binary, table);
  }
  if (causes.significant > named) out += fmt::format("; and {} more", causes.significant - named);
  if (causes.significant == 0) {
    out = fmt::format(
        "no parameter alone, but several together tell it: {} {:.2f} on traces kept out, where chance "
        "has {:.2f}",
        causes.binary ? "balanced accuracy" : "rank correlation", causes.tree.skill, causes.tree.chance);
  }
  return out;
}

}  // namespace graze
