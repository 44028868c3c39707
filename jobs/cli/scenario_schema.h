#pragma once
// The JSON Schema of a scenario, for editors: what data/scenario.schema.json holds and `graze help schema` prints.

#include <string>

namespace graze {

/// Made of the descriptions of all sections and components (scenarios/components.h).
std::string scenario_schema();

}  // namespace graze
