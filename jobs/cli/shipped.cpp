#include "jobs/cli/shipped.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "engine/settings/paths.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

bool holds_scenarios(const fs::path& folder) {
  std::error_code error;
  return fs::is_directory(folder / "scenarios", error);
}

}  // namespace

fs::path data_folder() {
  if (const char* const told = std::getenv("GRAZE_DATA"); told && *told) return told;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path();
  const fs::path installed = folder.parent_path() / "share" / "graze";
  if (holds_scenarios(installed)) return installed;
  const fs::path tree = folder.parent_path().parent_path();  // of build/release/graze
  return fs::exists(tree / "CMakeLists.txt", error) && holds_scenarios(tree / "data") ? tree / "data" : fs::path();
}

std::vector<std::string> shipped_scenarios() {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(data_folder() / "scenarios", error)) {
    if (entry.path().extension() == ".yaml") out.push_back(entry.path().stem().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::string scenario_file(const std::string& given) {
  std::error_code error;
  if (given == "-" || given.find('/') != std::string::npos) return given;
  if (fs::symlink_status(given, error).type() != fs::file_type::not_found) return given;
  const fs::path folder = data_folder();
  if (folder.empty()) return given;
  const std::string name = given.ends_with(".yaml") ? given : given + ".yaml";
  const fs::path shipped = folder / "scenarios" / name;
  if (fs::is_regular_file(shipped, error)) return shipped.string();
  const std::string near = nearest(fs::path(name).stem().string(), shipped_scenarios());
  const bool like_a_name = given.find('.') == std::string::npos || given.ends_with(".yaml");
  if (!near.empty() && like_a_name && path_suggestion(given, {".yaml", ".yml"}).empty()) {
    throw InputError(fmt::format("{}: there is no such file; did you mean the shipped scenario '{}'?", given, near));
  }
  return given;
}

}  // namespace graze
