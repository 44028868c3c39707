// An explanation as flat tables, for CSV.
#include <fmt/format.h>

#include <cmath>

#include "analysis/cause_numbers.h"
#include "analysis/explanation.h"
#include "archive/files/csv.h"

namespace graze {
namespace {

using Row = std::vector<std::string>;

/// With as many digits as give the same bits when they are read again; what is not known is an empty cell.
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
        out.rows.push_back({policy.policy, causes.target, causes.tree_tells ? "1" : "0", csv_number(tree.skill),
                            csv_number(tree.standard_error), csv_number(tree.chance), csv_number(tree.p_value),
                            rule_text(rule, all.parameters), csv_number(rule.rows), csv_number(rule.mean)});
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
                            csv_number(scatter->traces), csv_number(f.mean), csv_number(f.median),
                            csv_number(f.deviation), csv_number(f.iqr), csv_number(f.dip), csv_number(f.p_value),
                            csv_number(f.p_holm), csv_number(f.modes.size()),
                            f.cuts.empty() ? "" : csv_number(f.cuts[0])});
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
        out.rows.push_back({policy.policy, name, csv_number(particle), cell(std::uint64_t{k + 1})});
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
        out.rows.push_back({policy.policy, s.what, csv_number(at.time), csv_number(at.at_risk), csv_number(at.failed),
                            csv_number(at.share), csv_number(at.interval.low), csv_number(at.interval.high)});
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
      Row row = {policy.policy, m.name, m.unit, csv_number(m.n)};
      for (const double quantile : m.quantiles) row.push_back(csv_number(quantile));
      const std::string particle = m.n > 0 ? cell(std::uint64_t{m.worst_particle}) : "";
      for (const std::string& one : {csv_number(m.worst), particle, csv_number(m.below), csv_number(m.interval.low),
                                     csv_number(m.interval.high)}) {
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
    out.rows.push_back({r.policy, csv_number(r.n), csv_number(r.success), csv_number(r.unknown), csv_number(r.worst),
                        csv_number(r.worst_interval.low), csv_number(r.worst_interval.high),
                        csv_number(r.simultaneous.low), csv_number(r.simultaneous.high), csv_number(r.best),
                        csv_number(r.best_interval.low), csv_number(r.best_interval.high)});
  }
  return out;
}

ExplanationTable convergence_of(const Explanation& all) {
  ExplanationTable out{
      "convergence",
      {"policy", "traces", "steps", "unconverged_steps", "unconverged_traces", "median_change", "largest_change",
       "braked_steps", "braked_traces", "most_braked", "flagged", "flagged_success", "first_flagged"},
      {}};
  for (const PolicyScore& policy : all.score.policies) {
    const Convergence& c = policy.convergence;
    if (c.traces == 0) continue;  // the back end does not tell
    const bool some = c.unconverged_steps > 0;
    out.rows.push_back({policy.policy, cell(c.traces), cell(c.steps), cell(c.unconverged_steps),
                        cell(c.unconverged_traces), some ? csv_number(c.median_change) : "",
                        some ? csv_number(c.largest_change) : "", cell(c.braked_steps), cell(c.braked_traces),
                        csv_number(c.most_braked), cell(c.flagged_all()), cell(c.flagged_in(Outcome::success)),
                        c.first_flagged ? cell(std::uint64_t{*c.first_flagged}) : ""});
  }
  return out;
}

}  // namespace

std::vector<ExplanationTable> explanation_tables(const Explanation& all) {
  return {causes_of(all),       rules_of_all(all), spread_of(all), modes_of(all),
          survival_of_all(all), margins_of(all),   rates_of(all),  convergence_of(all)};
}

}  // namespace graze
