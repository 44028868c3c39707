#pragma once
// `robot`, `environment`, `gravity`, `contact` and `control` of a scenario -> the nominal World p0.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/model/model.h"
#include "engine/settings/settings.h"
#include "scenarios/spread.h"

namespace graze {

/// A distribution that stands where the world has a number: `friction: {uniform: [0.8, 1.2]}`. Its mean is the nominal
/// value; it is the same as an entry of `uncertain` for `path`.
struct InlineSpread {
  std::string path;
  Settings settings;
  Spread spread;
};

struct ReadWorld {
  std::shared_ptr<World> world;
  std::vector<InlineSpread> uncertain;  // in file order
  std::vector<std::string> warnings;
};

struct WorldOptions {
  std::string physics;  // its contact models are the choices of contact.model
  bool ignore_missing_meshes = false;
};

/// Throws InputError.
ReadWorld read_world(const Settings& scenario, const WorldOptions& options);

/// After compile(): globs of contact.pairs and contact.ignore that name nothing are refused.
void check_contact_names(const Settings& scenario, const Model& model);

/// Objects: geometry of one entry of `environment` (object_reader.cpp). One shape, of a concave mesh the hulls of its
/// convex parts (engine/model/mesh_parts.h).
std::vector<Shape> read_shapes(const Settings& object);
/// Where its shape stands: the value of `box`, `sphere`, …
Settings shape_settings(const Settings& object);
/// Pose from `position` and `rpy`; for a plane the direction `plane: z` or a normal too.
Pose read_object_pose(const Settings& object, const Shape& shape);

}  // namespace graze
