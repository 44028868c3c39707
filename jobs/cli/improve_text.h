#pragma once
// What `graze improve` prints.

#include <string>

#include "jobs/campaign/improvement.h"

namespace graze {

/// A step, as it is made: the limits that were violated with their margins before and after, and what was changed.
std::string step_text(const Scenario& scenario, const ImproveState& state, std::size_t step);
/// A level that is done.
std::string reached_text(const Scenario& scenario, const ReachedLevel& level);
/// At the end: the design beside the first one, and how it ended.
std::string summary_text(const Scenario& scenario, const ImproveState& state, const DesignValues& improved);

}  // namespace graze
