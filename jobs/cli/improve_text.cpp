#include "jobs/cli/improve_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/text_table.h"
#include "jobs/campaign/improvement_words.h"

namespace graze {
namespace {

std::string margin_text(double x) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", x); }

/// "94 %"; what is not all of it is never told as all.
std::string share_text(double share) {
  const double percent = 100 * share;
  return share < 1 && percent > 99 ? fmt::format("{:.4g} %", std::min(percent, 99.99))
                                   : fmt::format("{:.0f} %", percent);
}

std::string margins_text(const Scenario& scenario, const ImproveStep& step) {
  const std::vector<std::string> names = limit_names(scenario), units = limit_units(scenario);
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!(step.margins_before[k] < 0 || step.margins_after[k] < 0)) continue;
    parts.push_back(fmt::format("{} {} -> {}{} (predicted {})", names[k], margin_text(step.margins_before[k]),
                                margin_text(step.margins_after[k]), unit_behind(units[k]),
                                margin_text(step.predicted[k])));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string changes_text(const DesignBlock& block, const ImproveStep& step) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < block.variables.size(); ++i) {
    const DesignVariable& one = block.variables[i];
    if (std::abs(step.after[i] - step.before[i]) < kToldChange * (one.upper - one.lower)) continue;
    parts.push_back(one.name + " " + change_words(one, step.before[i], step.after[i], " -> "));
  }
  return parts.empty() ? "no variable by a ten thousandth of its way" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string kinks_text(const Scenario& scenario, const ImproveStep& step) {
  const std::vector<std::string> limits = limit_names(scenario);
  std::map<std::string, std::set<std::string>> by_limit;
  bool contacts = false;
  for (const StepKink& one : step.kinks) {
    if (!(step.margins_before[static_cast<std::size_t>(one.limit)] < 0)) continue;  // it holds
    by_limit[limits[static_cast<std::size_t>(one.limit)]].insert(
        scenario.redesign->variables[static_cast<std::size_t>(one.variable)].name);
    contacts = contacts || one.contacts;
  }
  std::string out;
  for (const auto& [limit, variables] : by_limit) {
    out += fmt::format("      kink: '{}' has no slope in {}{}\n", limit, fmt::join(variables, ", "),
                       contacts ? " (contacts change)" : "");
  }
  return out;
}

/// "      before the step 2 of 16 particles have no valid trace (…), …"
std::string lost_text(const ImproveStep& step) {
  std::string out;
  if (step.lost_before.count > 0) out += fmt::format("      before this step {}\n", lost_words(step.lost_before));
  if (step.lost_after.count > 0) out += fmt::format("      after this step {}\n", lost_words(step.lost_after));
  return out;
}

}  // namespace

std::string step_text(const Scenario& scenario, const ImproveState& state, std::size_t number) {
  const ImproveStep& step = state.steps[number];
  const DesignBlock& block = *scenario.redesign;
  std::string out = fmt::format(
      "{:4}  {}; without violation {} -> {} of the trace; step {:.3g}{}\n      {}\n", number + 1,
      margins_text(scenario, step), share_text(step.progress_before), share_text(step.progress_after), step.size,
      step.rolled_back == 0 ? "" : fmt::format(", {} larger rolled back", step.rolled_back), changes_text(block, step));
  if (std::isfinite(step.to)) out += fmt::format("      window {:.3g} .. {:.3g} s\n", step.from, step.to);
  out += lost_text(step) + kinks_text(scenario, step);
  for (const Revert& one : step.reverts) {
    out += fmt::format("      {} takes back {:.0f} % of what step {} did\n",
                       block.variables[static_cast<std::size_t>(one.variable)].name, 100 * one.share, one.step + 1);
  }
  return out;
}

std::string reached_text(const Scenario& scenario, const ReachedLevel& level) {
  const std::vector<std::string> names = limit_names(scenario), units = limit_units(scenario);
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < names.size(); ++k) {
    parts.push_back(fmt::format("{} {}{}", names[k], margin_text(level.margins[k]), unit_behind(units[k])));
  }
  return fmt::format("Every limit holds in {} after {} step{}: {}\n", task_words(*scenario.redesign, level.level),
                     level.steps, level.steps == 1 ? "" : "s", fmt::join(parts, ", "));
}

std::string summary_text(const Scenario& scenario, const ImproveState& state, const DesignValues& improved) {
  std::vector<std::vector<std::string>> table = {{"variable", "unit", "initial", "improved", "from", "to", ""}};
  for (std::size_t i = 0; i < improved.size(); ++i) {
    const DesignVariable& one = scenario.redesign->variables[i];
    const double way = one.upper - one.lower;
    const bool idle = std::find(state.idle.begin(), state.idle.end(), static_cast<int>(i)) != state.idle.end();
    const bool bound =
        one.choices.empty() && (improved[i] - one.lower < 1e-6 * way || one.upper - improved[i] < 1e-6 * way);
    table.push_back({one.name, one.unit, fmt::format("{:.4g}", one.nominal / one.scale),
                     fmt::format("{:.4g}", improved[i] / one.scale), fmt::format("{:.4g}", one.lower / one.scale),
                     fmt::format("{:.4g}", one.upper / one.scale),
                     idle                  ? "moved no limit at first"
                     : bound               ? "at its bound"
                     : one.choices.empty() ? ""
                                           : value_words(one, improved[i])});
  }
  std::string out = "\n" + text_table(table, 2) + "\n";
  const std::string task = task_words(*scenario.redesign, state.level);
  if (const std::string lost = lost_words(state.lost); !lost.empty()) {
    out += fmt::format("In {}, {}: the last design is judged without what they lack.\n", task, lost);
  }
  const std::size_t made = steps_made(state), more = state.steps.size() - made;
  if (more > 0) {
    out += fmt::format(
        "The improved robot is that of {}, after {} step{}: {} later one{}, for a task that was not done, "
        "{} not in it.\n",
        task_words(*scenario.redesign, state.reached.back().level), made, made == 1 ? "" : "s", more,
        more == 1 ? "" : "s", more == 1 ? "is" : "are");
  }
  switch (state.end) {
    case ImproveEnd::reached_all:
      return out + "Every limit holds in every task.\n";
    case ImproveEnd::stuck:
      return out + fmt::format("Stuck in {}: {}\n", task, state.why);
    default:
      return out +
             fmt::format("Not finished: in {} limits are violated. The same command (without --answers) goes on.\n",
                         task);
  }
}

}  // namespace graze
