#pragma once
// What is wrong before anything has moved. A trace that begins with parts in each other, or with a requirement that is
// violated, tells of the scenario rather than of the robot.

#include "engine/settings/settings.h"
#include "scenarios/scenario.h"

namespace graze {

/// Looks at the particle whose uncertain numbers all have their medians, and warns of parts that overlap by more than
/// 0.5 % of the robot's size (and 1 mm), and of requirements that are violated at t = 0. `root`: what `scenario`, which
/// is complete, was read from.
void doubt_start(const Settings& root, const Scenario& scenario);

}  // namespace graze
