#include "engine/model/mesh_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "engine/model/convex_hull.h"
#include "engine/model/limits.h"
#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

namespace fs = std::filesystem;

using Meshes = std::vector<std::shared_ptr<const Mesh>>;

std::string folder_of_parts(const std::string& file) {
  return (fs::path(file).parent_path() / (fs::path(file).stem().string() + "_parts")).string();
}

[[noreturn]] void fail_many(const std::string& file, const std::string& what) {
  throw InputError(fmt::format("{}: {}; a mesh is split into at most {}; put fewer convex parts of it into a folder {}",
                               file, what, kMaxMeshHulls, folder_of_parts(file)));
}

/// Sets of vertices that triangles join.
class Pieces {
 public:
  explicit Pieces(const Mesh& mesh) : parent_(mesh.vertices.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (const Eigen::Vector3i& t : mesh.triangles) {
      for (int k = 1; k < 3; ++k) parent_[root(t[k])] = root(t[0]);
    }
  }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

 private:
  std::vector<int> parent_;
};

/// The pieces of a mesh that do not hang together, in the order of their first triangles.
Meshes pieces_of(const std::shared_ptr<const Mesh>& mesh) {
  Pieces pieces(*mesh);
  std::vector<std::shared_ptr<Mesh>> out;
  std::vector<int> piece_of_root(mesh->vertices.size(), -1), index(mesh->vertices.size(), -1);
  for (const Eigen::Vector3i& t : mesh->triangles) {
    int& piece = piece_of_root[pieces.root(t[0])];
    if (piece < 0) {
      piece = static_cast<int>(out.size());
      out.push_back(std::make_shared<Mesh>());
      out.back()->file = mesh->file;
      if (out.size() > kMaxMeshHulls) fail_many(mesh->file, fmt::format("more than {} separate pieces", kMaxMeshHulls));
    }
    Mesh& to = *out[piece];
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      if (index[t[k]] < 0) {
        index[t[k]] = static_cast<int>(to.vertices.size());
        to.vertices.push_back(mesh->vertices[t[k]]);
      }
      corners[k] = index[t[k]];
    }
    to.triangles.push_back(corners);
  }
  return {out.begin(), out.end()};
}

/// m^3 inside of a closed surface; with sign, by which way its triangles face.
double enclosed_volume(const Mesh& mesh) {
  const Vec3& origin = mesh.vertices.front();
  double six = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin, c = mesh.vertices[t[2]] - origin;
    six += a.cross(b).dot(c);
  }
  return six / 6;
}

/// Whether the mesh fills its hull.
bool is_convex(const Mesh& mesh, const Mesh& hull) {
  constexpr double kShare = 0.95;  // rounded edges and shallow grooves leave as much
  return std::abs(enclosed_volume(mesh)) >= kShare * enclosed_volume(hull);
}

/// How much of a mesh's surface lies inside of its hull, 0 to 1; which way its triangles face, and whether it is
/// closed, plays no part. A triangle lies inside if its plane leaves more than 2 % of the hull's size on both sides.
double share_inside(const Mesh& mesh, const Mesh& hull) {
  constexpr double kShallow = 0.02, kMostLooks = 2e7;
  Eigen::AlignedBox3d box;
  for (const Vec3& v : hull.vertices) box.extend(v);
  const double shallow = kShallow * box.sizes().maxCoeff();
  const double looks = static_cast<double>(mesh.triangles.size()) * static_cast<double>(hull.vertices.size());
  const std::size_t every = 1 + static_cast<std::size_t>(looks / kMostLooks);
  double all = 0, inside = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += every) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    const Vec3 a = mesh.vertices[t[0]];
    const Vec3 across = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    const double area = across.norm();
    if (!(area > 0)) continue;
    double least = 0, most = 0;
    for (const Vec3& v : hull.vertices) {
      const double above = across.dot(v - a) / area;
      least = std::min(least, above), most = std::max(most, above);
    }
    all += area;
    if (std::min(-least, most) > shallow) inside += area;
  }
  return all > 0 ? inside / all : 0;
}

/// Share of its surface that a convex part may have inside of its hull (our choice).
constexpr double kInside = 0.05;

