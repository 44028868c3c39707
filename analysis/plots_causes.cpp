// Pictures of what `graze explain` finds: how long traces last, and which parameters matter.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/plots.h"
#include "analysis/plots_text.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

/// A step function: it keeps its value until the next time.
void add_stair(const Survival& survival, double end, PlotSeries& out) {
  const auto point = [&](double time, double share, const Interval& interval) {
    out.x.push_back(time);
    out.y.push_back(share);
    out.low.push_back(interval.low);
    out.high.push_back(interval.high);
  };
  double share = 1;
  Interval interval{1, 1};
  point(0, share, interval);
  for (const SurvivalStep& step : survival.steps) {
    point(step.time, share, interval);
    share = step.share;
    interval = step.interval;
    point(step.time, share, interval);
  }
  point(std::max(end, out.x.back()), share, interval);
}

constexpr std::size_t kMostEffects = 8;
constexpr double kLeastP = 1e-4;  // that is told

const Causes* causes_with(const PolicyExplanation& policy, const std::string& target) {
  for (const Causes& one : policy.causes) {
    if (one.target == target) return &one;
  }
  return nullptr;
}

PlotPanel effects_panel(const PolicyExplanation& policy, const std::string& target, const ParticleTable& table) {
  PlotPanel out;
  out.title = policy.policy;
  out.y.grid = false;
  out.x.title = "Effect";
  out.x.zero = true;
  const Causes* causes = causes_with(policy, target);
  if (causes == nullptr || causes->effects.empty()) {
    out.height = 60;
    out.x = {"", 0, 1, {{-1, ""}}, false};  // no ticks
    out.y = {"", 0, 1, {{-1, ""}}, false};
    out.instead = table.rows() == 0
                      ? "The archive does not keep the particles' values."
                      : fmt::format("'{}': too few traces, or none went another way: nothing to explain.", target);
    return out;
  }
  out.title += fmt::format(": {} of {} parameters significant", causes->significant, causes->effects.size());
  const std::size_t n = std::min(kMostEffects, causes->effects.size());
  for (std::size_t i = 0; i < n; ++i) {
    const ParameterEffect& effect = causes->effects[i];
    const double y = static_cast<double>(n - 1 - i);
    const auto& column = table.columns[effect.column];
    out.y.labels.emplace_back(y, column.name + (effect.label.empty() ? "" : " (" + effect.label + ")"));
    if (!std::isfinite(effect.effect)) continue;
    PlotSeries bar;
    bar.kind = PlotSeries::Kind::boxes;
    bar.color = i < causes->significant ? policy_color(0) : PlotColor::pale;
    bar.x = {std::min(0.0, effect.effect)};
    bar.high = {std::max(0.0, effect.effect)};
    bar.y = {y - 0.3};
    bar.low = {y + 0.3};
    out.series.push_back(std::move(bar));
    out.words.push_back(
        {std::max(0.0, effect.effect), y,
         fmt::format("{} (p {})", plot_number(std::round(effect.effect * 1e3) / 1e3),
                     effect.p_holm < kLeastP ? "< 0.0001"
                                             : "= " + plot_number(std::round(effect.p_holm / kLeastP) * kLeastP))});
  }
  out.y.low = -0.7;
  out.y.high = static_cast<double>(n) - 0.3;
  out.height = 22 * static_cast<double>(n);
  return out;
}

/// One range for all panels, so that bars of policies compare.
void share_range(std::vector<PlotPanel>& panels) {
  double most = 0.1;
  for (const PlotPanel& panel : panels) {
    for (const PlotSeries& bar : panel.series) most = std::max({most, -bar.x.front(), bar.high.front()});
  }
  for (PlotPanel& panel : panels) {
    if (!panel.instead.empty()) continue;
    for (PlotWords& one : panel.words) one.x += 0.03 * most;  // not on the line at 0
    panel.x.low = -1.15 * most;
    panel.x.high = 1.6 * most;
  }
}

}  // namespace

Figure survival_figure(const std::vector<PolicySurvival>& all, const std::string& what, double end) {
  Figure out{"survival", what == "any requirement" ? "How long traces last" : "How long traces last: " + what};
  const bool objective = what == "objective";
  const std::string share = objective ? "Share that has not failed" : "Share without a violation";
  PlotPanel panel{"", {"Time [s]", 0, end > 0 ? end : 1}, {share, -0.02, 1.03}};
  panel.height = 320;
  std::size_t failed = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Survival& survival = all[i].survival;
    PlotSeries line;
    line.color = policy_color(i);
    line.dashed = i >= kPolicyColors;
    line.width = 2;
    if (survival.traces > 0) add_stair(survival, end, line);
    out.legend.push_back({fmt::format("{} ({} of {} {})", all[i].policy, survival.failed, survival.traces,
                                      objective ? "failed" : "violated"),
                          line.color, line.dashed ? PlotLegend::Kind::dashed : PlotLegend::Kind::line});
    panel.series.push_back(std::move(line));
    failed += survival.failed;
  }
  out.panels.push_back(std::move(panel));
  out.notes.push_back(
      fmt::format("Kaplan and Meier's estimate of the time until {} is violated; bands: 95 % at each "
                  "time (Greenwood).",
                  what));
  if (objective) out.notes.back() = "Kaplan and Meier's estimate; the objective fails at the end. Bands: 95 %.";
  if (failed == 0) {
    out.notes.insert(out.notes.begin(), objective ? "No trace failed." : fmt::format("No trace violated {}.", what));
  }
  return out;
}

Figure causes_figure(const Explanation& explanation, const std::string& requirement) {
  std::vector<std::string> names = explanation.score.requirements;
  names.emplace_back("objective");
  if (!requirement.empty()) check_plotted_name("--requirement", requirement, names);
  const std::string target = requirement.empty()          ? "success"
                             : requirement == "objective" ? "failure: objective unmet"
                                                          : "failure: " + requirement;
  Figure out{"causes", "Which parameters matter for " + (requirement.empty() ? "success" : target)};
  out.legend = {{"significant (p < 0.05)", policy_color(0)}, {"not significant", PlotColor::pale}};
  for (const PolicyExplanation& policy : explanation.policies) {
    out.panels.push_back(effects_panel(policy, target, explanation.parameters));
  }
  share_range(out.panels);
  out.notes = {
      fmt::format("The {} parameters with the smallest p. Effect: 2 AUC − 1, the rank-biserial correlation; above 0: "
                  "higher values go with it. Of a choice: the root of the share of the ranks' variance, and the "
                  "choice with the highest mean.",
                  kMostEffects),
      "p: Holm's correction for all parameters and all that graze explain asks about."};
  for (const std::string& note : explanation.notes) out.notes.push_back(note + ".");
  return out;
}

}  // namespace graze
