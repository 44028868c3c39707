#include "jobs/campaign/improvement_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "analysis/number_words.h"
#include "analysis/proportions.h"
#include "archive/files/utf8.h"

namespace graze {
namespace {

constexpr std::size_t kMostNamed = 5;   // limits or variables in a sentence
constexpr double kLevel = 0.05;         // of the test of a difference, as of its 95 % interval
constexpr double kWorthNaming = 0.005;  // of the way from bound to bound: a change that a sentence counts

bool is_objective(const DesignBlock& block, std::size_t limit) { return limit == block.limits.size(); }

/// "front-knees by 0.52 N m", the worst first, in units of the limits' scales.
std::vector<std::string> violated_limits(const Redesign& redesign, const TraceRecord& trace) {
  const std::vector<std::string> names = limit_names(redesign.scenario), units = limit_units(redesign.scenario);
  const DesignBlock& block = *redesign.scenario.redesign;
  std::vector<std::pair<double, std::string>> found;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const double margin = limit_margin(block, k, trace);
    if (!(margin < 0)) continue;
    const double scale = k < redesign.state.scales.size() ? redesign.state.scales[k] : 1;
    found.emplace_back(margin / scale, fmt::format("{} by {:.3g}{}", names[k], -margin, unit_behind(units[k])));
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> out;
  for (auto& [size, words] : found) out.push_back(std::move(words));
  return out;
}

/// The first few, and how many more.
std::string first_few(const std::vector<std::string>& all) {
  const auto shown = static_cast<std::ptrdiff_t>(std::min(all.size(), kMostNamed));
  const std::string out = fmt::format("{}", fmt::join(all.begin(), all.begin() + shown, ", "));
  return all.size() <= kMostNamed ? out : fmt::format("{} and {} more", out, all.size() - kMostNamed);
}

std::size_t tasks_of(const DesignBlock& block) { return std::max<std::size_t>(1, block.task_values.size()); }

/// "3 of 5 tasks"
std::string tasks_words(std::size_t done, std::size_t all) {
  return fmt::format("{} of {} task{}", done == 0 ? "none" : fmt::format("{}", done), all, all == 1 ? "" : "s");
}

/// A task is done where the quantile over the particles holds, if there are some.
std::string on_particles(const Redesign& redesign) {
  return redesign.question.options.particles.empty() ? "" : " on the particles that it was improved on";
}

std::string failed_words(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  const auto& reached = redesign.state.reached;
  const auto at_once = static_cast<std::size_t>(
      std::count_if(reached.begin(), reached.end(), [](const ReachedLevel& one) { return one.steps == 0; }));
  const std::string before = block.task_path.empty()
                                 ? ""
                                 : fmt::format("As it was, the robot did {}{}. ", tasks_words(at_once, tasks_of(block)),
                                               on_particles(redesign));
  const std::vector<std::string> violated = violated_limits(redesign, redesign.traces.before.record);
  const std::string task = task_words(block, redesign.level);
  if (redesign.traces.before.record.outcome == Outcome::invalid) {
    return fmt::format("{}In {} its trace is invalid: {}.", before, task, redesign.traces.before.record.invalid_reason);
  }
  if (violated.empty()) return fmt::format("{}In {} the first robot violates no limit.", before, task);
  return fmt::format("{}In {} the first robot violates {} of {} limits: {}.", before, task, violated.size(),
                     limit_names(redesign.scenario).size(), first_few(violated));
}

std::string changed_words(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  const std::size_t made = steps_made(redesign.state);
  std::size_t refused = made == redesign.state.steps.size() ? redesign.state.refused.size() : 0;
  for (std::size_t k = 0; k < made; ++k) refused += static_cast<std::size_t>(redesign.state.steps[k].rolled_back);
  std::vector<std::size_t> order;
  const auto way = [&](std::size_t i) {
    const DesignVariable& one = block.variables[i];
    return std::abs(redesign.improved[i] - one.nominal) / (one.upper - one.lower);
  };
  for (std::size_t i = 0; i < block.variables.size(); ++i) {
    if (way(i) > kWorthNaming) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return way(a) > way(b); });
  std::vector<std::string> parts;
  for (const std::size_t i : order) {
    const DesignVariable& one = block.variables[i];
    parts.push_back(one.name + " from " + change_words(one, one.nominal, redesign.improved[i], " to "));
  }
  const std::string steps = fmt::format("{} design step{} ({} proposal{} rolled back)", made, made == 1 ? "" : "s",
                                        refused, refused == 1 ? " was" : "s were");
  if (parts.empty()) return fmt::format("{} changed no variable by half a percent of its way.", steps);
  return fmt::format("{} changed {} of {} variables by more than half a percent of their ways; most of all {}.", steps,
                     parts.size(), block.variables.size(), first_few(parts));
}

/// "; the tightest is knees with 0.02 N m", of limits of one unit the least margin, else the least in its scale.
std::string tightest_words(const Redesign& redesign) {
  const std::vector<std::string> names = limit_names(redesign.scenario), units = limit_units(redesign.scenario);
  const bool one_unit =
      std::all_of(units.begin(), units.end(), [&](const std::string& one) { return one == units[0]; });
  std::size_t least = names.size();
  double size = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < names.size() && k < redesign.state.scales.size(); ++k) {
    const double margin = limit_margin(*redesign.scenario.redesign, k, redesign.traces.improved.record);
    const double scale = one_unit ? 1 : redesign.state.scales[k];
    if (margin / scale < size) least = k, size = margin / scale;
  }
  if (least == names.size()) return "";
  const double margin = limit_margin(*redesign.scenario.redesign, least, redesign.traces.improved.record);
  return fmt::format("; the tightest is {} with {:.3g}{} to spare", names[least], margin, unit_behind(units[least]));
}

