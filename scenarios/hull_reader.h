#pragma once
// How far collision meshes may be simplified, as a scenario says it of its robot and of each of its meshes.

#include <vector>

#include "engine/model/hull.h"
#include "engine/settings/description.h"

namespace graze {

/// The keys `vertices`, `error` and `exact`.
std::vector<Key> hull_keys();

/// What a map says by them. Throws InputError: fewer vertices than HullSettings::kFewest, an error that is not
/// positive, a bound together with `exact: true`.
HullSettings read_hull(const Settings& map);

}  // namespace graze
