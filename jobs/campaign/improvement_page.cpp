#include "jobs/campaign/improvement_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/number_words.h"
#include "analysis/proportions.h"
#include "jobs/campaign/page_scene.h"

namespace graze {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();  // of a line
constexpr std::size_t kPageColors = 8;                             // further lines are dashed
constexpr std::size_t kMostPlanes = 24;                            // torque-speed planes: more nobody looks at

Json text_widget(const std::string& text) { return {{"type", "text"}, {"text", text}}; }

Json number_cell(double value, const std::string& unit) {
  if (!std::isfinite(value)) return nullptr;
  const std::string text = fmt::format("{}{:.4g}{}", value < 0 ? "\u2212" : "", std::abs(value), unit_behind(unit));
  return {{"value", short_number(value)}, {"text", text}};
}

Json wrapped_column(const char* name, const char* title) {
  return {{"name", name}, {"title", title}, {"align", "right"}};
}

// ---- what came of it

Json rate_bar(const char* label, std::uint64_t success, std::uint64_t n, const char* color) {
  const Interval interval = wilson(success, n);
  return {{"label", label},
          {"value", n > 0 ? static_cast<double>(success) / static_cast<double>(n) : 0},
          {"low", interval.low},
          {"high", interval.high},
          {"color", color}};
}

Json outcome_section(const Redesign& redesign) {
  const RedesignWords words = redesign_words(redesign);
  Json widgets = {text_widget(words.failed), text_widget(words.changed), text_widget(words.now),
                  text_widget(words.verdict)};
  if (redesign.verdict) {
    const PolicyComparison& pair = *redesign.verdict;
    widgets.push_back({{"type", "bars"},
                       {"label", "Success rate of other particles, with 95 % intervals"},
                       {"domain", {0, 1.02}},
                       {"bars",
                        {rate_bar("First robot", pair.success_a, pair.n_a, "known"),
                         rate_bar("Improved", pair.success_b, pair.n_b, "success")}}});
  }
  return {{"id", "outcome"}, {"title", "What came of it"}, {"widgets", widgets}};
}

// ---- margins

/// Of each step the value before it and after it; a task that becomes harder between two steps breaks the line.
template <class Value>
Json step_line(const std::vector<ImproveStep>& steps, std::size_t index, const std::string& name, const Value& value) {
  std::vector<double> x, y;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (k > 0 && steps[k].level != steps[k - 1].level) x.push_back(kGap), y.push_back(kGap);
    x.push_back(static_cast<double>(k)), y.push_back(value(steps[k], false));
    x.push_back(static_cast<double>(k) + 1), y.push_back(value(steps[k], true));
  }
  return {{"name", name},
          {"color", fmt::format("policy-{}", index % kPageColors)},
          {"dash", index % (2 * kPageColors) >= kPageColors},
          {"x", numbers(x, NumberForm::plain)},
          {"y", numbers(y, NumberForm::plain)}};
}

Json step_axis(const ImproveState& state) {
  return {{"title", "Design step"}, {"domain", {0, std::max<std::size_t>(1, state.steps.size())}}};
}

/// Margins of the improved robot over the particles that it was improved on; empty: there are none of this task.
const std::vector<double>* quantile_margins(const Redesign& redesign) {
  const auto& reached = redesign.state.reached;
  if (redesign.question.options.particles.empty() || reached.empty()) return nullptr;
  return &reached.back().margins;
}

Json limits_table(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  const std::vector<std::string> names = limit_names(redesign.scenario), units = limit_units(redesign.scenario);
  const std::vector<double>* quantiles = quantile_margins(redesign);
  Json columns = {"Limit",
                  "What it is",
                  wrapped_column("First robot", "least margin along its trace"),
                  wrapped_column("Violated at", "when the first robot's margin was first below 0"),
                  wrapped_column("Improved", "least margin along its trace"),
                  "Now"};
  columns[1] = {{"name", "What it is"}, {"class", "wrap"}};
  if (quantiles) {
    columns.push_back(wrapped_column("Of the particles", "quantile over the particles that it was improved on"));
  }
  Json rows = Json::array();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const double before = limit_margin(block, k, redesign.traces.before.record);
    const double after = limit_margin(block, k, redesign.traces.improved.record);
    const bool objective = k == block.limits.size();
    const Json what = objective ? Json("the objective's margin")
                                : Json(redesign.scenario.task.requirements[block.limits[k]].description);
    Json row = {names[k],
                what,
                number_cell(before, units[k]),
                number_cell(limit_violation(block, k, redesign.traces.before.record), "s"),
                number_cell(after, units[k]),
                after < 0 ? (before < 0 ? "still violated" : "violated") : (before < 0 ? "holds now" : "holds")};
    if (quantiles) row.push_back(number_cell((*quantiles)[k], units[k]));
    rows.push_back(std::move(row));
  }
  return {{"type", "table"}, {"columns", columns}, {"rows", rows}};
}