std::string now_words(const Redesign& redesign) {
  const DesignBlock& block = *redesign.scenario.redesign;
  const ImproveState& state = redesign.state;
  const std::vector<std::string> violated = violated_limits(redesign, redesign.traces.improved.record);
  std::string out = fmt::format("The improved robot does {}{}", tasks_words(state.reached.size(), tasks_of(block)),
                                on_particles(redesign));
  const std::string task = task_words(block, redesign.level);
  if (redesign.traces.improved.record.outcome == Outcome::invalid) {
    out += fmt::format(". In {} its trace is invalid: {}", task, redesign.traces.improved.record.invalid_reason);
  } else if (violated.empty()) {
    out += fmt::format(". In {} every limit holds{}", task, tightest_words(redesign));
  } else {
    out += fmt::format(". In {} the nominal robot{} violates {}", task,
                       on_particles(redesign).empty() || state.reached.empty() ? "" : ", which is none of them,",
                       first_few(violated));
  }
  if (const std::size_t more = state.steps.size() - steps_made(state); more > 0) {
    out += fmt::format(". {} more design step{} made for a task that was not done, and {} not in it", more,
                       more == 1 ? " was" : "s were", more == 1 ? "is" : "are");
  }
  if (const std::string lost = lost_words(state.lost); !lost.empty()) {
    out += fmt::format(". Of the last design {}: it is judged without what they lack", lost);
  }
  if (state.end == ImproveEnd::stuck) {
    out += fmt::format(". The session is stuck in {}: {}", task_words(block, state.level), state.why);
  } else if (state.end == ImproveEnd::none) {
    out += fmt::format(". The session has not ended: in {} limits are violated", task_words(block, state.level));
  }
  return out + ".";
}

std::string rate_words(std::uint64_t success, std::uint64_t n) {
  const Interval interval = wilson(success, n);
  return fmt::format("{} of {} ({:.1f} to {:.1f} %)", success, n, 100 * interval.low, 100 * interval.high);
}

