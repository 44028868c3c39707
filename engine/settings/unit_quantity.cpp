#include "engine/settings/unit_quantity.h"

namespace graze {

std::optional<Quantity> quantity_of_unit(std::string_view unit) {
  for (std::size_t q = 0; q < quantity_names().size(); ++q) {
    if (to_si(static_cast<Quantity>(q), 1, unit)) return static_cast<Quantity>(q);
  }
  return std::nullopt;
}

}  // namespace graze