Json limits_section(const Redesign& redesign) {
  const ImproveState& state = redesign.state;
  Json widgets = Json::array({limits_table(redesign)});
  Json lines = Json::array();
  const std::vector<std::string> names = limit_names(redesign.scenario);
  for (std::size_t k = 0; k < names.size() && !state.scales.empty(); ++k) {
    lines.push_back(step_line(state.steps, k, names[k], [&](const ImproveStep& step, bool after) {
      return (after ? step.margins_after : step.margins_before)[k] / state.scales[k];
    }));
  }
  if (!state.steps.empty()) {
    widgets.push_back({{"type", "lines"},
                       {"title", "Margins over the design steps"},
                       {"x", step_axis(state)},
                       {"y", {{"title", "Margin / size of the first one"}, {"zero", true}}},
                       {"lines", lines},
                       {"note",
                        "Below 0 a limit is violated. Where a task is done the next one has margins of its own, "
                        "and the lines begin anew."}});
  }
  return {{"id", "limits"},
          {"title", "Limits before and after"},
          {"text", fmt::format("Margins of the nominal robots in {}: how far each limit was from being violated, or by "
                               "how much it was.",
                               task_words(*redesign.scenario.redesign, redesign.level))},
          {"widgets", widgets}};
}

// ---- progress

Json progress_section(const Redesign& redesign) {
  const ImproveState& state = redesign.state;
  const double tasks = static_cast<double>(std::max<std::size_t>(1, redesign.scenario.redesign->task_values.size()));
  std::vector<double> x, y, refused_x, refused_y;
  const auto refuse = [&](std::size_t step, std::size_t level, const std::vector<RefusedStep>& all) {
    for (const RefusedStep& one : all) {
      refused_x.push_back(static_cast<double>(step) + 1);
      refused_y.push_back(static_cast<double>(level) + (std::isfinite(one.progress) ? one.progress : 0));
    }
  };
  for (std::size_t k = 0; k < state.steps.size(); ++k) {
    const ImproveStep& step = state.steps[k];
    x.push_back(static_cast<double>(k)), y.push_back(static_cast<double>(step.level) + step.progress_before);
    x.push_back(static_cast<double>(k) + 1), y.push_back(static_cast<double>(step.level) + step.progress_after);
    refuse(k, step.level, step.refused);
  }
  refuse(state.steps.size(), state.level, state.refused);
  if (!state.reached.empty() && state.reached.back().steps == state.steps.size()) {  // what the last step has done
    x.push_back(static_cast<double>(state.reached.back().steps));
    y.push_back(static_cast<double>(state.reached.back().level) + 1);
  }
  Json lines = {{{"name", "Design as it became"},
                 {"color", "success"},
                 {"x", numbers(x, NumberForm::plain)},
                 {"y", numbers(y, NumberForm::plain)}}};
  if (!refused_x.empty()) {
    lines.push_back({{"name", "Proposals that were rolled back"},
                     {"color", "known"},
                     {"line", false},
                     {"marks", true},
                     {"x", numbers(refused_x, NumberForm::plain)},
                     {"y", numbers(refused_y, NumberForm::plain)}});
  }
  const double last = static_cast<double>(std::max<std::size_t>(1, state.steps.size() + !state.refused.empty()));
  return {{"id", "progress"},
          {"title", "Progress"},
          {"text",
           "Tasks done, and of the next one the share of the trace before a limit is violated (as Figure 39 of "
           "the dissertation). A proposal that lacks no less than the design before it is rolled back; it may "
           "come as far, and violate by more."},
          {"widgets",
           {{{"type", "lines"},
             {"x", {{"title", "Design step"}, {"domain", {0, 1.02 * last}}}},
             {"y", {{"title", "Tasks done"}, {"domain", {0, 1.03 * tasks}}}},
             {"lines", lines}}}}};
}

