#pragma once
// `policies` of a scenario -> one PolicySpec per combination of the values in `over`.

#include <string>
#include <vector>

#include "engine/settings/settings.h"
#include "scenarios/scenario.h"

namespace graze {

/// `{step: {…, over: {gait.step_height: [1 cm, 2 cm]}}}` -> step/1cm, step/2cm; several paths in `over` multiply, the
/// last one varying fastest: step/1cm/0.3s. Throws InputError.
std::vector<PolicySpec> read_policies(const Settings& policies);

/// "dept is none of the settings that stand there (depth, at my.yaml:9:30); …" for a path from `root` into the
/// `settings` of a controller that names none of those: the controller may know it and have a value of its own for it,
/// and may as well never ask for it. Else empty.
std::string doubted_setting(const Settings& root, const std::string& path);

/// Refuses values that were set from outside where `over` of the policy has values of its own, which win: nobody would
/// notice. Throws InputError.
void refuse_hidden(const Settings& policies, const std::vector<Override>& overrides);

}  // namespace graze
