#pragma once
#include <string_view>

#include "sampling/design.h"

namespace graze {

/// As scenarios and archives write it: "random", "latin_hypercube" or "sobol".
std::string_view design_name(Design design);

inline constexpr Design kDesigns[] = {Design::random, Design::latin_hypercube, Design::sobol};

}  // namespace graze
