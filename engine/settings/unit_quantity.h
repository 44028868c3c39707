#pragma once
// What a number measures, told by the unit that stands behind it.

#include <optional>
#include <string_view>

#include "engine/settings/units.h"

namespace graze {

/// Of a unit as written, the first quantity that it measures; none: no quantity has such a unit.
std::optional<Quantity> quantity_of_unit(std::string_view unit);

}  // namespace graze
