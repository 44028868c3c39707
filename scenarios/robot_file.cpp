#include "scenarios/robot_file.h"

#include <fmt/format.h>

#include "scenarios/hull_reader.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"

namespace graze {

UrdfOptions read_urdf_options(const Settings& robot, bool ignore_missing_meshes) {
  UrdfOptions out;
  out.ignore_missing_meshes = ignore_missing_meshes;
  if (const auto base = robot.find("base")) out.fixed_base = base->choice({"floating", "fixed"}) == "fixed";
  if (const auto density = robot.find("density")) out.density = density->positive(Quantity::density);
  if (const auto folders = robot.find("package_path")) {
    check_count(*folders, folders->items().size(), kMaxFolders, "folders");
    for (const Settings& folder : folders->items()) out.package_path.push_back(folder.resolve_file(folder.text()));
  }
  if (const auto mesh = robot.find("mesh")) {
    if (!mesh->is_scalar()) {
      mesh->allow(keys_of("hull"));
      out.hull = read_hull(*mesh);
    }
    out.split = read_split(*mesh);
    out.split_all = splits_all(*mesh);
  }
  out.repair = robot.flag_or("repair", false);
  return out;
}

namespace {

Robot load(const Settings& file, const UrdfOptions& options) {
  const std::string path = file.resolve_file(file.text());
  try {
    return load_urdf(path, options);
  } catch (const InputError& e) {
    file.fail(e.what());
  }
}

}  // namespace

Robot read_robot_file(const Settings& robot, const UrdfOptions& options) {
  Robot out = load(robot.at("urdf"), options);
  if (const auto mesh = robot.find("mesh")) check_split(*mesh, out);
  return out;
}

std::string robot_document(const Settings& scenario, bool ignore_missing_meshes, const std::string& folder) {
  const Settings robot = scenario.at("robot");
  UrdfOptions options = read_urdf_options(robot, ignore_missing_meshes);
  std::string out;
  options.read = [&](const std::string& text) { out = text; };
  options.read_folder = folder;
  read_robot_file(robot, options);
  return out;
}

}  // namespace graze
