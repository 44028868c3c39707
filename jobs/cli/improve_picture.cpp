#include "jobs/cli/improve_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace graze {
namespace {

constexpr double kWordsApart = 0.06;                                 // of names, shares of the way
constexpr double kBreak = std::numeric_limits<double>::quiet_NaN();  // of a line

/// Of each step the value before it and after it; a task that becomes harder between two steps breaks the line.
template <class Value>
PlotSeries over_steps(const std::vector<ImproveStep>& steps, std::size_t color, const Value& value) {
  PlotSeries out;
  out.color = policy_color(color);
  out.dashed = color >= kPolicyColors;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (k > 0 && steps[k].level != steps[k - 1].level) out.x.push_back(kBreak), out.y.push_back(kBreak);
    out.x.push_back(static_cast<double>(k)), out.y.push_back(value(steps[k], false));
    out.x.push_back(static_cast<double>(k) + 1), out.y.push_back(value(steps[k], true));
  }
  return out;
}

PlotPanel panel_of(const std::string& title, const std::string& y, const ImproveState& state) {
  PlotPanel out;
  out.title = title;
  out.x.title = "design step";
  out.x.low = 0, out.x.high = 1.15 * std::max(1.0, static_cast<double>(state.steps.size()));  // room for names
  out.y.title = y;
  out.height = 200;
  if (state.steps.empty()) out.instead = "No step was made.";
  return out;
}

PlotPanel progress_panel(const ImproveState& state, std::size_t tasks) {
  PlotPanel out = panel_of("Progress", "tasks done", state);
  out.y.low = 0, out.y.high = static_cast<double>(tasks);
  PlotSeries line;
  line.width = 2.4;
  for (std::size_t k = 0; k < state.steps.size(); ++k) {
    const ImproveStep& step = state.steps[k];
    line.x.push_back(static_cast<double>(k)), line.y.push_back(static_cast<double>(step.level) + step.progress_before);
    line.x.push_back(static_cast<double>(k) + 1),
        line.y.push_back(static_cast<double>(step.level) + step.progress_after);
  }
  // A task that the last step has done.
  if (!state.reached.empty() && !state.steps.empty() && state.reached.back().steps >= state.steps.size()) {
    line.x.push_back(static_cast<double>(state.reached.back().steps));
    line.y.push_back(static_cast<double>(state.reached.back().level) + 1);
  }
  out.series.push_back(std::move(line));
  return out;
}

}  // namespace

Figure improve_figure(const Scenario& scenario, const ImproveState& state) {
  const DesignBlock& block = *scenario.redesign;
  const std::vector<std::string> limits = limit_names(scenario);
  Figure out{"improve", "From failures to a better robot"};
  out.subtitle = fmt::format("{}, {} design steps, {} of {} tasks done", scenario.name, state.steps.size(),
                             state.reached.size(), std::max<std::size_t>(1, block.task_values.size()));
  out.panels.push_back(progress_panel(state, std::max<std::size_t>(1, block.task_values.size())));
  PlotPanel margins = panel_of("Margins of the limits", "in units of the first one", state);
  margins.y.zero = true;
  for (std::size_t k = 0; k < limits.size() && !state.scales.empty(); ++k) {
    margins.series.push_back(over_steps(state.steps, k, [&](const ImproveStep& step, bool after) {
      return (after ? step.margins_after : step.margins_before)[k] / state.scales[k];
    }));
    out.legend.push_back(
        {limits[k], policy_color(k), k >= kPolicyColors ? PlotLegend::Kind::dashed : PlotLegend::Kind::line});
  }
  out.panels.push_back(std::move(margins));
  PlotPanel design = panel_of("Design", "way from bound to bound", state);
  design.y.low = 0, design.y.high = 1;
  for (std::size_t i = 0; i < block.variables.size(); ++i) {
    const DesignVariable& one = block.variables[i];
    const double way = one.upper - one.lower;
    PlotSeries line = over_steps(state.steps, i, [&](const ImproveStep& step, bool after) {
      return ((after ? step.after : step.before)[i] - one.lower) / way;
    });
    const auto is_near = [&](const PlotWords& other) { return std::abs(other.y - line.y.back()) < kWordsApart; };
    if (!line.y.empty() && std::none_of(design.words.begin(), design.words.end(), is_near)) {
      design.words.push_back({line.x.back(), line.y.back(), one.name, line.color});
    }
    design.series.push_back(std::move(line));
  }
  out.panels.push_back(std::move(design));
  out.notes.push_back("Margins below 0 violate their limit; where a task is done the next one has margins of its own.");
  return out;
}

}  // namespace graze
