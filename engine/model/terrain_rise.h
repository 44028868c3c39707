#pragma once
// Where a robot comes to rest on heightfields when it is let down on them upright.

#include <optional>
#include <vector>

#include "engine/model/model.h"

namespace graze {

/// How far the robot must be raised (negative: lowered), m, so that the first of its parts touches a heightfield that
/// it may touch; nothing where it is above none. Parts count as what they are: spheres and capsules exactly, boxes and
/// hulls of meshes by corners, edges and faces, cylinders and the sides of capsules by the prism of 24 sides about
/// them, which is 0.9 % wider. Heightfields that are tilted (roll, pitch) count as none.
std::optional<double> rise_onto_terrain(const Model& model, const std::vector<Pose>& X_WB);

}  // namespace graze
