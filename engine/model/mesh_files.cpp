#include "engine/model/mesh_files.h"

#include <fmt/format.h>

#include <sstream>

#include "engine/model/convex_hull.h"
#include "engine/model/mesh_parts.h"
#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "engine/settings/paths.h"
#include "engine/settings/settings.h"

namespace graze {

namespace fs = std::filesystem;

namespace {

/// What follows `prefix` in `text`, or nothing.
std::optional<std::string> after(const std::string& text, const std::string& prefix) {
  if (text.rfind(prefix, 0) != 0) return std::nullopt;
  return text.substr(prefix.size());
}

std::vector<fs::path> parents_of(const fs::path& folder) {
  fs::path absolute = input_path(folder.string());
  if (!absolute.has_filename()) absolute = absolute.parent_path();  // "a/b/" -> "a/b"
  std::vector<fs::path> out;
  for (fs::path p = absolute; !p.empty(); p = p.parent_path()) {
    out.push_back(p);
    if (p == p.root_path()) break;
  }
  return out;
}

/// The folders of ROS_PACKAGE_PATH, which colons separate.
std::vector<fs::path> ros_folders() {
  constexpr std::size_t kMost = 100;  // each mesh is looked for in all of them
  std::istringstream all(input_variable("ROS_PACKAGE_PATH"));
  std::vector<fs::path> out;
  for (std::string folder; out.size() < kMost && std::getline(all, folder, ':');) {
    if (!folder.empty()) out.emplace_back(folder);
  }
  return out;
}

/// "foo/m.stl" of "package://foo/m.stl", or nothing.
std::optional<std::string> in_a_package(const std::string& name) {
  const std::optional<std::string> rest = after(name, "package://");
  return rest ? rest : after(name, "model://");
}

}  // namespace

std::vector<fs::path> MeshFiles::candidates(const std::string& name) const {
  if (const auto rest = after(name, "file://")) return {fs::path(*rest)};
  const std::optional<std::string> in_package = in_a_package(name);
  if (!in_package) return {fs::path(name).is_absolute() ? fs::path(name) : folder_ / name};

  const std::size_t slash = in_package->find('/');
  const std::string package = in_package->substr(0, slash);
  const std::string rest = slash == std::string::npos ? "" : in_package->substr(slash + 1);
  std::vector<fs::path> roots(package_path_.begin(), package_path_.end());
  const std::vector<fs::path> parents = parents_of(folder_);
  roots.insert(roots.end(), parents.begin(), parents.end());
  if (variable_) {
    for (const fs::path& folder : ros_folders()) roots.push_back(folder);
  }
  std::vector<fs::path> out;
  for (const fs::path& root : roots) {
    if (root.filename() == package) out.push_back(root / rest);
    out.push_back(root / package / rest);
  }
  return out;
}

fs::path MeshFiles::find(const std::string& name) const {
  for (const fs::path& file : candidates(name)) {
    if (input_exists(file.string())) return file;
  }
  return {};
}

std::string MeshFiles::not_found(const std::string& name) const {
  const std::vector<fs::path> places = candidates(name);
  for (const fs::path& place : places) {
    std::error_code error;
    const fs::file_type type = fs::status(place, error).type();
    if (type == fs::file_type::directory) return fmt::format(" ({} is a folder, not a file)", place.string());
    if (fs::exists(place, error)) return fmt::format(" ({} is a device or a pipe, not a file)", place.string());
  }
  if (!in_a_package(name)) {
    return fmt::format(" (looked at {}{})", places.front().string(), path_suggestion(places.front().string()));
  }
  std::string text;
  if (!package_path_.empty()) text = fmt::format("{} (package_path), ", fmt::join(package_path_, ", "));
  text += fmt::format("{} and above", parents_of(folder_).front().string());
  std::vector<std::string> variable;
  if (variable_) {
    for (const fs::path& folder : ros_folders()) variable.push_back(folder.string());
  }
  if (!variable.empty()) text += fmt::format(", {} (ROS_PACKAGE_PATH)", fmt::join(variable, ", "));
  std::string meant;
  for (auto place = places.begin(); place != places.end() && meant.empty(); ++place) {
    meant = near_path(place->string());
  }
  if (meant.empty()) {
    meant =
        variable.empty() ? "; its folder may stand in 'robot.package_path' or in ROS_PACKAGE_PATH, which is empty" : "";
  } else {
    meant = fmt::format("; did you mean '{}'?", meant);
  }
  return fmt::format(" (looked for its package in {}{})", text, meant);
}

std::shared_ptr<const Mesh> MeshFiles::triangles(const fs::path& file) {
  auto& mesh = triangles_[file];
  if (!mesh) mesh = load_mesh(file.string());
  return mesh;
}

std::shared_ptr<const Mesh> MeshFiles::hull(const fs::path& file) {
  auto& mesh = hulls_[file];
  if (!mesh) mesh = collision_hull(*triangles(file));
  return mesh;
}

const std::vector<std::shared_ptr<const Mesh>>& MeshFiles::parts(const fs::path& file) {
  auto& parts = parts_[file];
  if (parts.empty()) parts = convex_parts(file.string(), doubts_);
  return parts;
}

}  // namespace graze
