#pragma once
// A session of `graze improve` as a picture (Figure 39): tasks done, margins and the design over its steps.

#include "analysis/plots_figure.h"
#include "jobs/campaign/improvement.h"

namespace graze {

/// Three panels over the number of steps: tasks that were done, with the part of the next that is without violation;
/// margins of the limits in units of their first ones; variables as shares of the way from bound to bound.
Figure improve_figure(const Scenario& scenario, const ImproveState& state);

}  // namespace graze
