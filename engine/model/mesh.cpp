// Mesh files, by assimp.
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "engine/model/assimp_library.h"
#include "engine/model/dae_size.h"
#include "engine/model/limits.h"
#include "engine/model/mesh_size.h"
#include "engine/model/mesh_text.h"
#include "engine/model/urdf.h"
#include "engine/settings/child.h"
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

/// A shape of a file, moved to where its node has it.
struct RawPart {
  std::uint32_t node = 0;
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Collects triangles, with each point once: files like STL repeat it for every triangle. (The library's own way to
/// join vertices takes the square of those that lie in one plane.)
class Joiner {
 public:
  explicit Joiner(Mesh& mesh) : mesh_(mesh) {}

  void append(const RawPart& part) {
    std::vector<int> index;
    for (const auto& p : part.vertices) index.push_back(vertex(p));
    for (const auto& t : part.triangles) {
      for (const std::uint32_t corner : t) {
        if (corner < index.size()) continue;
        throw InputError(fmt::format("{}: a face of the mesh has a corner of index {}, and there are {} vertices",
                                     mesh_.file, static_cast<std::int32_t>(corner), index.size()));
      }
      mesh_.triangles.emplace_back(index[t[0]], index[t[1]], index[t[2]]);
    }
  }

 private:
  struct Hash {
    std::size_t operator()(const std::array<std::uint32_t, 3>& bits) const {
      std::uint64_t h = bits[0];
      for (int k = 1; k < 3; ++k) h = (h ^ (h >> 29)) * 0x9e3779b97f4a7c15u + bits[k];
      return (h ^ (h >> 32)) * 0x9e3779b97f4a7c15u;
    }
  };

  int vertex(const std::array<float, 3>& p) {
    const float xyz[] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};  // -0 is 0
    std::array<std::uint32_t, 3> bits;
    std::memcpy(bits.data(), xyz, sizeof xyz);
    const auto [place, fresh] = index_.try_emplace(bits, static_cast<int>(mesh_.vertices.size()));
    if (fresh) mesh_.vertices.emplace_back(p[0], p[1], p[2]);
    return place->second;
  }

  Mesh& mesh_;
  std::unordered_map<std::array<std::uint32_t, 3>, int, Hash> index_;
};

/// Raw parts as bytes, as a child process tells them: for each its node, how many vertices and triangles, and these.
class PartsWriter {
 public:
  explicit PartsWriter(const std::string& file) : file_(file) {}

  /// What are only points and lines is left out.
  void add(const aiMesh& part, const aiMatrix4x4& X, std::uint32_t node) {
    begin(part, node);
    for (unsigned i = 0; i < part.mNumVertices; ++i) put(X * part.mVertices[i]);
    put_triangles(part);
  }
  void add(const aiMesh& part) {
    begin(part, 0);
    for (unsigned i = 0; i < part.mNumVertices; ++i) put(part.mVertices[i]);
    put_triangles(part);
  }
  std::string take() { return std::move(out_); }

 private:
  template <typename T>
  void put_bytes(const T* from, std::size_t count) {
    out_.append(reinterpret_cast<const char*>(from), count * sizeof(T));
  }
  void begin(const aiMesh& part, std::uint32_t node) {
    corners_ += part.mNumVertices;
    if (corners_ > kMaxMeshCorners) {
      throw InputError(fmt::format("{}: more than {} vertices; simplify the mesh", file_, kMaxMeshCorners));
    }
    std::uint32_t triangles = 0;
    for (unsigned i = 0; i < part.mNumFaces; ++i) triangles += part.mFaces[i].mNumIndices == 3;
    const std::uint32_t head[] = {node, part.mNumVertices, triangles};
    put_bytes(head, 3);
  }
  void put(const aiVector3D& p) {
    const float xyz[] = {p.x, p.y, p.z};
    put_bytes(xyz, 3);
  }
  void put_triangles(const aiMesh& part) {
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      if (part.mFaces[i].mNumIndices == 3) put_bytes(part.mFaces[i].mIndices, 3);
    }
  }

  const std::string& file_;
  std::string out_;
  std::size_t corners_ = 0;
};

void add_nodes(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above, std::uint32_t& number,
               PartsWriter& out) {
  const aiMatrix4x4 X = above * node.mTransformation;
  const std::uint32_t own = number++;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) out.add(*scene.mMeshes[node.mMeshes[i]], X, own);
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_nodes(scene, *node.mChildren[i], X, number, out);
}

