#include "simulation/build_facts.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <map>

#include "engine/lanes/isa.h"
#include "engine/physics.h"
#include "graze_build.h"

#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

namespace graze {
namespace {

std::string compiler() {
#if defined(__clang__)
  return fmt::format("Clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#elif defined(__GNUC__)
  return fmt::format("GCC {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#else
  return "unknown";
#endif
}

std::string c_library() {
#ifdef __GLIBC__
  return fmt::format("glibc {}", gnu_get_libc_version());
#else
  return "unknown";
#endif
}

}  // namespace

BuildFacts build_facts() {
  return {compiler(),
          c_library(),
          fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION),
          physics_text("bullet").library,
          GRAZE_BUILD_FLAGS,
          fmt::format("{}, {}", GRAZE_BUILD_PROCESSOR, isa_name(chosen_isa()))};
}

std::vector<std::string> build_differences(const BuildFacts& there, const BuildFacts& here) {
  std::map<std::string, std::string> known;
  each_fact(here, [&](const char* name, const std::string& text) { known[name] = text; });
  std::vector<std::string> out;
  each_fact(there, [&](const char* name, const std::string& text) {
    if (!text.empty() && text != known[name]) {
      out.push_back(fmt::format("{}: '{}' there, '{}' here", name, text, known[name]));
    }
  });
  return out;
}

}  // namespace graze
