#include "engine/model/terrain_rise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "engine/lanes/scalar.h"

namespace graze {
namespace {

/// From `low` to `high`, both included.
struct Range {
  int low, high;
};

/// A heightfield in its own frame, whose z axis points up. Each cell is cut from its corner (x + 1, y) to (x, y + 1),
/// as contact sees it.
class Field {
 public:
  explicit Field(const Shape& shape)
      : grid_(*shape.grid),
        size_(shape.size),
        cell_x_(shape.size.x() / (grid_.nx - 1)),
        cell_y_(shape.size.y() / (grid_.ny - 1)) {}

  Vec3 vertex(int ix, int iy) const {
    return {ix * cell_x_ - 0.5 * size_.x(), iy * cell_y_ - 0.5 * size_.y(),
            size_.z() * grid_.height[static_cast<std::size_t>(iy) * grid_.nx + ix]};
  }
  /// Cells that a stretch of x, or of y, reaches into; none if it lies beyond the rim.
  Range cells_x(double low, double high) const { return cells(low, high, size_.x(), cell_x_, grid_.nx); }
  Range cells_y(double low, double high) const { return cells(low, high, size_.y(), cell_y_, grid_.ny); }

  /// Calls f(triangle) for the two of each cell that a rectangle about the points reaches into, wider by r.
  template <class F>
  void each_triangle(const Vec3& a, const Vec3& b, double r, const F& f) const {
    const Range x = cells_x(std::min(a.x(), b.x()) - r, std::max(a.x(), b.x()) + r);
    const Range y = cells_y(std::min(a.y(), b.y()) - r, std::max(a.y(), b.y()) + r);
    for (int iy = y.low; iy <= y.high; ++iy) {
      for (int ix = x.low; ix <= x.high; ++ix) {
        const Vec3 right = vertex(ix + 1, iy), left = vertex(ix, iy + 1);
        f(std::array<Vec3, 3>{vertex(ix, iy), right, left});
        f(std::array<Vec3, 3>{vertex(ix + 1, iy + 1), left, right});
      }
    }
  }
  /// Calls f(grid point) for those in the rectangle.
  template <class F>
  void each_point(const Vec3& low, const Vec3& high, const F& f) const {
    const Range x = cells_x(low.x(), high.x()), y = cells_y(low.y(), high.y());
    for (int iy = y.low; iy <= y.high + 1 && x.low <= x.high; ++iy) {
      for (int ix = x.low; ix <= x.high + 1; ++ix) f(vertex(ix, iy));
    }
  }

 private:
  static Range cells(double low, double high, double size, double cell, int points) {
    const double from = (low + 0.5 * size) / cell, to = (high + 0.5 * size) / cell;
    if (!(to >= 0 && from <= points - 1)) return {0, -1};
    const auto bounded = [&](double x) { return static_cast<int>(std::clamp(x, 0.0, points - 2.0)); };
    return {bounded(from), bounded(to)};
  }

  const HeightGrid& grid_;
  Vec3 size_;
  double cell_x_, cell_y_;  // m
};

/// z-component of the cross product: twice the area of a triangle as seen from above.
double across(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The height of a triangle's plane at (x, y), if that lies in the triangle as seen from above.
std::optional<double> height_at(const std::array<Vec3, 3>& t, const Vec3& p) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double area = across(ab, ac);
  if (area == 0) return std::nullopt;  // seen from its edge
  const double u = across(ap, ac) / area, v = across(ab, ap) / area;
  if (!(u >= 0 && v >= 0 && u + v <= 1)) return std::nullopt;
  return t[0].z() + u * ab.z() + v * ac.z();
}

/// The most that anything has asked for.
class Rise {
 public:
  explicit Rise(const Field& field) : field_(field) {}

  /// A ball whose centre is at c.
  void add_ball(const Vec3& c, double r) {
    field_.each_triangle(c, c, r, [&](const std::array<Vec3, 3>& t) {
      const Vec3 upward = (t[1] - t[0]).cross(t[2] - t[0]), n = upward / upward.norm();
      if (const auto height = height_at(t, c - r * n)) ask(*height + r * n.z() - c.z());
      for (int k = 0; k < 3; ++k) {
        add_edge_under_ball(t[k], t[(k + 1) % 3], c, r);
        const double left = r * r - (t[k] - c).head<2>().squaredNorm();
        if (left >= 0) ask(t[k].z() + std::sqrt(left) - c.z());
      }
    });
  }

  /// A polyhedron: its corners, and its faces as triangles.
  void add_polyhedron(const std::vector<Vec3>& corners, const std::vector<Eigen::Vector3i>& faces) {
    for (const Vec3& corner : corners) {
      field_.each_triangle(corner, corner, 0, [&](const std::array<Vec3, 3>& t) {
        if (const auto height = height_at(t, corner)) ask(*height - corner.z());
      });
    }
    std::set<std::pair<int, int>> edges;
    for (const Eigen::Vector3i& face : faces) {
      const std::array<Vec3, 3> t = {corners[face[0]], corners[face[1]], corners[face[2]]};
      field_.each_point(t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2]), [&](const Vec3& p) {
        if (const auto height = height_at(t, p)) ask(p.z() - *height);
      });
      for (int k = 0; k < 3; ++k) edges.insert(std::minmax(face[k], face[(k + 1) % 3]));
    }
    for (const auto& [a, b] : edges) add_edge(corners[a], corners[b]);
  }

  std::optional<double> most() const { return most_ > kNone ? std::optional(most_) : std::nullopt; }

