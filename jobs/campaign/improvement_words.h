#pragma once
// What came of a session of `graze improve`, in sentences.

#include <optional>
#include <string>
#include <vector>

#include "analysis/compare.h"
#include "jobs/campaign/design_trace.h"
#include "jobs/campaign/improvement_file.h"

namespace graze {

/// A session as it stands, and what its first and its improved robot do in the same task.
struct Redesign {
  Scenario scenario;  // of the first robot, with `design`
  ImproveQuestion question;
  ImproveState state;
  std::size_t level = 0;  // of the task that both are shown in
  DesignValues improved;
  DesignPair traces;
  std::optional<PolicyComparison> verdict;  // on particles that it was not improved on
};

/// "task 2 of 5 (gait.velocity = 0.2 m/s)"; of one task alone "the task".
std::string task_words(const DesignBlock& block, std::size_t level);
/// "2 of 16 particles have no valid trace (particle 3: …)", "the trace of the nominal robot is invalid (…)"; empty:
/// none is lost. What a limit does behind their ends is not known, and where one ends before a limit is looked at it
/// does not count in that one's quantile.
std::string lost_words(const LostTraces& lost);
/// Design steps that the improved robot has: those for a task that was not done are not in it, unless none was done.
std::size_t steps_made(const ImproveState& state);
/// "hind_motors" at 3: "choice 3 (7.3 N m, 15 rad/s)"; of a number "0.2 m".
std::string value_words(const DesignVariable& variable, double value);
/// "0.2 to 0.3 m", "choice 2 (…) to choice 3 (…)", with what stands `between`.
std::string change_words(const DesignVariable& variable, double from, double to, const char* between);
/// " rad/s"; of a number without a unit nothing.
std::string unit_behind(const std::string& unit);

/// A limit's margin in a trace; NaN: it was never looked at.
double limit_margin(const DesignBlock& block, std::size_t limit, const TraceRecord& trace);
/// When it was first below 0, s; NaN: never, or it is the objective.
double limit_violation(const DesignBlock& block, std::size_t limit, const TraceRecord& trace);

/// "the new design is better", by the interval of the difference.
std::string verdict_words(const PolicyComparison& pair);

/// In this order: what failed, what was changed, what the robot does now, and what other particles say.
struct RedesignWords {
  std::string failed, changed, now, verdict;
};
RedesignWords redesign_words(const Redesign& redesign);

}  // namespace graze
