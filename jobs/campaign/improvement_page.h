#pragma once
// The page of a redesign as data (docs/improve.md): what failed, what was changed by how much, what the robot does now.

#include "analysis/report_numbers.h"
#include "jobs/campaign/improvement_words.h"

namespace graze {

/// "kind": "redesign", "title", "lead", "notes", "sections" as those of a report, and both robots in three dimensions:
/// "trajectories" and "scene".
Json redesign_page(const Redesign& redesign, NumberForm form);

/// From the first time at which a limit of torque or speed counts to the last; all times if none does.
Window window_of_motors(const Scenario& scenario);
/// The torque-speed plane of one joint (Figure 45): the first robot's limit and trajectory, and the improved one's.
/// `judged`: from when to when limits count, s.
Json torque_speed_plot(const Redesign& redesign, std::size_t drive, const Window& judged, NumberForm form);

}  // namespace graze
