#pragma once
// `stiffness` and `damping` of `contact`, its `pairs` and the objects of a scenario. They are read last, because what
// is not given follows from the mass of all that moves.

#include <functional>
#include <string>

#include "engine/model/fabrication.h"
#include "engine/settings/settings.h"

namespace graze {

/// Reads the number, or the distribution with its mean, that stands at `key` of `map` for a parameter into `value`,
/// which comes in as the nominal value.
using ReadNumber = std::function<void(const Settings& map, const char* key, const Parameter& parameter, double& value)>;

/// Fills the springs of `world`, whose robot, objects, contact model and pairs are known; what the file does not give
/// stays NaN. Warns of springs that rigid contacts do not have. Throws InputError, also where `physics`, the back end,
/// knows no springs, then with the place of any of these keys and of their paths under `uncertain`.
void read_springs(const Settings& scenario, const std::string& physics, World& world, const ReadNumber& number);

}  // namespace graze
