#include "analysis/report_causes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/report_survival.h"
#include "archive/files/shell_word.h"

namespace graze {
namespace {

constexpr std::size_t kMostEffectsOfQuestion = 10;  // of a question in the table
constexpr std::size_t kMostBars = 12, kMostFigures = 6;
constexpr std::size_t kMostTrees = 60;

bool about_outcomes(const Causes& causes) { return causes.binary && !causes.target.starts_with("mode"); }

std::string counted_share(const Causes& causes) {
  return causes.binary ? fmt::format("{} of {}", causes.ones, causes.rows) : std::to_string(causes.rows);
}

std::string skill_text(const DecisionTree& tree) {
  return tree.binary
             ? fmt::format("balanced accuracy {:.2f} ± {:.2f} on traces kept out, chance 0.50", tree.skill,
                           tree.standard_error)
             : fmt::format("rank correlation {:.2f} ± {:.2f} on traces kept out", tree.skill, tree.standard_error);
}

Json questions_table(const Explanation& all) {
  Json rows = Json::array();
  for (const PolicyExplanation& policy : all.policies) {
    for (std::size_t i = 0; i < policy.causes.size(); ++i) {
      const Causes& causes = policy.causes[i];
      rows.push_back({policy.policy, causes.target, counted_share(causes), policy.verdicts[i],
                      causes.tree_tells ? Json(skill_text(causes.tree)) : Json()});
    }
    if (policy.causes.empty()) {
      const bool there = all.parameters.rows() > 0;
      rows.push_back(
          {policy.policy, nullptr, std::to_string(policy.n),
           there ? "not asked: all traces have ended alike" : "not asked: there are no parameters to ask about",
           nullptr});
    }
  }
  return {{"type", "table"},
          {"title", "What explains it"},
          {"columns",
           {"Policy",
            {{"name", "Question"}, {"class", "wrap"}},
            {{"name", "Traces"}, {"align", "right"}},
            {{"name", "Answer"}, {"class", "wrap wide"}},
            {{"name", "Tree"}, {"class", "wrap"}}}},
          {"rows", rows}};
}

/// In words, by the rule of verdict_text().
std::string direction(const ParameterEffect& effect, const ParticleTable::Column& column, bool binary) {
  if (!column.labels.empty()) return fmt::format("{} where it is {}", binary ? "most often" : "highest", effect.label);
  if (effect.of_any_shape()) {
    return "depends on it, not by rising or falling with it alone";
  }
  return fmt::format("{} where it is {}", binary ? "more often" : "higher", effect.effect > 0 ? "larger" : "smaller");
}

Json parameters_table(const Explanation& all) {
  Json rows = Json::array();
  std::size_t left_out = 0;
  for (const PolicyExplanation& policy : all.policies) {
    for (const Causes& causes : policy.causes) {
      const std::size_t count = std::min(causes.significant, kMostEffectsOfQuestion);
      left_out += causes.significant - count;
      for (std::size_t i = 0; i < count; ++i) {
        const ParameterEffect& effect = causes.effects[i];
        const ParticleTable::Column& column = all.parameters.columns[effect.column];
        rows.push_back({policy.policy, causes.target, column.name, short_number(effect.effect), p_cell(effect.p_holm),
                        direction(effect, column, causes.binary)});
      }
    }
  }
  if (rows.empty()) return nullptr;
  Json out = {{"type", "table"},
              {"title", "Parameters that matter"},
              {"columns",
               {"Policy",
                {{"name", "Question"}, {"class", "wrap"}},
                {{"name", "Parameter"}, {"class", "wrap"}},
                {{"name", "Rank correlation"},
                 {"digits", 2},
                 {"title", "of a question of yes or no 2 AUC - 1; of a choice the correlation ratio of ranks, 0 to 1"},
                 {"align", "right"}},
                {{"name", "p, corrected"}, {"title", "by Holm, for all parameters and questions"}, {"align", "right"}},
                {{"name", "Direction"}, {"class", "wrap"}}}},
              {"rows", rows}};
  if (left_out > 0)
    out["note"] =
        fmt::format("{} weaker ones are left out, of questions with more than {}.", left_out, kMostEffectsOfQuestion);
  return out;
}

/// Of one question, over all policies.
Json effect_bars(const Explanation& all, const std::string& target) {
  struct Bar {
    double size;
    Json json;
  };
  std::vector<Bar> bars;
  for (std::size_t p = 0; p < all.policies.size(); ++p) {
    for (const Causes& causes : all.policies[p].causes) {
      if (causes.target != target || !about_outcomes(causes)) continue;
      for (std::size_t i = 0; i < causes.significant; ++i) {
        const ParameterEffect& effect = causes.effects[i];
        bars.push_back({std::abs(effect.effect),
                        {{"label", all.policies[p].policy + ": " + all.parameters.columns[effect.column].name},
                         {"value", short_number(effect.effect)},
                         {"color", fmt::format("policy-{}", p)}}});
      }
    }
  }
  if (bars.empty()) return nullptr;
  std::stable_sort(bars.begin(), bars.end(), [](const Bar& a, const Bar& b) { return a.size > b.size; });
  bars.resize(std::min(bars.size(), kMostBars));
  Json list = Json::array();
  for (Bar& bar : bars) list.push_back(std::move(bar.json));
  return {{"type", "bars"}, {"title", target}, {"label", "Rank correlation"}, {"domain", {-1, 1}}, {"bars", list}};
}

Json effect_figures(const Explanation& all) {
  std::vector<std::string> targets;
  for (const PolicyExplanation& policy : all.policies) {
    for (const Causes& causes : policy.causes) {
      const bool known = std::find(targets.begin(), targets.end(), causes.target) != targets.end();
      if (!known && about_outcomes(causes) && causes.significant > 0) targets.push_back(causes.target);
    }
  }
  Json figures = Json::array();
  for (std::size_t i = 0; i < std::min(targets.size(), kMostFigures); ++i) {
    figures.push_back(effect_bars(all, targets[i]));
  }
  if (figures.empty()) return nullptr;
  return {{"type", "row"}, {"title", "What goes with outcomes"}, {"widgets", figures}};
}

std::string color_of(const std::string& target) {
  if (target == "success") return "success";
  return target == "failure: objective unmet" ? "unknown" : target.starts_with("failure") ? "known" : "policy-0";
}

/// Trees of one question.
class TreeRoots {
 public:
  TreeRoots(const PolicyExplanation& policy, const Causes& causes, const ParticleTable& table)
      : policy_(policy), causes_(causes), table_(table) {}

