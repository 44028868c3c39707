#include "scenarios/shipped_names.h"

namespace graze {

std::optional<std::string> scenario_in(const std::filesystem::path& data, const std::string& name) {
  if (data.empty() || name.find('/') != std::string::npos) return std::nullopt;
  const std::filesystem::path file = data / "scenarios" / (name.ends_with(".yaml") ? name : name + ".yaml");
  std::error_code error;
  return std::filesystem::is_regular_file(file, error) ? std::optional(file.string()) : std::nullopt;
}

}  // namespace graze
