#pragma once
// Is the graph of links and joints a tree?

#include <string>

#include "engine/model/urdf_outline.h"

namespace graze {

/// Puts links and joints into depth-first order from the root. Throws InputError for joints of unknown links, links
/// with two parents, several roots, and loops.
void order_as_tree(UrdfOutline& outline, const std::string& name);

}  // namespace graze