std::string particles_words(const Redesign& redesign) {
  if (!redesign.verdict) {
    return redesign.question.options.particles.empty()
               ? "No particles were run: whether copies with fabrication error do as the nominal robot does is not "
                 "known. graze improve --verdict 200 finds out."
               : "No other particles were run: whether robots that it was not improved on do as well is not known.";
  }
  const PolicyComparison& pair = *redesign.verdict;
  if (pair.n_a == 0 || pair.n_b == 0) {
    return "Of other particles none has a valid trace both before and after: whether robots that it was not improved "
           "on "
           "do as well is not known.";
  }
  return fmt::format(
      "Of other particles, which it was not improved on, {} succeed before and {} after (95 % intervals); {} were "
      "fixed, {} broke. The difference is {:+.3f} (95 % interval {:+.3f} to {:+.3f}, {}): {}.",
      rate_words(pair.success_a, pair.n_a), rate_words(pair.success_b, pair.n_b), pair.pairs.only_b, pair.pairs.only_a,
      pair.difference, pair.interval.low, pair.interval.high, p_equation(pair.p_value), verdict_words(pair));
}

}  // namespace

std::string task_words(const DesignBlock& block, std::size_t level) {
  if (block.task_path.empty()) return "the task";
  return fmt::format("task {} of {} ({} = {})", level + 1, block.task_values.size(), block.task_path,
                     block.task_values[level]);
}

std::size_t steps_made(const ImproveState& state) {
  return state.reached.empty() ? state.steps.size() : state.reached.back().steps;
}

std::string value_words(const DesignVariable& variable, double value) {
  if (variable.choices.empty()) return fmt::format("{:.4g}{}", value / variable.scale, unit_behind(variable.unit));
  const auto row = static_cast<std::size_t>(std::clamp(std::round(value), variable.lower, variable.upper)) - 1;
  return fmt::format("choice {} ({})", row + 1, variable.choice_words[row]);
}

std::string change_words(const DesignVariable& variable, double from, double to, const char* between) {
  const std::string first =
      variable.choices.empty() ? fmt::format("{:.4g}", from / variable.scale) : value_words(variable, from);
  return first + between + value_words(variable, to);
}

std::string lost_words(const LostTraces& lost) {
  if (lost.count == 0) return "";
  const std::string why = printable(lost.why);
  if (lost.of == 1) return fmt::format("the trace of the robot is invalid ({})", why);
  return fmt::format("{} of {} particles have no valid trace ({})", lost.count, lost.of, why);
}

std::string unit_behind(const std::string& unit) { return unit.empty() || unit == "1" ? "" : " " + unit; }

double limit_margin(const DesignBlock& block, std::size_t limit, const TraceRecord& trace) {
  if (is_objective(block, limit)) return trace.objective_margin;
  const auto requirement = static_cast<std::size_t>(block.limits[limit]);
  return requirement < trace.margins.size() ? trace.margins[requirement] : std::numeric_limits<double>::quiet_NaN();
}

double limit_violation(const DesignBlock& block, std::size_t limit, const TraceRecord& trace) {
  const double never = std::numeric_limits<double>::quiet_NaN();
  if (is_objective(block, limit)) return never;
  const auto requirement = static_cast<std::size_t>(block.limits[limit]);
  return requirement < trace.first_violations.size() ? trace.first_violations[requirement] : never;
}

std::string verdict_words(const PolicyComparison& pair) {
  // With few pairs the interval excludes 0 where the exact test does not: both must say so.
  const bool shown = pair.p_value < kLevel;
  if (shown && pair.interval.low > 0) return "the new design is better";
  if (shown && pair.interval.high < 0)
    return "the new design is worse, though the robot that it was improved on is not";
  return "not shown to be better";
}

RedesignWords redesign_words(const Redesign& redesign) {
  return {failed_words(redesign), changed_words(redesign), now_words(redesign), particles_words(redesign)};
}

}  // namespace graze
