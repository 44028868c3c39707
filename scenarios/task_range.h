#pragma once
// What the parts of a task can be at all, whatever a trace does: so that tasks which judge nothing are told.

#include "engine/settings/warnings.h"
#include "scenarios/task.h"

namespace graze {

/// Of an inner node's margin, by those of its parts.
WitnessRange range_of_parts(const Objective& node);

/// Of a leaf whose window never opens: +infinity, or with `once` -infinity.
WitnessRange unopened(const Window& window, bool once);

/// Warns at `settings` of a window that never opens, with what follows from that, or that goes on beyond the trace's
/// end. True if it never opens.
bool warn_of_window(const Settings& settings, const Window& window, const TraceTimes& times, const char* then);

/// Warns at `settings` of a range that always or never holds, with what follows from that.
void doubt(const Settings& settings, const WitnessRange& range, const char* always, const char* never);

}  // namespace graze
