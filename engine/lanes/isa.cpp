#include "engine/lanes/isa.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "engine/lanes/block.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

std::vector<std::string> names_of(const std::vector<Isa>& isas) {
  std::vector<std::string> names;
  for (Isa isa : isas) names.push_back(isa_name(isa));
  return names;
}

}  // namespace

std::string isa_name(Isa isa) {
  switch (isa) {
    case Isa::avx512:
      return "avx512";
    case Isa::avx2:
      return "avx2";
    case Isa::portable:
      break;
  }
  return "portable";
}

std::vector<Isa> available_isas() {
  std::vector<Isa> out{Isa::portable};
#if defined(GRAZE_X86_KERNELS)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) out.push_back(Isa::avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw")) {
    out.push_back(Isa::avx512);
  }
#endif
  return out;
}

Isa chosen_isa() {
  const std::vector<Isa> available = available_isas();
  const char* wish = std::getenv("GRAZE_ISA");
  if (wish == nullptr || *wish == '\0') return available.back();
  for (Isa isa : available) {
    if (isa_name(isa) == wish) return isa;
  }
  throw InputError(fmt::format("environment: GRAZE_ISA: '{}': must be one of {} on this machine", wish,
                               fmt::join(names_of(available), ", ")));
}

std::string isa_report() {
  return fmt::format("lanes: {} x double, {} (available: {})", kLanes, isa_name(chosen_isa()),
                     fmt::join(names_of(available_isas()), ", "));
}

}  // namespace graze