 private:
  static constexpr double kNone = -std::numeric_limits<double>::infinity();

  void ask(double rise) { most_ = std::max(most_, rise); }

  /// Along the edge the ball's centre would pass at heights that have one greatest: where that lies on the edge.
  void add_edge_under_ball(const Vec3& a, const Vec3& b, const Vec3& c, double r) {
    const Vec3 ab = b - a;
    const double length = pinned::hypot(ab.x(), ab.y()), slope = ab.z() / length;
    const double foot = (c - a).head<2>().dot(ab.head<2>()) / length;  // of c on the edge
    const double aside = across(ab, c - a) / length, left = r * r - aside * aside;
    if (!(left >= 0)) return;
    const double steep = std::sqrt(1 + slope * slope), at = foot + slope * std::sqrt(left) / steep;
    if (at >= 0 && at <= length) ask(a.z() + slope * foot + std::sqrt(left) * steep - c.z());
  }

  /// Where the edge crosses edges of the ground, as seen from above.
  void add_edge(const Vec3& a, const Vec3& b) {
    field_.each_triangle(a, b, 0, [&](const std::array<Vec3, 3>& t) {
      for (int k = 0; k < 3; ++k) {
        const Vec3 &c = t[k], &d = t[(k + 1) % 3], ab = b - a, cd = d - c;
        const double area = across(ab, cd);
        if (area == 0) continue;  // side by side: their ends tell
        const double u = across(c - a, cd) / area, v = across(c - a, ab) / area;
        if (u >= 0 && u <= 1 && v >= 0 && v <= 1) ask(c.z() + v * cd.z() - a.z() - u * ab.z());
      }
    });
  }

  const Field& field_;
  double most_ = kNone;
};

/// A prism of so many corners all around, as triangles; corners of the bottom and of the top by turns.
constexpr int kSides = 24;

std::vector<Vec3> prism_corners(double radius, double length, const Pose& X) {
  const double out = radius / pinned::cos(std::numbers::pi / kSides);  // about the round one
  std::vector<Vec3> corners;
  for (int k = 0; k < kSides; ++k) {
    const pinned::SineCosine at = pinned::sin_cos(2 * std::numbers::pi * k / kSides);
    for (const double z : {-0.5 * length, 0.5 * length}) corners.push_back(X * Vec3(out * at.cosine, out * at.sine, z));
  }
  return corners;
}

std::vector<Eigen::Vector3i> prism_faces(bool ends) {
  std::vector<Eigen::Vector3i> faces;
  constexpr int kCorners = 2 * kSides;
  for (int k = 0; k < kCorners; k += 2) {
    const int next = (k + 2) % kCorners;
    faces.emplace_back(k, next, k + 1);
    faces.emplace_back(next + 1, k + 1, next);
    for (int end = 0; ends && end < 2; ++end) faces.emplace_back(end, k + end, next + end);
  }
  return faces;
}

void add_box(const Vec3& size, const Pose& X, Rise& rise) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) {
    corners.push_back(X * Vec3(0.5 * Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1).cwiseProduct(size)));
  }
  static const std::vector<Eigen::Vector3i> kFaces = {{0, 2, 1}, {3, 1, 2}, {4, 5, 6}, {7, 6, 5}, {0, 1, 4}, {5, 4, 1},
                                                      {2, 6, 3}, {7, 3, 6}, {0, 4, 2}, {6, 2, 4}, {1, 3, 5}, {7, 5, 3}};
  rise.add_polyhedron(corners, kFaces);
}

void add_shape(const Shape& shape, const Pose& X, Rise& rise) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return rise.add_ball(X.translation(), s.x());
    case ShapeKind::box:
      return add_box(s, X, rise);
    case ShapeKind::cylinder:
      return rise.add_polyhedron(prism_corners(s.x(), s.y(), X), prism_faces(true));
    case ShapeKind::capsule:
      for (const double z : {-0.5 * s.y(), 0.5 * s.y()}) rise.add_ball(X * Vec3(0, 0, z), s.x());
      return rise.add_polyhedron(prism_corners(s.x(), s.y(), X), prism_faces(false));
    case ShapeKind::mesh: {
      std::vector<Vec3> corners;
      for (const Vec3& vertex : shape.mesh->vertices) corners.push_back(X * Vec3(vertex.cwiseProduct(s)));
      return rise.add_polyhedron(corners, shape.mesh->triangles);
    }
    case ShapeKind::plane:
    case ShapeKind::heightfield:
      break;
  }
}

}  // namespace

std::optional<double> rise_onto_terrain(const Model& model, const std::vector<Pose>& X_WB) {
  const auto pose = [&](const Collider& one) -> Pose { return one.body < 0 ? one.X_BG : X_WB[one.body] * one.X_BG; };
  std::optional<double> out;
  for (const ColliderPair& pair : model.pairs) {
    const Collider *a = &model.colliders[pair.a], *b = &model.colliders[pair.b];
    if (a->shape.kind == ShapeKind::heightfield) std::swap(a, b);
    constexpr double kUpright = 1 - 1e-12;  // cosine of what counts as none
    if (b->shape.kind != ShapeKind::heightfield || a->is_object || b->X_BG.linear()(2, 2) < kUpright) continue;
    const Field field(b->shape);
    Rise rise(field);
    add_shape(a->shape, b->X_BG.inverse() * pose(*a), rise);
    if (const auto most = rise.most()) out = std::max(out.value_or(*most), *most);
  }
  return out;
}

}  // namespace graze
