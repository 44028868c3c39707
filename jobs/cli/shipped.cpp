#include "jobs/cli/shipped.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "archive/files/files.h"
#include "archive/files/shell_word.h"
#include "engine/settings/paths.h"
#include "engine/settings/settings.h"
#include "scenarios/shipped_names.h"

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

fs::path docs_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path root = program.parent_path().parent_path();
  for (const fs::path& folder : {root / "share" / "doc" / "graze", root.parent_path() / "docs"}) {
    if (fs::is_regular_file(folder / "scenario.md", error)) return folder;
  }
  return {};
}

std::vector<std::string> shipped_scenarios() {
  std::vector<std::string> out;
  std::error_code error;
  const fs::path folder = data_folder();
  if (folder.empty()) return out;
  for (const auto& entry : fs::directory_iterator(folder / "scenarios", error)) {
    if (entry.path().extension() == ".yaml") out.push_back(entry.path().stem().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::optional<std::string> shipped_scenario(const std::string& name) { return scenario_in(data_folder(), name); }

std::string scenario_file(const std::string& given) {
  std::error_code error;
  if (given == "-" || given.find('/') != std::string::npos) return given;
  if (fs::symlink_status(given, error).type() != fs::file_type::not_found) return given;
  if (const auto shipped = shipped_scenario(given)) return *shipped;
  const std::vector<std::string> names = shipped_scenarios();
  if (names.empty() && given.find('.') == std::string::npos) {
    throw InputError(fmt::format(
        "{}: there is no such file, and no shipped scenarios were found; the environment variable GRAZE_DATA "
        "names their folder",
        given));
  }
  const std::string near = nearest(fs::path(given).stem().string(), names);
  const bool like_a_name = given.find('.') == std::string::npos || given.ends_with(".yaml");
  if (!near.empty() && like_a_name && path_suggestion(given, {".yaml", ".yml"}).empty()) {
    throw InputError(fmt::format("{}: there is no such file; did you mean the shipped scenario '{}'?", given, near));
  }
  return given;
}

bool is_robot_file(const std::string& name) {
  const std::string ending = ending_of(name);
  return ending == ".urdf" || ending == ".xacro";
}

std::string scenario_of_robot(const std::string& robot) {
  fs::path name = fs::path(robot).filename();
  while (is_robot_file(name.string())) name = name.stem();
  return name.string() + ".yaml";
}

void refuse_robot_file(const std::string& given) {
  std::error_code error;
  if (!is_robot_file(given) || !fs::is_regular_file(given, error)) return;
  throw InputError(
      fmt::format("{}: is a robot by its name, and a scenario is meant; 'graze new {} {}' writes a first one", given,
                  shell_path(scenario_of_robot(given)), shell_path(given)));
}

}  // namespace graze
