#pragma once
// A hull on the ground, one lane at a time and with Eigen: what the kernels on lanes are held against. Of the corners
// within reach those that lie furthest in eight directions of the hull's frame, each tilted from the ground by as much
// as the hull may turn, and the deepest.

#include <cmath>
#include <numbers>
#include <vector>

#include "engine/contact/heightfield.h"
#include "tests/engine/contact/convex_manifold.h"

namespace graze::testing {

/// A corner: its place between both surfaces, its gap, its normal.
struct Corner {
  Vec3 p;
  double phi;
  Vec3 n;
};

/// Axis across n that turns with R, 19.3 degrees from the one of its axes that lies most across.
inline Vec3 axis_across(const Mat3& R, const Vec3& n) {
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(R.col(k).dot(n)) < std::abs(R.col(axis).dot(n)) - 0.1) axis = k;
  }
  const Vec3 along = (R.col(axis) - n * n.dot(R.col(axis))).normalized();
  return Eigen::AngleAxisd(19.3 * std::numbers::pi / 180, n) * along;
}

/// Of a ball about the hull's origin that holds it, whatever its largest scale is the scale of.
inline double radius_of(const Convex& hull) {
  double most = 0;
  for (const Vec3& corner : *hull.corners) most = std::max(most, corner.cwiseQuotient(hull.size).norm());
  return most * hull.size.cwiseAbs().maxCoeff();
}

inline ConvexManifold spread(const std::vector<Corner>& corners, const Convex& hull, const Vec3& n, double margin) {
  const Mat3 R = hull.X.linear();
  const double radius = radius_of(hull), steep = radius / std::max(margin, 1e-6);
  const Vec3 x = axis_across(R, n), y = n.cross(x);
  ConvexManifold out;
  std::vector<int> taken;
  int deepest_slot = -1, deepest = -1;
  for (int k = 0; k < 8; ++k) {
    const Vec3 way = std::cos(k * 0.78539816339744831) * x + std::sin(k * 0.78539816339744831) * y;
    int best = -1;
    double most = -1e300;
    for (int i = 0; i < static_cast<int>(corners.size()); ++i) {
      if (corners[i].phi >= margin) continue;
      if (deepest < 0 || corners[i].phi < corners[deepest].phi) deepest = i;
      const double far = way.dot(corners[i].p) - steep * corners[i].phi;
      if (far <= most + 1e-3 * radius) continue;
      most = far;
      best = i;
    }
    if (best < 0 || std::find(taken.begin(), taken.end(), best) != taken.end()) continue;
    taken.push_back(best);
    out[k] = {true, corners[best].phi, corners[best].p, corners[best].n};
    if (deepest_slot < 0 || out[k].phi < out[deepest_slot].phi) deepest_slot = k;
  }
  if (deepest_slot < 0) return out;
  ManifoldPoint& slot = out[deepest_slot];
  const double deeper = slot.phi - corners[deepest].phi, away = (corners[deepest].p - slot.p).norm();
  if (deeper > 1e-12)
    slot = {true, corners[deepest].phi, deeper > 1e-3 * away ? corners[deepest].p : slot.p, corners[deepest].n};
  return out;
}

/// The plane is z = 0 of X.
inline ConvexManifold touch_plane(const Convex& hull, const Pose& X, double margin) {
  const Vec3 n = X.linear().col(2);
  std::vector<Corner> corners;
  for (const Vec3& corner : *hull.corners) {
    const Vec3 p = hull.X * corner;
    const double phi = n.dot(p - X.translation());
    corners.push_back({p - 0.5 * phi * n, phi, n});
  }
  return spread(corners, hull, n, margin);
}

inline ConvexManifold touch_terrain(const Convex& hull, const HeightView& grid, const Vec3& size, const Pose& X,
                                    double margin) {
  const Terrain terrain{&grid, {size.x(), size.y(), size.z()}};
  std::vector<Corner> corners;
  for (const Vec3& corner : *hull.corners) {
    const Vec3 p = hull.X * corner, x = X.inverse() * p;
    const BallOnTerrain found = nearest_on_terrain(terrain, {x.x(), x.y(), x.z()}, std::max(margin, 0.0));
    if (found.count == 0) continue;
    const NearestT<double>& nearest = found.found[0];
    const Vec3 n = X.linear() * Vec3(nearest.n.x, nearest.n.y, nearest.n.z);
    corners.push_back({p - 0.5 * nearest.d * n, nearest.d, n});
  }
  return spread(corners, hull, X.linear().col(2), margin);
}

}  // namespace graze::testing
