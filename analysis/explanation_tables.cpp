// An explanation as flat tables, for CSV.
#include <fmt/format.h>

#include <cmath>

#include "analysis/cause_numbers.h"
#include "analysis/explanation.h"

namespace graze {
namespace {

using Row = std::vector<std::string>;

/// With as many digits as give the same bits when they are read again; what is not known is an empty cell.
std::string cell(double x) { return std::isnan(x) ? "" : fmt::format("{}", x); }
std::string cell(std::uint64_t x) { return std::to_string(x); }

ExplanationTable causes_of(const Explanation& all) {
  ExplanationTable out{"causes", {"policy", "target"}, {}};
  for (const std::string& name : cause_columns()) out.head.push_back(name);
  for (const PolicyExplanation& policy : all.policies) {
    for (const Causes& causes : policy.causes) {
      for (const ParameterEffect& effect : causes.effects) {
        Row row = {policy.policy, causes.target};
        for (std::string& one : cause_cells(effect, all.parameters)) row.push_back(std::move(one));
        out.rows.push_back(std::move(row));
      }
    }
  }
  return out;
}

ExplanationTable rules_of_all(const Explanation& all) {
  ExplanationTable out{"rules",
                       {"policy", "target", "better_than_chance", "skill", "standard_error", "chance", "p_value",
                        "rule", "traces", "mean"},
                       {}};
  for (const PolicyExplanation& policy : all.policies) {
    for (const Causes& causes : policy.causes) {
      if (causes.effects.empty()) continue;
      for (const TreeRule& rule : rules_of(causes.tree)) {
        const DecisionTree& tree = causes.tree;
        out.rows.push_back({policy.policy, causes.target, causes.tree_tells ? "1" : "0", cell(tree.skill),
                            cell(tree.standard_error), cell(tree.chance), cell(tree.p_value),
                            rule_text(rule, all.parameters), cell(rule.rows), cell(rule.mean)});
      }
    }
  }
  return out;
}

ExplanationTable spread_of(const Explanation& all) {
  ExplanationTable out{"spread",
                       {"policy", "traces", "degree_of_freedom", "unit", "n", "mean", "median", "deviation", "iqr",
                        "dip", "p_value", "p_holm", "modes", "first_cut"},
                       {}};
  for (const PolicyExplanation& policy : all.policies) {
    for (const Scatter* scatter : {&policy.ended, &policy.all}) {
      for (const FreedomSpread& f : scatter->freedoms) {
        out.rows.push_back({policy.policy, scatter == &policy.ended ? "ended" : "all", f.name, f.unit,
                            cell(scatter->traces), cell(f.mean), cell(f.median), cell(f.deviation), cell(f.iqr),
                            cell(f.dip), cell(f.p_value), cell(f.p_holm), cell(f.modes.size()),
                            f.cuts.empty() ? "" : cell(f.cuts[0])});
      }
    }
  }
  return out;
}

ExplanationTable modes_of(const Explanation& all) {
  ExplanationTable out{"modes", {"policy", "degree_of_freedom", "particle", "mode"}, {}};
  for (const PolicyExplanation& policy : all.policies) {
    for (std::size_t k = 0; k < policy.modes.size(); ++k) {
      const std::string& name = policy.ended.freedoms[static_cast<std::size_t>(policy.ended.clearest)].name;
      for (const std::uint64_t particle : policy.modes[k].particles) {
        out.rows.push_back({policy.policy, name, cell(particle), cell(std::uint64_t{k + 1})});
      }
    }
  }
  return out;
}

ExplanationTable survival_of_all(const Explanation& all) {
  ExplanationTable out{"survival", {"policy", "until", "time", "at_risk", "failed", "share", "low", "high"}, {}};
  for (const PolicyExplanation& policy : all.policies) {
    for (const Survival& s : policy.survival) {
      for (const SurvivalStep& at : s.steps) {
        out.rows.push_back({policy.policy, s.what, cell(at.time), cell(at.at_risk), cell(at.failed), cell(at.share),
                            cell(at.interval.low), cell(at.interval.high)});
      }
    }
  }
  return out;
}

ExplanationTable margins_of(const Explanation& all) {
  ExplanationTable out{"margins", {"policy", "margin", "unit", "n"}, {}};
  for (const double p : kMarginQuantiles) out.head.push_back(fmt::format("q{}", p));
  for (const char* name : {"worst", "worst_particle", "below_0", "low", "high"}) out.head.emplace_back(name);
  for (const PolicyExplanation& policy : all.policies) {
    for (const MarginSummary& m : policy.margins) {
      Row row = {policy.policy, m.name, m.unit, cell(m.n)};
      for (const double quantile : m.quantiles) row.push_back(cell(quantile));
      const std::string particle = m.n > 0 ? cell(std::uint64_t{m.worst_particle}) : "";
      for (const std::string& one :
           {cell(m.worst), particle, cell(m.below), cell(m.interval.low), cell(m.interval.high)}) {
        row.push_back(one);
      }
      out.rows.push_back(std::move(row));
    }
  }
  return out;
}

ExplanationTable rates_of(const Explanation& all) {
  ExplanationTable out{"rates",
                       {"policy", "n", "success", "unknown_failure", "rate", "low", "high", "simultaneous_low",
                        "simultaneous_high", "best", "best_low", "best_high"},
                       {}};
  for (const RateBounds& r : all.rates.policies) {
    out.rows.push_back({r.policy, cell(r.n), cell(r.success), cell(r.unknown), cell(r.worst),
                        cell(r.worst_interval.low), cell(r.worst_interval.high), cell(r.simultaneous.low),
                        cell(r.simultaneous.high), cell(r.best), cell(r.best_interval.low),
                        cell(r.best_interval.high)});
  }
  return out;
}

}  // namespace

std::vector<ExplanationTable> explanation_tables(const Explanation& all) {
  return {causes_of(all),       rules_of_all(all), spread_of(all), modes_of(all),
          survival_of_all(all), margins_of(all),   rates_of(all)};
}

}  // namespace graze
