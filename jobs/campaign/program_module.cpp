#include "jobs/campaign/program_module.h"

#include <system_error>

namespace graze {

std::filesystem::path program_module(const char* name) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path installed = folder.parent_path() / "lib" / "graze" / name;
  return std::filesystem::exists(installed, error) ? installed : folder / name;
}

}  // namespace graze
