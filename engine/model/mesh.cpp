// Mesh files, by assimp.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "engine/model/dae_size.h"
#include "engine/model/limits.h"
#include "engine/model/mesh_size.h"
#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "engine/settings/paths.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

/// ".dae" of "A.DAE".
std::string kind_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// Kinds whose size this program looks into before the library does, and whose content is bounded so.
bool bounded_kind(const std::string& kind) { return kind == ".obj" || kind == ".stl" || kind == ".dae"; }

/// Kinds that hold packed data: a small file can be a large mesh.
bool packed_kind(const std::string& kind) {
  constexpr std::string_view kPacked[] = {".fbx", ".3mf", ".blend", ".zae", ".x", ".x3db", ".usdz", ".iqm", ".q3o"};
  return std::find(std::begin(kPacked), std::end(kPacked), kind) != std::end(kPacked);
}

std::size_t most_bytes(const std::string& kind) {
  if (bounded_kind(kind)) return kMaxMeshBytes;
  return packed_kind(kind) ? kMaxPackedMeshBytes : kMaxOtherMeshBytes;
}

/// Collects triangles, with each point once: files like STL repeat it for every triangle. (The library's own way to
/// join vertices takes the square of those that lie in one plane.)
class Joiner {
 public:
  explicit Joiner(Mesh& mesh) : mesh_(mesh) {}

  /// What are only points and lines is left out.
  void append(const aiMesh& part) {
    append_moved(part, [](const aiVector3D& p) { return p; });
  }
  void append(const aiMesh& part, const aiMatrix4x4& X) {
    append_moved(part, [&](const aiVector3D& p) { return X * p; });
  }

 private:
  template <typename Move>
  void append_moved(const aiMesh& part, const Move& move) {
    std::vector<int> index(part.mNumVertices, -1);
    for (unsigned i = 0; i < part.mNumVertices; ++i) index[i] = vertex(move(part.mVertices[i]));
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      if (face.mNumIndices != 3) continue;
      mesh_.triangles.emplace_back(index[face.mIndices[0]], index[face.mIndices[1]], index[face.mIndices[2]]);
    }
  }

  struct Hash {
    std::size_t operator()(const std::array<std::uint32_t, 3>& bits) const {
      std::uint64_t h = bits[0];
      for (int k = 1; k < 3; ++k) h = (h ^ (h >> 29)) * 0x9e3779b97f4a7c15u + bits[k];
      return (h ^ (h >> 32)) * 0x9e3779b97f4a7c15u;
    }
  };

  int vertex(const aiVector3D& p) {
    const float xyz[] = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f};  // -0 is 0
    std::array<std::uint32_t, 3> bits;
    std::memcpy(bits.data(), xyz, sizeof xyz);
    const auto [place, fresh] = index_.try_emplace(bits, static_cast<int>(mesh_.vertices.size()));
    if (fresh) mesh_.vertices.emplace_back(p.x, p.y, p.z);
    return place->second;
  }

  Mesh& mesh_;
  std::unordered_map<std::array<std::uint32_t, 3>, int, Hash> index_;
};

/// Calls act(shape, where its node moves it, number of the node) for all shapes of a scene.
template <typename Act>
class Walk {
 public:
  Walk(const std::string& file, Act act) : file_(file), act_(std::move(act)) {}
  void run(const aiScene& scene) { run(scene, *scene.mRootNode, aiMatrix4x4()); }

 private:
  void run(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above) {
    const aiMatrix4x4 X = above * node.mTransformation;
    const int number = nodes_++;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& part = *scene.mMeshes[node.mMeshes[i]];
      corners_ += part.mNumVertices;
      if (corners_ > kMaxMeshCorners) {
        throw InputError(fmt::format("{}: more than {} vertices; simplify the mesh", file_, kMaxMeshCorners));
      }
      act_(part, X, number);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) run(scene, *node.mChildren[i], X);
  }

  const std::string& file_;
  Act act_;
  std::size_t corners_ = 0;
  int nodes_ = 0;
};

void refuse_infinite(const Mesh& mesh) {
  for (const Vec3& vertex : mesh.vertices) {
    if (!vertex.allFinite()) throw InputError(fmt::format("{}: a vertex of the mesh is not finite", mesh.file));
  }
}

/// Throws InputError if all points lie in one place or on one line: no triangle has an area then.
void refuse_degenerate(const Mesh& mesh) {
  constexpr double kNarrow = 1e-6;  // of the length; coordinates in files have six or seven digits
  const Vec3& first = mesh.vertices.front();
  Vec3 along = Vec3::Zero();
  for (const Vec3& vertex : mesh.vertices) {
    if ((vertex - first).norm() > along.norm()) along = vertex - first;
  }
  const double length = along.norm();
  double width = 0;
  for (const Vec3& vertex : mesh.vertices) {
    if (length > 0) width = std::max(width, along.cross(vertex - first).norm() / length);
  }
  if (width > kNarrow * length) return;
  throw InputError(fmt::format("{}: all points of the mesh lie {}; its triangles must have an area", mesh.file,
                               length > 0 ? "on one line" : "in one place"));
}

