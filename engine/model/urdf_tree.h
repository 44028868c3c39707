#pragma once
// Is the graph of links and joints a tree?

#include <string>

#include "engine/model/urdf_outline.h"

namespace graze {

/// Puts links and joints into depth-first order from the root. Throws InputError with all problems where there are
/// joints of unknown links, links with two parents, several roots, or loops. Floating and planar joints are settled:
/// one between a root that is a mere frame and the robot means a base that floats, others are refused.
void order_as_tree(UrdfOutline& outline, UrdfProblems& problems);

}  // namespace graze
