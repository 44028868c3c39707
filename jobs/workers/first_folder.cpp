#include "jobs/workers/first_folder.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <span>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
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

/// Files that are all written, or none.
class FolderFiles {
 public:
  FolderFiles() = default;
  ~FolderFiles() {
    std::error_code error;
    for (const fs::path& file : written_) fs::remove(file, error);
  }
  FolderFiles(const FolderFiles&) = delete;
  FolderFiles& operator=(const FolderFiles&) = delete;

  /// Throws MachineError that names the file and why it cannot be written.
  void copy(const fs::path& from, const fs::path& to) {
    std::ifstream in(from, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (!in) throw MachineError(fmt::format("{}: cannot be read", from.string()));
    NewFile file(to, false);
    if (const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)))) fail_writing(to, error);
    file.publish();
    written_.push_back(to);
  }
  void keep() { written_.clear(); }

 private:
  std::vector<fs::path> written_;
};

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
  const ParentFolders folders((compiled ? folder / "graze" : folder) / "file");  // removes what stays empty
  FolderFiles files;
  try {
    for (const auto& file : fs::directory_iterator(source)) {
      if (file.is_regular_file()) files.copy(file.path(), folder / file.path().filename());
    }
  } catch (const fs::filesystem_error& failed) {
    throw MachineError(fmt::format("{}: cannot be read: {}", source.string(), failed.code().message()));
  }
  if (compiled) {
    for (const char* header : {"policy.h", "policy.hpp"}) files.copy(headers / header, folder / "graze" / header);
  }
  const char* robot = name == "arm" ? "six_joint_arm.urdf" : "links.urdf";
  files.copy(data / "robots" / robot, folder / robot);
  files.keep();
}

}  // namespace graze
