#pragma once
// The JSON Schema of a scenario, for editors: what data/scenario.schema.json holds and `graze help schema` prints.

#include <string>
#include <vector>

namespace graze {

/// Made of the descriptions of all sections and components (scenarios/components.h).
std::string scenario_schema();

/// What numbers measure, in the order of Quantity: "dimensionless", "length", ….
const std::vector<std::string>& quantity_names();

}  // namespace graze
