#pragma once
// Causes as numbers for scripts: JSON, and rows of a table.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/causes.h"

namespace graze {

/// Everything about one target. docs/statistics.md says what the numbers mean.
nlohmann::ordered_json causes_json(const Causes& causes, const ParticleTable& table);

/// "parameter", "test", "effect", …
std::vector<std::string> cause_columns();
/// A cell for each of these, with as many digits as give the same bits when they are read again; what is not known is
/// an empty cell.
std::vector<std::string> cause_cells(const ParameterEffect& effect, const ParticleTable& table);

}  // namespace graze