/// Whether the hull of a part is nearly the part.
bool is_part(const Mesh& mesh, const Mesh& hull) {
  return is_convex(mesh, hull) || share_inside(mesh, hull) <= kInside;
}

/// Tells of a part that is not convex. `name`: of the part.
void doubt_part(const std::string& name, const Mesh& mesh, const Mesh& hull, std::vector<std::string>& doubts) {
  if (is_convex(mesh, hull)) return;
  const double inside = share_inside(mesh, hull);
  if (inside <= kInside) return;
  doubts.push_back(fmt::format(
      "{} is not convex: {:.0f} % of its surface lies inside of its hull, which contact and mass take for it; split it "
      "by V-HACD or CoACD",
      name, 100 * inside));
}

/// Objects that are not convex but hang together in pieces, piece by piece.
Meshes without_loose_pieces(const Meshes& objects, const std::string& file) {
  Meshes out;
  for (const std::shared_ptr<const Mesh>& object : objects) {
    const auto hull = convex_hull(*object);
    if (!hull) continue;  // flat: encloses nothing
    const Meshes pieces = is_part(*object, *hull) ? Meshes{object} : pieces_of(object);
    out.insert(out.end(), pieces.begin(), pieces.end());
    if (out.size() > kMaxMeshHulls) fail_many(file, fmt::format("more than {} separate pieces", kMaxMeshHulls));
  }
  return out;
}

Meshes of_folder(const std::string& file, const std::string& folder, const std::vector<std::string>& names,
                 std::vector<std::string>& doubts) {
  if (names.size() > kMaxMeshHulls) {
    fail_many(file, fmt::format("{} has more than {} mesh files", folder, kMaxMeshHulls));
  }
  read_input(file, "", kMaxMeshBytes);  // kept with a campaign: a replay looks for it, too
  Meshes out;
  for (const std::string& name : names) {
    const auto mesh = load_mesh((fs::path(folder) / name).string());
    out.push_back(collision_hull(*mesh));
    doubt_part(mesh->file, *mesh, *out.back(), doubts);
  }
  return out;
}

std::string what_lacks(const std::string& folder) {
  std::error_code error;
  const std::string name = fs::path(folder).filename().string();
  if (!fs::exists(folder, error)) return fmt::format("there is no folder {}", name);
  if (!fs::is_directory(folder, error)) return fmt::format("{} is a file", name);
  return fmt::format("the folder {} has no meshes", name);
}

}  // namespace

std::vector<std::shared_ptr<const Mesh>> convex_parts(const std::string& file, std::vector<std::string>& doubts) {
  const std::string folder = folder_of_parts(file);
  const std::vector<std::string> names = input_files_in(folder, is_mesh_kind, kMaxMeshHulls);
  if (!names.empty()) return of_folder(file, folder, names, doubts);
  Meshes parts = load_mesh_objects(file);
  if (parts.size() > kMaxMeshHulls) fail_many(file, fmt::format("{} objects", parts.size()));
  const bool several = parts.size() > 1;
  parts = several ? without_loose_pieces(parts, file) : pieces_of(parts.front());
  Meshes hulls;
  Meshes solids;
  for (const std::shared_ptr<const Mesh>& part : parts) {
    auto hull = convex_hull(*part);
    if (!hull) continue;
    hulls.push_back(hull);
    solids.push_back(part);
  }
  if (hulls.empty()) return {collision_hull(*load_mesh(file))};
  if (hulls.size() > 1) {
    for (std::size_t i = 0; i < hulls.size(); ++i) {
      doubt_part(fmt::format("{}: part {} of {}", file, i + 1, hulls.size()), *solids[i], *hulls[i], doubts);
    }
    return hulls;
  }
  if (is_convex(*solids.front(), *hulls.front())) return hulls;
  const std::string lacks = what_lacks(folder);
  throw ConcavePiece(
      fmt::format(
          "{}: a concave mesh of one piece: 'hulls' takes the convex parts of it from a folder {}, and {}; split "
          "it by V-HACD or CoACD",
          file, folder, lacks),
      lacks);
}

}  // namespace graze
