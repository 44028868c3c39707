#include "engine/model/convex_hull.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

struct Face {
  std::array<int, 3> corner;
  Vec3 normal;  // unit, outward
  double offset;
  std::vector<int> outside;  // points above this face that no earlier face has taken
  bool alive = true;
};

class Quickhull {
 public:
  explicit Quickhull(const std::vector<Vec3>& points) : points_(points) {}

  /// False when the points have no volume. Throws InputError, that the mesh is too fine, beyond the room's limits.
  bool run(const std::string& file) {
    if (!first_tetrahedron()) return false;
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      if (faces_[f].alive && !faces_[f].outside.empty()) grow(static_cast<int>(f));
      if (corners_ > kMaxHullCorners || work_ > kMaxHullWork) {
        throw InputError(fmt::format("{}: the convex hull of its {} vertices is too fine: more than {}; simplify it",
                                     file, points_.size(),
                                     corners_ > kMaxHullCorners ? fmt::format("{} corners", kMaxHullCorners)
                                                                : fmt::format("{} distances", kMaxHullWork)));
      }
    }
    return true;
  }

  std::shared_ptr<const Mesh> mesh(const std::string& file) const {
    auto out = std::make_shared<Mesh>();
    out->file = file;
    std::map<int, int> index;
    for (const Face& face : faces_) {
      if (!face.alive) continue;
      Eigen::Vector3i triangle;
      for (int k = 0; k < 3; ++k) {
        const auto [place, fresh] = index.emplace(face.corner[k], static_cast<int>(out->vertices.size()));
        if (fresh) out->vertices.push_back(points_[face.corner[k]]);
        triangle[k] = place->second;
      }
      out->triangles.push_back(triangle);
    }
    return out;
  }

 private:
  using Edge = std::pair<int, int>;

  double height(const Face& face, int point) const { return face.normal.dot(points_[point]) - face.offset; }

  /// The point with the largest value of `measure`, if that is beyond the tolerance.
  template <typename Measure>
  std::optional<int> farthest(Measure measure) const {
    int best = -1;
    double most = tolerance_;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double value = measure(points_[i]);
      if (value > most) {
        most = value;
        best = static_cast<int>(i);
      }
    }
    return best < 0 ? std::nullopt : std::optional<int>(best);
  }

  void set_tolerance() {
    Vec3 low = points_[0], high = points_[0];
    for (const Vec3& p : points_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    tolerance_ = 1e-9 * (high - low).norm();
  }

  bool first_tetrahedron() {
    if (points_.size() < 4) return false;
    set_tolerance();
    const Vec3 a = points_[0];
    const auto b = farthest([&](const Vec3& p) { return (p - a).norm(); });
    if (!b) return false;
    const Vec3 ab = (points_[*b] - a).normalized();
    const auto c = farthest([&](const Vec3& p) { return (p - a).cross(ab).norm(); });
    if (!c) return false;
    const Vec3 normal = ab.cross(points_[*c] - a).normalized();
    const auto d = farthest([&](const Vec3& p) { return std::abs(normal.dot(p - a)); });
    if (!d) return false;
    const bool above = normal.dot(points_[*d] - a) > 0;
    const std::array<int, 4> v = above ? std::array<int, 4>{0, *c, *b, *d} : std::array<int, 4>{0, *b, *c, *d};
    std::vector<int> all(points_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    add_faces({{v[0], v[1], v[2]}, {v[0], v[3], v[1]}, {v[1], v[3], v[2]}, {v[2], v[3], v[0]}}, all);
    return true;
  }

  /// Adds faces and hands each candidate point to the first of them that it lies above.
  void add_faces(const std::vector<std::array<int, 3>>& corners, const std::vector<int>& candidates) {
    const std::size_t first = faces_.size();
    for (const std::array<int, 3>& c : corners) {
      const Vec3 normal = (points_[c[1]] - points_[c[0]]).cross(points_[c[2]] - points_[c[0]]).normalized();
      const int id = static_cast<int>(faces_.size());
      for (int k = 0; k < 3; ++k) owner_[{c[k], c[(k + 1) % 3]}] = id;
      faces_.push_back({c, normal, normal.dot(points_[c[0]]), {}, true});
    }
    for (int point : candidates) {
      for (std::size_t f = first; f < faces_.size(); ++f) {
        ++work_;
        if (height(faces_[f], point) <= tolerance_) continue;
        faces_[f].outside.push_back(point);
        break;
      }
    }
  }

  /// Faces that see the point, found from `start` across shared edges; fills the horizon with the edges around them.
  std::vector<int> visible_from(int point, int start, std::vector<Edge>& horizon) {
    std::vector<int> seen{start};
    faces_[start].alive = false;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const std::array<int, 3> c = faces_[seen[i]].corner;
      for (int k = 0; k < 3; ++k) {
        const int a = c[k], b = c[(k + 1) % 3];
        const auto twin = owner_.find({b, a});
        if (twin == owner_.end()) continue;
        Face& other = faces_[twin->second];
        if (!other.alive) continue;
        if (height(other, point) > tolerance_) {
          other.alive = false;
          seen.push_back(twin->second);
        } else {
          horizon.emplace_back(a, b);
        }
      }
    }
    return seen;
  }

  /// Replaces all faces that see the farthest point above face `f` by a fan from the horizon to that point.
  void grow(int f) {
    const std::vector<int>& outside = faces_[f].outside;
    const int apex = *std::max_element(outside.begin(), outside.end(),
                                       [&](int a, int b) { return height(faces_[f], a) < height(faces_[f], b); });
    ++corners_;
    std::vector<Edge> horizon;
    std::vector<int> candidates;
    for (int seen : visible_from(apex, f, horizon)) {
      for (int point : faces_[seen].outside) {
        if (point != apex) candidates.push_back(point);
      }
      faces_[seen].outside.clear();
    }
    std::vector<std::array<int, 3>> fan;
    for (const auto& [a, b] : horizon) fan.push_back({a, b, apex});
    add_faces(fan, candidates);
  }

  const std::vector<Vec3>& points_;
  double tolerance_ = 0;
  std::size_t corners_ = 4, work_ = 0;  // corners taken so far, and distances computed
  std::vector<Face> faces_;
  std::map<Edge, int> owner_;  // directed edge -> the latest face that has it counter-clockwise
};

}  // namespace

std::shared_ptr<const Mesh> convex_hull(const Mesh& mesh) {
  Quickhull hull(mesh.vertices);
  return hull.run(mesh.file) ? hull.mesh(mesh.file) : nullptr;
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