  Json root() const {
    Json out = node(0, fmt::format("{}, {}: {}", policy_.policy, causes_.target, skill_text(causes_.tree)));
    out["closed"] = !about_outcomes(causes_);
    return out;
  }

 private:
  Json node(int at, std::string label) const {
    const TreeNode& one = causes_.tree.nodes[static_cast<std::size_t>(at)];
    Json out = {{"label", std::move(label)}, {"n", one.rows}, {"said", said(one)}};
    if (causes_.binary) {
      const double ones = std::round(one.mean * static_cast<double>(one.rows));
      out["parts"] = {{{"name", causes_.target}, {"value", ones}, {"color", color_of(causes_.target)}},
                      {{"name", "others"}, {"value", static_cast<double>(one.rows) - ones}, {"color", "invalid"}}};
    }
    out["children"] = Json::array();
    if (one.feature < 0) return out;
    for (const bool yes : {true, false}) {
      const TreeRule question{{{one.feature, one.threshold, yes}}};
      out["children"].push_back(node(yes ? one.yes : one.no, rule_text(question, table_)));
    }
    return out;
  }

  std::string said(const TreeNode& node) const {
    if (causes_.binary) return fmt::format("{:.0f} %", 100 * node.mean);
    const MarginSummary* const margins = margins_of(causes_, policy_.margins);
    return margins ? mean_text(node.mean, *margins) : fmt::format("{:.3g}", node.mean);
  }

