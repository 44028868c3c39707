#pragma once
// Numbers of a gait that are read as they stand, and that only a forgotten unit explains.

#include "engine/control/gait_settings.h"

namespace graze {

/// Warns of steps higher than a leg is long, of a cycle of minutes, and of velocities at which a foot that stands would
/// be left behind farther than its leg reaches.
void doubt_gait(const Settings& settings, const GaitSetup& gait);

}  // namespace graze
