#pragma once
// What graze check says of collision meshes: how simple their hulls are, and what that leaves out.

#include <nlohmann/json.hpp>
#include <string>

#include "engine/model/model.h"

namespace graze {

/// A table with a line per collision mesh, after an empty line; empty without meshes.
std::string hull_table(const Model& model);
/// The same as a list: part, file, vertices, of, error (m).
nlohmann::json hulls_as_json(const Model& model);

/// Movable objects: mass (kg), centre of mass (m) and inertia about it (kg m^2, rows), in the object's frame.
nlohmann::json objects_as_json(const World& world);

/// " (bowl 0.83 kg, crate 2 kg)", or "" where nothing moves; of many the first.
std::string object_masses(const World& world);

}  // namespace graze