  const PolicyExplanation& policy_;
  const Causes& causes_;
  const ParticleTable& table_;
};

/// Of the colours that the bars of these trees have.
Json legend(const std::vector<std::string>& colors) {
  constexpr std::pair<const char*, const char*> kNames[] = {{"success", "Success"},
                                                            {"known", "Known failure"},
                                                            {"unknown", "Unknown failure"},
                                                            {"policy-0", "Mode"},
                                                            {"invalid", "Others"}};
  Json out = Json::array();
  for (const auto& [color, name] : kNames) {
    if (std::find(colors.begin(), colors.end(), color) != colors.end())
      out.push_back({{"name", name}, {"color", color}});
  }
  return out;
}

Json trees(const Explanation& all) {
  Json roots = Json::array();
  std::vector<std::string> colors;
  std::size_t left_out = 0;
  for (const PolicyExplanation& policy : all.policies) {
    for (const Causes& causes : policy.causes) {
      if (!causes.tree_tells) continue;
      if (roots.size() == kMostTrees) {
        ++left_out;
        continue;
      }
      roots.push_back(TreeRoots(policy, causes, all.parameters).root());
      if (causes.binary) colors.insert(colors.end(), {color_of(causes.target), "invalid"});
    }
  }
  if (roots.empty()) return nullptr;
  std::string note =
      "Only trees that are better than chance. A bar is the share of traces in which it happened; of a margin its mean "
      "stands there.";
  if (left_out > 0) note += fmt::format(" {} more trees are left out.", left_out);
  return {{"type", "tree"}, {"title", "Decision trees"}, {"legend", legend(colors)}, {"root", roots}, {"note", note}};
}

Json states_table(const Explanation& all) {
  const auto to_the_end = [](const PolicyExplanation& policy) { return policy.all.traces == policy.ended.traces; };
  const bool alike = std::all_of(all.policies.begin(), all.policies.end(), to_the_end);
  Json rows = Json::array();
  for (const PolicyExplanation& policy : all.policies) {
    Json row = {policy.policy, policy.ended.traces, scatter_text(policy.ended)};
    if (!alike) row.push_back(to_the_end(policy) ? Json() : Json(scatter_text(policy.all)));
    rows.push_back(std::move(row));
  }
  Json columns = {"Policy",
                  {{"name", "Ran to the end"}, {"title", "traces"}},
                  {{"name", "Their final states"}, {"class", "wrap wide"}}};
  if (!alike) columns.push_back({{"name", "With those that ended early"}, {"class", "wrap wide"}});
  return {
      {"type", "table"}, {"title", "Final states: scattering or bifurcation"}, {"columns", columns}, {"rows", rows}};
}

Json modes_bars(const Explanation& all) {
  Json bars = Json::array();
  for (const PolicyExplanation& policy : all.policies) {
    if (!policy.ended.bifurcates()) continue;
    const FreedomSpread& freedom = policy.ended.freedoms[static_cast<std::size_t>(policy.ended.clearest)];
    for (std::size_t k = 0; k < policy.modes.size(); ++k) {
      const ModeTraces& mode = policy.modes[k];
      const std::string unit = freedom.unit.empty() ? "" : " " + freedom.unit;
      bars.push_back(
          {{"label", fmt::format("{}: {} at {:.3g}{}", policy.policy, freedom.name, freedom.modes[k].mean, unit)},
           {"parts",
            {{{"name", "Success"}, {"value", mode.success}, {"color", "success"}},
             {{"name", "Known failure"}, {"value", mode.known}, {"color", "known"}},
             {{"name", "Unknown failure"}, {"value", mode.unknown}, {"color", "unknown"}}}}});
    }
  }
  if (bars.empty()) return nullptr;
  return {{"type", "bars"}, {"title", "Modes of final states"}, {"label", "Traces"}, {"bars", bars}};
}

std::string lead(const Explanation& all, const std::string& archive) {
  std::string out =
      "Which uncertain parameters tell traces apart, by the tests of graze explain. p is corrected for all parameters "
      "and questions of a policy: where nothing matters, anything is called significant in 5 % of policies at most.";
  if (all.looked_at < all.score.part.count(all.particles)) {
    out += fmt::format(" Of the first {} particles; graze explain {} asks more of them.", all.looked_at,
                       shell_word(archive));
  }
  return out;
}

}  // namespace

Json causes_section(const Explanation& all, const std::string& archive) {
  Json widgets = Json::array();
  const auto add = [&](Json widget) {
    if (!widget.is_null()) widgets.push_back(std::move(widget));
  };
  if (all.parameters.rows() > 0) {
    add(questions_table(all));
    add(effect_figures(all));
    add(parameters_table(all));
    add(trees(all));
  }
  for (const std::string& note : all.notes) {
    if (note.starts_with("no causes")) add({{"type", "text"}, {"text", note}});
  }
  add(states_table(all));
  add(modes_bars(all));
  return {{"id", "causes"}, {"title", "Causes"}, {"text", lead(all, archive)}, {"widgets", widgets}};
}

}  // namespace graze
