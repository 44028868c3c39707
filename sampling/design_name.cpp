#include "sampling/design_name.h"

namespace graze {

std::string_view design_name(Design design) {
  switch (design) {
    case Design::random:
      return "random";
    case Design::latin_hypercube:
      return "latin_hypercube";
    case Design::sobol:
      return "sobol";
  }
  return "random";
}

}  // namespace graze
