#pragma once
// SRDF: which pairs of links a robot's makers say never touch.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "engine/model/world.h"

namespace graze {

/// The pairs of <disable_collisions link1 link2> in the file, as globs for ContactSettings::ignore. Left out are pairs
/// that could not touch anyway, because a link has no collision shape. A link that the robot does not have is told to
/// `warn`, since an SRDF often serves several robots; so are another robot's name, misspelt elements, a URDF in its
/// place and a file without pairs. Throws InputError with file and line.
std::vector<std::pair<std::string, std::string>> load_srdf(const std::string& file, const Robot& robot,
                                                           const std::function<void(const std::string&)>& warn);

}  // namespace graze
