#include "jobs/workers/first_folder.h"

#include <fmt/format.h>

#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// Where the headers of the interface are: beside data/ in a source tree, in include/ where the program is installed.
fs::path header_folder(const fs::path& data) {
  std::error_code error;
  for (const fs::path& folder :
       {data.parent_path() / "graze", data.parent_path().parent_path() / "include" / "graze"}) {
    if (fs::is_regular_file(folder / "policy.h", error)) return folder;
  }
  throw MachineError(
      fmt::format("{}: graze/policy.h is neither beside it nor in include/; the environment variable "
                  "GRAZE_DATA names the folder of the program's data",
                  data.string()));
}

}  // namespace

const std::vector<std::string>& first_folders() {
  static const std::vector<std::string> names = {"quadruped", "arm", "policy-c", "policy-cpp", "policy-python"};
  return names;
}

bool is_first_controller(const std::string& name) { return name.starts_with("policy-"); }

void write_first_folder(const std::string& name, const fs::path& folder, const fs::path& data) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(folder, error)) &&
      !(fs::is_directory(folder, error) && fs::is_empty(folder, error))) {
    throw InputError(fmt::format("{}: exists already; name a folder that is new, or empty", folder.string()));
  }
  const fs::path source = data / "templates" / name;
  if (!fs::is_directory(source, error)) {
    throw MachineError(
        fmt::format("{}: the program's templates are not there; the environment variable GRAZE_DATA "
                    "names the folder of its data",
                    source.string()));
  }
  const bool compiled = fs::exists(source / "Makefile", error);
  const fs::path headers = compiled ? header_folder(data) : fs::path();
  try {
    fs::create_directories(compiled ? folder / "graze" : folder);
    for (const auto& file : fs::directory_iterator(source)) {
      if (file.is_regular_file()) fs::copy_file(file.path(), folder / file.path().filename());
    }
    if (compiled) {
      for (const char* header : {"policy.h", "policy.hpp"}) fs::copy_file(headers / header, folder / "graze" / header);
    }
    const char* robot = name == "arm" ? "six_joint_arm.urdf" : "links.urdf";
    fs::copy_file(data / "robots" / robot, folder / robot);
  } catch (const fs::filesystem_error& failed) {
    throw MachineError(fmt::format("{}: cannot be written: {}", folder.string(), failed.code().message()));
  }
}

}  // namespace graze