// ---- the design

/// Of a change, what part each variable has, in shares of their ways from bound to bound.
std::vector<double> parts_of_change(const DesignBlock& block, const DesignValues& from, const DesignValues& to) {
  std::vector<double> out;
  double sum = 0;
  for (std::size_t i = 0; i < block.variables.size(); ++i) {
    const DesignVariable& one = block.variables[i];
    out.push_back(std::abs(to[i] - from[i]) / (one.upper - one.lower));
    sum += out.back();
  }
  for (double& x : out) x = sum > 0 ? x / sum : 0;
  return out;
}

std::string percent_text(double share) { return fmt::format("{:.0f} %", 100 * share); }

/// "at its lower bound"
std::string bound_words(const DesignVariable& one, double value) {
  if (!one.choices.empty()) return "";  // a choice has none
  const double near = 1e-6 * (one.upper - one.lower);
  return value - one.lower < near ? "at its lower bound" : one.upper - value < near ? "at its upper bound" : "";
}

Json value_cell(const DesignVariable& one, double value) {
  if (one.choices.empty()) return number_cell(value / one.scale, one.unit);
  return {{"value", value}, {"text", value_words(one, value)}};
}

Json variables_table(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  DesignValues initial;
  for (const DesignVariable& one : block.variables) initial.push_back(one.nominal);
  const std::vector<double> parts = parts_of_change(block, initial, redesign.improved);
  Json rows = Json::array();
  for (std::size_t i = 0; i < block.variables.size(); ++i) {
    const DesignVariable& one = block.variables[i];
    const double relative =
        one.choices.empty() ? redesign.improved[i] / one.nominal - 1 : std::numeric_limits<double>::quiet_NaN();
    const auto& idle = redesign.state.idle;
    const bool unmoved = std::find(idle.begin(), idle.end(), static_cast<int>(i)) != idle.end();
    const Json change = std::isfinite(relative) ? Json{{"value", short_number(relative)},
                                                       {"text", fmt::format("{:+.0f} %", 100 * relative)}}
                                                : Json();
    rows.push_back({one.name,
                    value_cell(one, one.nominal),
                    value_cell(one, redesign.improved[i]),
                    change,
                    value_cell(one, one.lower),
                    value_cell(one, one.upper),
                    {{"value", short_number(parts[i])}, {"text", percent_text(parts[i])}},
                    unmoved ? "moved no limit at first" : bound_words(one, redesign.improved[i])});
  }
  return {
      {"type", "table"},
      {"fold", 24},
      {"columns",
       {"Variable", wrapped_column("First", "of the first robot"), wrapped_column("Improved", "of the improved robot"),
        wrapped_column("Change", "of its first value"), wrapped_column("From", "lower bound"),
        wrapped_column("To", "upper bound"),
        wrapped_column("Share", "of the whole change, variables counted in shares of their ways from bound to bound"),
        "Note"}},
      {"rows", rows}};
}

/// A row per step: each variable's new value, and its share of that step's change.
Json steps_table(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  Json columns = {"Step", "Task"};
  for (const DesignVariable& one : block.variables) {
    const std::string unit = one.unit.empty() || one.unit == "1" ? "" : ", " + one.unit;
    const std::string title =
        fmt::format("from {:.4g} to {:.4g}{}", one.lower / one.scale, one.upper / one.scale, unit_behind(one.unit));
    columns.push_back({{"name", one.name + unit}, {"title", title}, {"align", "right"}});
  }
  Json rows = Json::array();
  for (std::size_t k = 0; k < redesign.state.steps.size(); ++k) {
    const ImproveStep& step = redesign.state.steps[k];
    const std::vector<double> parts = parts_of_change(block, step.before, step.after);
    Json row = {k + 1, step.level + 1};
    for (std::size_t i = 0; i < block.variables.size(); ++i) {
      const double value = step.after[i] / block.variables[i].scale;
      const std::string share = parts[i] < 0.005 ? "" : fmt::format(" ({})", percent_text(parts[i]));
      row.push_back({{"value", short_number(value)}, {"text", fmt::format("{:.4g}{}", value, share)}});
    }
    rows.push_back(std::move(row));
  }
  return {{"type", "table"},
          {"title", "Step by step"},
          {"columns", columns},
          {"rows", rows},
          {"note", "Values after each step; in brackets the variable's share of that step's change."}};
}

