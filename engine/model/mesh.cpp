// Mesh files, by assimp.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <filesystem>

#include "engine/model/urdf.h"
#include "engine/settings/inputs.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

bool readable_kind(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".obj" || extension == ".stl";
}

/// Appends one of the scene's meshes; points and lines are left out.
void append(const aiMesh& part, Mesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& p = part.mVertices[i];
    mesh.vertices.emplace_back(p.x, p.y, p.z);
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;
    mesh.triangles.emplace_back(first + static_cast<int>(face.mIndices[0]), first + static_cast<int>(face.mIndices[1]),
                                first + static_cast<int>(face.mIndices[2]));
  }
}

}  // namespace

std::shared_ptr<const Mesh> load_mesh(const std::string& file) {
  if (!input_exists(file)) throw InputError(fmt::format("{}: no such mesh file", file));
  if (!readable_kind(file)) {
    throw InputError(fmt::format("{}: meshes must be OBJ or STL files; convert it to one of them", file));
  }
  Assimp::Importer importer;
  const std::string bytes = read_input(file);
  const aiScene* scene = importer.ReadFileFromMemory(
      bytes.data(), bytes.size(),
      aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_PreTransformVertices,
      std::filesystem::path(file).extension().string().substr(1).c_str());
  if (!scene) throw InputError(fmt::format("{}: cannot be read as a mesh: {}", file, importer.GetErrorString()));
  auto mesh = std::make_shared<Mesh>();
  mesh->file = file;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(*scene->mMeshes[i], *mesh);
  for (const Vec3& vertex : mesh->vertices) {
    if (!vertex.allFinite()) throw InputError(fmt::format("{}: a vertex of the mesh is not finite", file));
  }
  if (mesh->triangles.empty()) throw InputError(fmt::format("{}: the mesh has no triangles", file));
  return mesh;
}

}  // namespace graze
