#pragma once
// How far collision meshes may be simplified, as a scenario says it of its robot and of each of its meshes.

#include <vector>

#include "engine/model/hull.h"
#include "engine/settings/description.h"

namespace graze {

/// The keys `vertices`, `error` and `exact`.
std::vector<Key> hull_keys();

/// The same, and `hulls`, which a robot's meshes have.
std::vector<Key> robot_hull_keys();

/// What a map says by them. Throws InputError: fewer vertices than HullSettings::kFewest, an error that is not
/// positive, a bound together with `exact: true`.
HullSettings read_hull(const Settings& map);

/// Which links of the robot (globs) have their meshes split into convex parts, by `robot.mesh`: the word `hulls`, or
/// its key of that name; none where it means all links. Throws InputError for an empty list.
std::vector<std::string> read_split(const Settings& mesh);

/// Whether it means all links.
bool splits_all(const Settings& mesh);

/// Refuses a glob of `hulls` that is of no link with a collision mesh.
void check_split(const Settings& mesh, const Robot& robot);

}  // namespace graze
