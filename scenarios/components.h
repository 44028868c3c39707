#pragma once
// Every component and section with its description, by kind: what `graze help`, the JSON Schema and the tables of docs/
// are made of.

#include <string>
#include <vector>

#include "engine/settings/description.h"

namespace graze {

struct Component {
  std::string name;
  Description text;
  std::string unit;  // of a witness's margin; else empty
};

struct ComponentGroup {
  std::string topic, one;   // "policies", "policy"
  std::string title, more;  // of a list of them
  std::vector<Component> all;
};

const std::vector<ComponentGroup>& component_groups();

}  // namespace graze