Json design_section(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  Json widgets = Json::array({variables_table(redesign)});
  if (!redesign.state.steps.empty()) {
    Json lines = Json::array();
    for (std::size_t i = 0; i < block.variables.size(); ++i) {
      const DesignVariable& one = block.variables[i];
      lines.push_back(step_line(redesign.state.steps, i, one.name, [&](const ImproveStep& step, bool after) {
        return ((after ? step.after : step.before)[i] - one.lower) / (one.upper - one.lower);
      }));
    }
    widgets.push_back({{"type", "lines"},
                       {"title", "Way from bound to bound"},
                       {"x", step_axis(redesign.state)},
                       {"y", {{"title", "0: lower bound, 1: upper bound"}, {"domain", {-0.02, 1.02}}}},
                       {"lines", lines}});
    widgets.push_back(steps_table(redesign));
  }
  return {{"id", "design"}, {"title", "Design"}, {"text", "What may be changed, and what was."}, {"widgets", widgets}};
}

// ---- motors

Json motors_section(const Redesign& redesign, NumberForm form) {
  const auto& drives = redesign.traces.before.drives;
  const Window judged = window_of_motors(redesign.scenario);
  Json planes = Json::array();
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < drives.size() && k < redesign.traces.improved.drives.size(); ++k) {
    if (!std::isfinite(drives[k].effort) && !std::isfinite(drives[k].velocity)) continue;
    if (planes.size() < kMostPlanes) {
      planes.push_back(torque_speed_plot(redesign, k, judged, form));
    } else {
      ++left_out;
    }
  }
  if (planes.empty()) return nullptr;
  const std::string when =
      judged.from > 0 || judged.to < redesign.scenario.timing.end
          ? fmt::format(" What is drawn are the times at which these limits count, {:.3g} to {:.3g} s.", judged.from,
                        std::min(judged.to, redesign.scenario.timing.end))
          : "";
  Json widgets = {{{"type", "legend"},
                   {"entries",
                    {{{"name", "Limit of the first robot"}, {"color", "ink"}, {"dash", true}},
                     {{"name", "Limit of the improved one, where it is another"}, {"color", "ink"}},
                     {{"name", "First robot"}, {"color", "known"}},
                     {{"name", "Improved"}, {"color", "success"}}}}},
                  {{"type", "row"}, {"three", true}, {"widgets", planes}}};
  if (left_out > 0) widgets.push_back(text_widget(fmt::format("{} more joints are left out.", left_out)));
  return {
      {"id", "motors"},
      {"title", "Torque and speed"},
      {"text",
       fmt::format(
           "Joints with limits of torque or speed, in {} (as Figure 45 of the dissertation). Torques are those that "
           "are asked for, but against a torque-speed line, which judges what the joint got.{}",
           task_words(*redesign.scenario.redesign, redesign.level), when)},
      {"widgets", widgets}};
}

// ---- the session

