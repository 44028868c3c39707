#pragma once
// One <joint> of a URDF, as the first pass reads it (urdf_outline.h).

#include "engine/model/urdf_outline.h"
#include "engine/model/urdf_values.h"

namespace graze {

/// Reads and repairs a joint, and prints it into the clean document of `values`. Names that are missing are empty.
UrdfOutline::JointEntry read_urdf_joint(tinyxml2::XMLElement& joint, UrdfValues& values);

}  // namespace graze