std::vector<RawPart> parts_of(const std::string& bytes) {
  std::vector<RawPart> out;
  std::size_t at = 0;
  const auto take = [&](auto* to, std::size_t count) {
    const std::size_t size = count * sizeof(*to);
    if (bytes.size() - at < size) throw MachineError("a mesh that was read is cut off");
    if (size > 0) std::memcpy(to, bytes.data() + at, size);
    at += size;
  };
  while (at < bytes.size()) {
    std::array<std::uint32_t, 3> head;
    take(head.data(), head.size());
    RawPart& part = out.emplace_back();
    part.node = head[0];
    if (head[1] > bytes.size() || head[2] > bytes.size()) throw MachineError("a mesh that was read is cut off");
    part.vertices.resize(head[1]);
    part.triangles.resize(head[2]);
    take(part.vertices.data(), part.vertices.size());
    take(part.triangles.data(), part.triangles.size());
  }
  return out;
}

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

/// What the library says of a file.
std::string in_its_words(const std::string& said) {
  if (said.find("bad_alloc") != std::string::npos) {
    return "it asks for more memory than a mesh may take; the file is damaged";
  }
  return fit_for_a_line(said);
}

/// Each shape of a file: where its node moves it, or, `as_listed`, as it stands.
enum class Nodes { moved, as_listed };

std::string parts_in_bytes(const std::string& file, const std::string& bytes, Nodes nodes) {
  const AssimpLibrary& assimp = AssimpLibrary::get();
  std::string said;
  const aiScene* scene = assimp.read(std::filesystem::path(file).filename().string(), bytes, said);
  if (scene) refuse_empty_faces(*scene, file);
  if (scene) scene = assimp.triangulate(*scene, said);
  if (!scene) {
    // What the library says of a file without any facet differs from kind to kind, and names none of what is wrong.
    const std::string why = in_its_words(said);
    const bool hollow = why.find("No output meshes") != std::string::npos || why.find("no facets") != std::string::npos;
    throw InputError(hollow ? fmt::format("{}: the mesh has no triangles; it must have some", file)
                            : fmt::format("{}: cannot be read as a mesh: {}", file, why));
  }
  PartsWriter out(file);
  std::uint32_t number = 0;
  if (nodes == Nodes::as_listed) {
    for (unsigned i = 0; i < scene->mNumMeshes; ++i) out.add(*scene->mMeshes[i]);
  } else {
    add_nodes(*scene, *scene->mRootNode, aiMatrix4x4(), number, out);
  }
  return out.take();
}

/// The library reads in a child process: it was made for files of friends, and crashes or hangs on some others.
std::vector<RawPart> read_parts(const std::string& file, Nodes nodes) {
  if (!input_exists(file)) throw InputError(fmt::format("{}: no such mesh file{}", file, path_suggestion(file)));
  const std::string kind = kind_of(file);
  if (!is_mesh_kind(file)) {
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
  AssimpLibrary::get();  // once, not in each child
  constexpr ChildLimits kLimits = {30, std::size_t{3} << 30, std::size_t{1} << 30};
  const ChildRun run = run_in_child([&] { return parts_in_bytes(file, bytes, nodes); }, kLimits);
  if (!run.problem.empty()) {
    throw InputError(
        fmt::format("{}: cannot be read as a mesh: the library that reads it {}; the file is damaged, or "
                    "convert it to a plain OBJ, STL or DAE",
                    file, run.problem));
  }
  return parts_of(run.output);
}

}  // namespace

std::shared_ptr<const Mesh> load_mesh(const std::string& file) {
  const std::string kind = kind_of(file);
  auto mesh = std::make_shared<Mesh>();
  mesh->file = file;
  Joiner joiner(*mesh);
  const bool still = kind == ".obj" || kind == ".stl";  // their nodes move nothing
  for (const RawPart& part : read_parts(file, still ? Nodes::as_listed : Nodes::moved)) joiner.append(part);
  refuse_infinite(*mesh);
  if (mesh->triangles.empty()) throw InputError(fmt::format("{}: the mesh has no triangles; it must have some", file));
  refuse_degenerate(*mesh);
  return mesh;
}

std::vector<std::shared_ptr<const Mesh>> load_mesh_objects(const std::string& file) {
  struct Object {
    std::shared_ptr<Mesh> mesh = std::make_shared<Mesh>();
    Joiner joiner{*mesh};
  };
  std::map<std::uint32_t, Object> objects;  // by node
  for (const RawPart& part : read_parts(file, Nodes::moved)) {
    Object& object = objects[part.node];
    object.mesh->file = file;
    object.joiner.append(part);
  }
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
  return !kind.empty() && AssimpLibrary::get().reads(kind);
}

}  // namespace graze