Json session_section(const Redesign& redesign) {
  const ImproveOptions& options = redesign.question.options;
  Json rows = Json::array();
  // Not {name, text}: a list of such pairs would be an object.
  const auto tell = [&](const std::string& name, const std::string& text) {
    rows.push_back(Json::array({name, text}));
  };
  std::size_t kinks = 0;
  for (const ImproveStep& one : redesign.state.steps) kinks += one.kinks.size();
  tell("Scenario", redesign.scenario.name);
  tell("Policy", options.policy);
  tell("Step", options.damped ? "damped: in a trust region, heeding all limits"
                              : fmt::format("plain: {:g} of -J+ l of the violated limits", options.alpha));
  tell("Improved on", options.particles.empty()
                          ? "the nominal robot"
                          : fmt::format("the {:g} % quantile of {}", 100 * redesign.scenario.redesign->quantile,
                                        counted(options.particles.size(), "particle", "particles")));
  tell("Seed", fmt::format("{}", redesign.question.seed));
  for (const FixedTotal& total : redesign.scenario.redesign->fixed) {
    const DesignVariable& first = redesign.scenario.redesign->variables[static_cast<std::size_t>(total.variables[0])];
    tell("Stays", fmt::format("{} ({:.4g}{} over all that they stand for)",
                              total_name(total, redesign.scenario.redesign->variables),
                              total_at(total, redesign.improved) / first.scale, unit_behind(first.unit)));
  }
  tell("Kinks met", fmt::format("{}", kinks));
  for (std::size_t k = 0; k < redesign.state.steps.size(); ++k) {
    for (const Revert& one : redesign.state.steps[k].reverts) {
      tell(fmt::format("Step {}", k + 1),
           fmt::format("{} takes back {:.0f} % of what step {} did",
                       redesign.scenario.redesign->variables[static_cast<std::size_t>(one.variable)].name,
                       100 * one.share, one.step + 1));
    }
  }
  const Json columns = {"Fact", {{"name", "Value"}, {"class", "wrap"}}};
  return {{"id", "session"},
          {"title", "Session"},
          {"widgets", Json::array({{{"type", "table"}, {"columns", columns}, {"rows", rows}}})}};
}

// ---- three dimensions

Json robot_json(const DesignTrace& trace, const Redesign& redesign, const char* name, NumberForm form) {
  const TraceRecord& record = trace.record;
  const bool known = record.outcome == Outcome::known_failure;
  const auto violated = static_cast<std::size_t>(std::max(record.violated, 0));
  return {{"policy", name},
          {"outcome", outcome_name(record.outcome)},
          {"what", known ? redesign.scenario.task.requirements.at(violated).name : ""},
          {"violated_at", known ? short_number(record.first_violations.at(violated)) : Json(nullptr)},
          {"end", short_number(record.end_time)},
          {"time", numbers(trace.frames.time, NumberForm::plain)},
          {"bodies", bodies_json(trace.frames, form)}};
}

/// A session's own numbers must be those of the traces: else its files have changed since.
void note_changes(const Redesign& redesign, Json& notes) {
  const auto& reached = redesign.state.reached;
  if (!redesign.question.options.particles.empty() || reached.empty()) return;
  for (std::size_t k = 0; k < reached.back().margins.size(); ++k) {
    const double told = reached.back().margins[k];
    const double now = limit_margin(*redesign.scenario.redesign, k, redesign.traces.improved.record);
    if (told == now || (std::isnan(told) && std::isnan(now))) continue;
    notes.push_back(
        fmt::format("The improved robot has another margin of '{}' now ({:.6g}) than in the session "
                    "({:.6g}): the scenario, its files or the program have changed since.",
                    limit_names(redesign.scenario)[k], now, told));
    return;
  }
}

}  // namespace

Json redesign_page(const Redesign& redesign, NumberForm form) {
  const DesignBlock& block = *redesign.scenario.redesign;
  Json page = {
      {"kind", "redesign"},
      {"title", redesign.scenario.name.empty() ? "A robot" : redesign.scenario.name},
      {"lead",
       fmt::format("From failures to a better robot: {}, {} of {} done.",
                   counted(steps_made(redesign.state), "design step", "design steps"), redesign.state.reached.size(),
                   counted(std::max<std::size_t>(1, block.task_values.size()), "task", "tasks"))},
      {"notes", Json::array()},
      {"sections",
       {outcome_section(redesign), limits_section(redesign), progress_section(redesign), design_section(redesign)}}};
  note_changes(redesign, page["notes"]);
  if (Json motors = motors_section(redesign, form); !motors.is_null()) page["sections"].push_back(std::move(motors));
  page["sections"].push_back(session_section(redesign));
  page["trajectories"] = {robot_json(redesign.traces.before, redesign, "First robot", form),
                          robot_json(redesign.traces.improved, redesign, "Improved", form)};
  page["scene"] = scene_json(redesign.scenario.model, form);
  return page;
}

}  // namespace graze
