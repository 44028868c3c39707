#pragma once
// What a scenario has around the paths of its robots, for pictures: edges of fixed objects, waypoints.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/plots.h"
#include "scenarios/scenario.h"

namespace graze {

/// Adds the edges of shapes to what stands around paths.
class ShapeOutlines {
 public:
  explicit ShapeOutlines(PathScene& scene) : scene_(scene), out_(scene.outlines) {}

  /// Boxes by their edges, cylinders, capsules and spheres by circles, heightfields by a net. Planes and meshes have
  /// none.
  void add(const Shape& shape, const Pose& X_WG) {
    X_ = X_WG;
    const Vec3& s = shape.size;
    if (shape.kind == ShapeKind::box) return add_box(0.5 * s);
    if (shape.kind == ShapeKind::heightfield) return add_terrain(shape);
    if (shape.kind == ShapeKind::sphere) return add_circle(s.x(), 0);
    if (shape.kind != ShapeKind::cylinder && shape.kind != ShapeKind::capsule) return;
    for (const double h : {-0.5 * s.y(), 0.5 * s.y()}) add_circle(s.x(), h);
    for (const double x : {-s.x(), s.x()}) add_line({{x, 0, -0.5 * s.y()}, {x, 0, 0.5 * s.y()}});
  }

 private:
  void add_line(const std::vector<Vec3>& points) {
    std::vector<PlotPoint>& out = out_.emplace_back();
    for (const Vec3& local : points) {
      const Vec3 p = X_ * local;
      out.push_back({p.x(), p.y(), p.z()});
    }
  }
  void add_box(const Vec3& h) {
    for (const double z : {-h.z(), h.z()}) {
      add_line({{-h.x(), -h.y(), z}, {h.x(), -h.y(), z}, {h.x(), h.y(), z}, {-h.x(), h.y(), z}, {-h.x(), -h.y(), z}});
    }
    for (const double x : {-h.x(), h.x()}) {
      for (const double y : {-h.y(), h.y()}) add_line({{x, y, -h.z()}, {x, y, h.z()}});
    }
  }
  void add_circle(double radius, double z) {
    constexpr int kCorners = 24;
    std::vector<Vec3> points;
    for (int i = 0; i <= kCorners; ++i) {
      const double angle = 2 * std::numbers::pi * i / kCorners;
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
    add_line(points);
  }

  /// Every n-th line of the grid along x and along y, so that none has more than so many, and the last.
  void add_terrain(const Shape& shape) {
    if (shape.spectrum) {
      scene_.own_grounds = true;
      return;
    }
    constexpr int kLines = 40;
    const HeightGrid& grid = *shape.grid;
    const auto at = [&](int ix, int iy) {
      const double u = ix / (grid.nx - 1.0) - 0.5, v = iy / (grid.ny - 1.0) - 0.5,
                   height = grid.height[static_cast<std::size_t>(iy * grid.nx + ix)];
      const Vec3 p = X_ * shape.size.cwiseProduct(Vec3(u, v, height));
      return PlotPoint{p.x(), p.y(), p.z()};
    };
    const auto add = [&](int lines, int points, const auto& point) {
      const int step = (std::max(grid.nx, grid.ny) + kLines - 1) / kLines;
      for (int i = 0; i < lines; i = i + 1 < lines ? std::min(i + step, lines - 1) : lines) {
        std::vector<PlotPoint>& line = scene_.terrain.emplace_back();
        for (int k = 0; k < points; ++k) line.push_back(point(i, k));
      }
    };
    add(grid.ny, grid.nx, [&](int iy, int ix) { return at(ix, iy); });
    add(grid.nx, grid.ny, at);
  }

  PathScene& scene_;
  std::vector<std::vector<PlotPoint>>& out_;
  Pose X_ = Pose::Identity();
};

/// `waypoints: {points: …}` wherever a policy has them (of a gait, of both gaits of a switch), each once, m.
inline void add_plotted_waypoints(const Settings& settings, std::vector<PlotPoint>& out) {
  if (!settings.is_map()) return;
  for (const auto& [key, value] : settings.entries()) {
    if (key != "waypoints" || !value.is_map() || !value.has("points")) {
      add_plotted_waypoints(value, out);
      continue;
    }
    for (const Settings& point : value.at("points").items()) {
      const std::vector<double> xy = point.numbers(2, Quantity::length);
      const PlotPoint p = {xy[0], xy[1], 0};
      if (std::find(out.begin(), out.end(), p) == out.end()) out.push_back(p);
    }
  }
}

/// Of the nominal world, and of the policies that are named.
inline PathScene path_scene(const Scenario& scenario, const std::vector<std::string>& policies) {
  PathScene out;
  ShapeOutlines outlines(out);
  for (const Collider& one : scenario.model.colliders) {
    if (one.is_object && one.body < 0) outlines.add(one.shape, one.X_BG);
    const bool moves = one.is_object && one.body >= 0;
    if (moves && (out.movable.empty() || out.movable.back() != one.link)) out.movable.push_back(one.link);
  }
  for (const PolicySpec& policy : scenario.policies) {
    if (std::find(policies.begin(), policies.end(), policy.name) == policies.end()) continue;
    add_plotted_waypoints(policy.settings, out.waypoints);
  }
  return out;
}

}  // namespace graze
