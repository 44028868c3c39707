#pragma once
// URDF -> Robot, by urdfdom.

#include <functional>
#include <string>
#include <vector>

#include "engine/model/hull.h"
#include "engine/model/world.h"

namespace graze {

struct UrdfOptions {
  bool fixed_base = false;
  bool ignore_missing_meshes = false;  // drop collision meshes whose file is not there (with a warning)
  std::vector<std::string>
      package_path;                // folders in which package://NAME/ is looked up, besides the parents of the file
  HullSettings hull;               // of collision meshes
  std::vector<std::string> split;  // links (globs) whose collision meshes are split into convex parts (mesh_parts.h)
  bool split_all = false;          // with those that cannot be split as one hull, and a warning
  double density = 1000;           // kg/m^3 for links that have geometry but no <inertial>
  std::function<void(const std::string&)>
      warn;             // called with one line per thing that was left out, made up or repaired
  bool repair = false;  // mend what can be mended (docs/robots.md), and warn of each repair
  /// Called with the document as it was read in the end, repairs included: read without `repair` it gives the same
  /// robot to the bit. Names of mesh files that would not be found from `read_folder` are absolute in it.
  std::function<void(const std::string&)> read;
  std::string read_folder;
};

/// Reads a URDF file; one that needs xacro is expanded by the program of that name, if it is there (xacro.h). Throws
/// InputError with all problems of the file, each with its line, the link or joint, the rule and what a repair would
/// do: not XML, unknown joint type (with the standard ones), several roots or a loop, missing mesh, inertia that is not
/// positive or breaks the triangle inequality, zero inertia on a moving link. A root link "world" with a fixed joint
/// means a fixed base. Fixed joints are kept here (compile() merges them).
Robot load_urdf(const std::string& file, const UrdfOptions& options = {});

/// The same from text; `name` stands for the file.
Robot parse_urdf(const std::string& xml, const std::string& name, const UrdfOptions& options = {});

/// Reads an OBJ, STL or DAE file, or one of another kind that assimp reads. Throws InputError.
std::shared_ptr<const Mesh> load_mesh(const std::string& file);

/// The same, each object on its own: objects and groups of an OBJ file, solids of an STL file, nodes of others. At
/// least one; those without triangles are left out.
std::vector<std::shared_ptr<const Mesh>> load_mesh_objects(const std::string& file);

/// Whether a name ends as a kind of mesh does that can be read.
bool is_mesh_kind(const std::string& name);

}  // namespace graze
