#include "engine/model/convex_hull.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <new>
#include <tuple>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace graze {

namespace {

/// The point with the largest value of `measure`.
template <typename Measure>
const Vec3& farthest(const std::vector<Vec3>& points, Measure measure) {
  return *std::max_element(points.begin(), points.end(),
                           [&](const Vec3& a, const Vec3& b) { return measure(a) < measure(b); });
}

/// Whether all points lie in one plane, within 1e-9 of their extent.
bool is_flat(const std::vector<Vec3>& points) {
  constexpr double kFlat = 1e-9;
  if (points.size() < 4) return true;
  const Vec3& a = points[0];
  const auto from_a = [&](const Vec3& p) { return (p - a).norm(); };
  const Vec3 b = farthest(points, from_a);
  const double narrow = kFlat * from_a(b);
  if (!(narrow > 0)) return true;
  const Vec3 along = (b - a).normalized();
  const auto from_line = [&](const Vec3& p) { return (p - a).cross(along).norm(); };
  const Vec3 c = farthest(points, from_line);
  if (from_line(c) <= narrow) return true;
  const Vec3 normal = along.cross(c - a).normalized();
  const auto from_plane = [&](const Vec3& p) { return std::abs(normal.dot(p - a)); };
  return from_plane(farthest(points, from_plane)) <= narrow;
}

/// One run of qhull, whose memory ends with it.
class Qhull {
 public:
  explicit Qhull(const std::vector<Vec3>& points) : silent_(std::fopen("/dev/null", "w")) {
    for (const Vec3& p : points) coordinates_.insert(coordinates_.end(), {p.x(), p.y(), p.z()});
    qh_zero(&qh_, silent_);
  }
  ~Qhull() {
    int lost = 0, bytes = 0;
    qh_freeqhull(&qh_, !qh_ALL);
    qh_memfreeshort(&qh_, &lost, &bytes);
    if (silent_) std::fclose(silent_);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  /// False when the points are too flat for it.
  bool run(std::size_t most) {
    // Qt: triangles; TAn: ends after n corners.
    std::string command = fmt::format("qhull Qt TA{}", most + 1);
    const int count = static_cast<int>(coordinates_.size() / 3);
    const int code = qh_new_qhull(&qh_, 3, count, coordinates_.data(), False, command.data(), nullptr, silent_);
    if (code == qh_ERRmem) throw std::bad_alloc();
    return code == qh_ERRnone;
  }

  std::vector<HullFace> faces() {
    std::vector<HullFace> out;
    qhT* qh = &qh_;  // the name that the library's macros expect
    facetT* facet = nullptr;
    FORALLfacets {
      HullFace face{Eigen::Vector3i::Zero(), {facet->normal[0], facet->normal[1], facet->normal[2]}, -facet->offset};
      int k = 0;
      vertexT *vertex = nullptr, **vertexp = nullptr;
      FOREACHvertex_(facet->vertices) if (k < 3) face.corner[k++] = qh_pointid(qh, vertex->point);
      if (faces_inward(face)) std::swap(face.corner[1], face.corner[2]);
      out.push_back(face);
    }
    return out;
  }

 private:
  bool faces_inward(const HullFace& face) const {
    Vec3 at[3];
    for (int k = 0; k < 3; ++k) at[k] = Eigen::Map<const Vec3>(coordinates_.data() + 3 * face.corner[k]);
    return (at[1] - at[0]).cross(at[2] - at[0]).dot(face.normal) < 0;
  }

  FILE* silent_;
  std::vector<double> coordinates_;
  qhT qh_;
};

/// Fingerprint of a mesh's vertices: their number and two hashes of their bits. Meshes with the same one count as the
/// same.
using Content = std::tuple<std::size_t, std::uint64_t, std::uint64_t>;

Content content_of(const std::vector<Vec3>& points) {
  std::uint64_t a = 0xcbf29ce484222325u, b = 0x9e3779b97f4a7c15u;
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) {
      std::uint64_t bits;
      std::memcpy(&bits, &p[k], sizeof bits);
      a = (a ^ (bits ^ (bits >> 32))) * 0x100000001b3u;
      a ^= a >> 29;
      b = (b + bits) * 0xbf58476d1ce4e5b9u;
      b ^= b >> 31;
    }
  }
  return {points.size(), a, b};
}

/// Hulls that somebody holds.
class Cache {
 public:
  std::shared_ptr<const Mesh> find(const Content& content) {
    const std::lock_guard lock(mutex_);
    const auto at = hulls_.find(content);
    return at == hulls_.end() ? nullptr : at->second.lock();
  }
  void keep(const Content& content, const std::shared_ptr<const Mesh>& hull) {
    const std::lock_guard lock(mutex_);
    std::erase_if(hulls_, [](const auto& entry) { return entry.second.expired(); });
    hulls_[content] = hull;
  }

 private:
  std::mutex mutex_;
  std::map<Content, std::weak_ptr<const Mesh>> hulls_;
};

/// Only the vertices that faces have, in their order.
std::shared_ptr<Mesh> of_faces(const Mesh& mesh, const std::vector<HullFace>& faces) {
  std::vector<int> index(mesh.vertices.size(), -1);
  for (const HullFace& face : faces) {
    for (int k = 0; k < 3; ++k) index[face.corner[k]] = 0;
  }
  auto out = std::make_shared<Mesh>();
  out->file = mesh.file;
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (index[i] < 0) continue;
    index[i] = static_cast<int>(out->vertices.size());
    out->vertices.push_back(mesh.vertices[i]);
  }
  for (const HullFace& face : faces) {
    out->triangles.emplace_back(index[face.corner[0]], index[face.corner[1]], index[face.corner[2]]);
  }
  return out;
}

}  // namespace

std::vector<HullFace> hull_faces(const std::vector<Vec3>& points, std::size_t most) {
  if (is_flat(points)) return {};
  Qhull qhull(points);
  return qhull.run(most) ? qhull.faces() : std::vector<HullFace>();
}

std::shared_ptr<const Mesh> convex_hull(const Mesh& mesh) {
  if (mesh.vertices.size() > kMaxHullPoints) {
    throw InputError(
        fmt::format("{}: a collision mesh of {} vertices: at most {}, of which its hull is found; simplify it",
                    mesh.file, mesh.vertices.size(), kMaxHullPoints));
  }
  static Cache cache;
  const Content content = content_of(mesh.vertices);
  auto known = cache.find(content);
  if (known && known->file == mesh.file) return known;
  const std::vector<HullFace> faces = hull_faces(mesh.vertices, kMaxHullCorners);
  if (faces.empty()) return nullptr;
  auto hull = of_faces(mesh, faces);
  if (hull->vertices.size() > kMaxHullCorners) {
    throw InputError(
        fmt::format("{}: the convex hull of its {} vertices is too fine: more than {} corners; simplify it", mesh.file,
                    mesh.vertices.size(), kMaxHullCorners));
  }
  cache.keep(content, hull);
  return hull;
}

std::shared_ptr<const Mesh> collision_hull(const Mesh& mesh) {
  auto hull = convex_hull(mesh);
  if (!hull) {
    throw InputError(mesh.file +
                     ": the mesh is flat, all its points lie in one plane; a collision mesh must enclose a volume");
  }
  return hull;
}

}  // namespace graze
