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

}  // namespace graze
