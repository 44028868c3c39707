#pragma once
// Where a URDF's mesh files are: relative names, file:// and package:// (ROS).

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/model/world.h"

namespace graze {

class MeshFiles {
 public:
  /// `folder`: of the URDF file. `variable`: whether ROS_PACKAGE_PATH counts.
  MeshFiles(std::filesystem::path folder, std::vector<std::string> package_path, bool variable = true)
      : folder_(std::move(folder)), package_path_(std::move(package_path)), variable_(variable) {}

  /// Every place where `name` may be, best first. package://NAME/rest: rest in folder NAME of a folder of the package
  /// path, then of the URDF's folder and those above it, then of ROS_PACKAGE_PATH, or in such a folder that is itself
  /// called NAME.
  std::vector<std::filesystem::path> candidates(const std::string& name) const;
  /// The first candidate that is a file, or empty.
  std::filesystem::path find(const std::string& name) const;
  /// What to say of a name that leads nowhere: " (looked at FILE; did you mean FILE?)", of a package the folders
  /// instead.
  std::string not_found(const std::string& name) const;
  /// Triangles as they are in the file; each file is read once.
  std::shared_ptr<const Mesh> triangles(const std::filesystem::path& file);
  /// Its convex hull. Throws InputError when it has no volume.
  std::shared_ptr<const Mesh> hull(const std::filesystem::path& file);
  /// The hulls of its convex parts (mesh_parts.h).
  const std::vector<std::shared_ptr<const Mesh>>& parts(const std::filesystem::path& file);
  /// Of these, the parts that are not convex, in words.
  const std::vector<std::string>& doubts() const { return doubts_; }

 private:
  std::filesystem::path folder_;
  std::vector<std::string> package_path_;
  bool variable_;
  std::map<std::filesystem::path, std::shared_ptr<const Mesh>> triangles_, hulls_;
  std::map<std::filesystem::path, std::vector<std::shared_ptr<const Mesh>>> parts_;
  std::vector<std::string> doubts_;
};

}  // namespace graze
