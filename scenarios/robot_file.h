#pragma once
// `robot.urdf` of a scenario, with the keys that say how it is read.

#include <functional>
#include <string>

#include "engine/model/urdf.h"
#include "engine/settings/settings.h"

namespace graze {

/// How `robot`, the map of a scenario, wants its URDF to be read: base, density, package_path, mesh, repair. Throws
/// InputError.
UrdfOptions read_urdf_options(const Settings& robot, bool ignore_missing_meshes);

/// Reads robot.urdf. Throws InputError.
Robot read_robot_file(const Settings& robot, const UrdfOptions& options);

/// The URDF of a scenario's robot as it is read, with the repairs if it is to be repaired, to be kept in `folder`.
/// Throws InputError.
std::string robot_document(const Settings& scenario, bool ignore_missing_meshes, const std::string& folder);

}  // namespace graze