/// A mesh is one file: what it says of others (materials) is not looked at.
class NoFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char*) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char*, const char*) override { return nullptr; }
  void Close(Assimp::IOStream*) override {}
};

/// Cutting a face without corners into triangles, the library would end the program.
void refuse_empty_faces(const aiScene& scene, const std::string& file) {
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    const aiMesh& part = *scene.mMeshes[i];
    for (unsigned k = 0; k < part.mNumFaces; ++k) {
      if (part.mFaces[k].mNumIndices > 0) continue;
      throw InputError(fmt::format("{}: face {} of the mesh has no corners; a face has at least three", file, k + 1));
    }
  }
}

/// The file as the library reads it, which owns the scene.
const aiScene& read_scene(const std::string& file, Assimp::Importer& importer) {
  if (!input_exists(file)) throw InputError(fmt::format("{}: no such mesh file{}", file, path_suggestion(file)));
  const std::string kind = kind_of(file);
  if (kind.empty() || !importer.IsExtensionSupported(kind)) {
    throw InputError(fmt::format("{}: is of no kind of mesh that can be read; convert it to OBJ, STL or DAE", file));
  }
  const std::string bytes = read_input(file, "", most_bytes(kind));
  if (bytes.empty()) throw InputError(fmt::format("{}: is an empty file; a mesh must have triangles", file));
  if (kind == ".dae") {
    check_dae_size(bytes, file);
  } else if (kind == ".ply") {
    check_ply_head(bytes, file);
  } else if (bounded_kind(kind)) {
    check_mesh_size(bytes, file);
  }
  // As ROS takes them: units count, and which axis a drawing calls "up" does not.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);  // which stand in for shapes that are not there
  importer.SetIOHandler(new NoFiles);                                   // the importer's from now on
  const aiScene* scene = importer.ReadFileFromMemory(
      bytes.data(), bytes.size(), 0, std::filesystem::path(file).extension().string().substr(1).c_str());
  if (scene) refuse_empty_faces(*scene, file);
  if (scene) scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene) return *scene;
  // What the library says of a file without any facet differs from kind to kind, and names none of what is wrong.
  const std::string why = importer.GetErrorString();
  const bool hollow = why.find("No output meshes") != std::string::npos || why.find("no facets") != std::string::npos;
  throw InputError(hollow ? fmt::format("{}: the mesh has no triangles; it must have some", file)
                          : fmt::format("{}: cannot be read as a mesh: {}", file, why));
}

}  // namespace

std::shared_ptr<const Mesh> load_mesh(const std::string& file) {
  Assimp::Importer importer;
  const aiScene& scene = read_scene(file, importer);
  auto mesh = std::make_shared<Mesh>();
  mesh->file = file;
  Joiner joiner(*mesh);
  const std::string kind = kind_of(file);
  if (kind == ".obj" || kind == ".stl") {  // their nodes move nothing
    for (unsigned i = 0; i < scene.mNumMeshes; ++i) joiner.append(*scene.mMeshes[i]);
  } else {
    Walk(file, [&](const aiMesh& part, const aiMatrix4x4& X, int) { joiner.append(part, X); }).run(scene);
  }
  refuse_infinite(*mesh);
  if (mesh->triangles.empty()) throw InputError(fmt::format("{}: the mesh has no triangles; it must have some", file));
  refuse_degenerate(*mesh);
  return mesh;
}

std::vector<std::shared_ptr<const Mesh>> load_mesh_objects(const std::string& file) {
  Assimp::Importer importer;
  const aiScene& scene = read_scene(file, importer);
  struct Object {
    std::shared_ptr<Mesh> mesh = std::make_shared<Mesh>();
    Joiner joiner{*mesh};
  };
  std::map<int, Object> objects;  // by node
  Walk(file, [&](const aiMesh& part, const aiMatrix4x4& X, int node) {
    Object& object = objects[node];
    object.mesh->file = file;
    object.joiner.append(part, X);
  }).run(scene);
  std::vector<std::shared_ptr<const Mesh>> out;
  for (const auto& [node, object] : objects) {
    refuse_infinite(*object.mesh);
    if (!object.mesh->triangles.empty()) out.push_back(object.mesh);
  }
  if (out.empty()) throw InputError(fmt::format("{}: the mesh has no triangles; it must have some", file));
  return out;
}

bool is_mesh_kind(const std::string& name) {
  const std::string kind = kind_of(name);
  return !kind.empty() && Assimp::Importer().IsExtensionSupported(kind);
}

}  // namespace graze
