#pragma once
// Keys of a policy or tracker that stand one level too high: {kp: 100} for {joint_pd: {kp: 100}}.

#include "engine/settings/settings.h"

namespace graze {

enum class Component { policy, tracker };

/// Refuses keys in the map `settings`, of a policy or of `control`, that belong into what should stand in it, and says
/// where that is. Throws InputError.
void refuse_wrong_level(const Settings& settings, Component component);

}  // namespace graze
