#include "analysis/report_survival.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/number_words.h"

namespace graze {
namespace {

constexpr double kLevel = 0.05;
constexpr std::size_t kMostSteps = 500;  // of a curve: more are finer than a pixel
constexpr std::size_t kMostPlots = 7;    // any requirement, and so many of them

/// Of many steps some, evenly, with the last: each point drawn is a point of the estimate.
std::vector<SurvivalStep> drawn_steps(const std::vector<SurvivalStep>& steps) {
  if (steps.size() <= kMostSteps) return steps;
  std::vector<SurvivalStep> out;
  for (std::size_t i = 1; i <= kMostSteps; ++i) out.push_back(steps[i * steps.size() / kMostSteps - 1]);
  return out;
}

/// From 1 at the beginning to the last time at which a trace was seen.
Json curve(const std::string& policy, std::size_t place, const Survival& survival, NumberForm form) {
  std::vector<double> x = {0}, y = {1}, low = {1}, high = {1};
  for (const SurvivalStep& step : drawn_steps(survival.steps)) {
    x.push_back(step.time);
    y.push_back(step.share);
    low.push_back(step.interval.low);
    high.push_back(step.interval.high);
  }
  if (survival.seen_until > x.back()) {
    x.push_back(survival.seen_until);
    y.push_back(y.back());
    low.push_back(low.back());
    high.push_back(high.back());
  }
  return {{"name", policy},
          {"x", numbers(x, form)},
          {"y", numbers(y, form)},
          {"low", numbers(low, form)},
          {"high", numbers(high, form)},
          {"color", fmt::format("policy-{}", place)}};
}

/// The curves of all policies until requirement k of PolicyExplanation::survival, 0: any.
Json plot(const Explanation& all, std::size_t k, NumberForm form) {
  Json lines = Json::array();
  for (std::size_t i = 0; i < all.policies.size(); ++i) {
    const Survival& survival = all.policies[i].survival[k];
    if (survival.traces > 0) lines.push_back(curve(all.policies[i].policy, i, survival, form));
  }
  const std::string what = all.policies[0].survival[k].what;
  return {{"type", "lines"},
          {"title", k == 0 ? "Until any requirement is violated" : "Until violated: " + what},
          {"steps", true},
          {"x", {{"title", "Time"}, {"unit", "s"}}},
          {"y", {{"title", "Share that has not failed"}, {"domain", {-0.03, 1.03}}}},
          {"lines", lines}};
}

std::uint64_t failed(const Explanation& all, std::size_t k) {
  std::uint64_t sum = 0;
  for (const PolicyExplanation& policy : all.policies) sum += policy.survival[k].failed;
  return sum;
}

/// The objective, which stands last, fails at the end alone: its curve would say no more than its share.
std::vector<std::size_t> violated(const Explanation& all) {
  std::vector<std::size_t> out;
  for (std::size_t k = 1; k + 1 < all.policies[0].survival.size(); ++k) {
    if (failed(all, k) > 0) out.push_back(k);
  }
  return out;
}

Json time_cell(double x) { return std::isnan(x) ? Json() : short_number(x); }

Json table(const Explanation& all) {
  Json rows = Json::array();
  for (const PolicyExplanation& policy : all.policies) {
    for (std::size_t k = 0; k + 1 < policy.survival.size(); ++k) {
      const Survival& one = policy.survival[k];
      if (one.traces == 0 || (k > 0 && one.failed == 0)) continue;
      const bool never = one.steps.empty();
      const Interval interval = never ? Interval{} : one.steps.back().interval;
      rows.push_back({policy.policy, one.what, one.traces, one.failed, never ? 1.0 : one.steps.back().share,
                      never ? Json() : Json(fmt::format("{:.3f} … {:.3f}", interval.low, interval.high)),
                      time_cell(one.median)});
    }
  }
  return {{"type", "table"},
          {"title", "What is left"},
          {"columns",
           {"Policy",
            "Until",
            {{"name", "Traces"}, {"title", "valid ones"}},
            "Failed",
            {{"name", "Left at the end"}, {"digits", 3}},
            {{"name", "95 % interval"}, {"align", "right"}},
            {{"name", "Median"}, {"unit", "s"}, {"title", "none: more than half last"}, {"align", "right"}}}},
          {"rows", rows}};
}

Json pairs_table(const Explanation& all) {
  Json rows = Json::array();
  for (const SurvivalPair& pair : all.pairs) {
    rows.push_back({pair.a, pair.b, p_cell(pair.paired.p_value), p_cell(pair.p_holm), p_cell(pair.plain.p_value)});
  }
  return {{"type", "table"},
          {"title", "Whether two policies differ: log-rank tests"},
          {"columns",
           {"a",
            "b",
            {{"name", "p of pairs"}, {"title", "uses that both policies met the same particles"}, {"align", "right"}},
            {{"name", "p of pairs, corrected"}, {"title", "by Holm, for the number of pairs"}, {"align", "right"}},
            {{"name", "p, unpaired"}, {"title", "takes traces as independent"}, {"align", "right"}}}},
          {"rows", rows}};
}

std::string verdict(const Explanation& all) {
  const LogRank& test = all.log_rank;
  return fmt::format(
      "Log-rank test of all {} policies together: chi-square {:.3g} with {:g} degree{} of freedom, {}: {}. "
      "It takes the policies' traces as independent of each other; they are of the same particles, which "
      "the tests of pairs below use.",
      all.policies.size(), test.chi_square, test.freedom, test.freedom == 1 ? "" : "s", p_words(test.p_value),
      test.p_value < kLevel ? "policies differ in how long traces last" : "no difference shows");
}

std::string lead(const Explanation& all) {
  std::string out =
      "The share of traces that have violated nothing yet, by time (Kaplan and Meier), with 95 % intervals of each "
      "time "
      "alone. A trace that violates nothing counts as seen until its end, whether it meets its objective or not.";
  for (const std::string& note : all.notes) out += fmt::format(" Only {}.", note);
  return out;
}

}  // namespace

Json p_cell(double p) {
  if (std::isnan(p)) return nullptr;
  return {{"value", short_number(p)}, {"text", p_text(p)}};
}

std::string p_words(double p) { return p_equation(p); }

Json survival_section(const Explanation& all, NumberForm form) {
  const auto has_traces = [](const PolicyExplanation& policy) { return policy.n > 0; };
  if (std::none_of(all.policies.begin(), all.policies.end(), has_traces)) return nullptr;
  Json widgets = Json::array();
  const std::vector<std::size_t> requirements = violated(all);
  if (requirements.empty()) {
    widgets.push_back({{"type", "text"}, {"text", "No requirement was violated: there are no curves."}});
  } else {
    Json plots = Json::array({plot(all, 0, form)});
    // One requirement alone has the curve of any.
    for (std::size_t i = 0; requirements.size() > 1 && i < std::min(requirements.size(), kMostPlots - 1); ++i) {
      plots.push_back(plot(all, requirements[i], form));
    }
    widgets.push_back({{"type", "row"}, {"widgets", plots}});
    if (requirements.size() > kMostPlots - 1) {
      const std::string text = fmt::format("Curves of {} more requirements are left out; the table has them.",
                                           requirements.size() + 1 - kMostPlots);
      widgets.push_back({{"type", "text"}, {"text", text}});
    }
    if (!std::isnan(all.log_rank.p_value)) widgets.push_back({{"type", "text"}, {"text", verdict(all)}});
  }
  widgets.push_back(table(all));
  if (!all.pairs.empty() && !requirements.empty()) widgets.push_back(pairs_table(all));
  return {{"id", "survival"}, {"title", "Survival"}, {"text", lead(all)}, {"widgets", widgets}};
}

}  // namespace graze
