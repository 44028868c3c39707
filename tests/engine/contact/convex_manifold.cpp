#include "tests/engine/contact/convex_manifold.h"

#include <algorithm>
#include <boost/container/small_vector.hpp>
#include <cmath>
#include <numbers>

#include "engine/lanes/scalar.h"

namespace graze {
namespace {

/// Sine up to which a face or edge counts as lying along the contact (3 degrees).
constexpr double kAlong = 0.05;
/// Two points nearer than this (m) are one.
constexpr double kOnePoint = 1e-6;

/// Most features have a few corners, which then need no memory of their own.
using Polygon = boost::container::small_vector<Vec3, 48>;

/// Rim of a cylinder's cap, as a polygon of 8.
Polygon cap(const Convex& cylinder, double z) {
  Polygon out;
  for (int k = 0; k < 8; ++k) {
    const double angle = k * std::numbers::pi / 4;
    out.emplace_back(cylinder.size.x() * pinned::cos(angle), cylinder.size.x() * pinned::sin(angle), z);
  }
  return out;
}

Polygon box_feature(const Vec3& half, const Vec3& n) {
  Polygon out;
  for (int corner = 0; corner < 8; ++corner) {
    bool on = true;
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      const double s = corner >> k & 1 ? 1 : -1;
      p[k] = s * half[k];
      on = on && (std::abs(n[k]) < kAlong || s * n[k] > 0);
    }
    if (on) out.push_back(p);
  }
  return out;
}

Polygon hull_feature(const Corners& corners, const Vec3& n) {
  double most = -1e300, extent = 0;
  for (const Vec3& corner : corners) {
    most = std::max(most, corner.dot(n));
    extent = std::max(extent, corner.norm());
  }
  Polygon out;
  for (const Vec3& corner : corners) {
    if (corner.dot(n) > most - 0.5 * kAlong * extent) out.push_back(corner);
  }
  return out;
}

/// Corners of the part of the surface that faces along n_W, world; unordered.
Polygon feature_along(const Convex& shape, const Vec3& n_W) {
  const Vec3 n = shape.X.linear().transpose() * n_W;
  const Vec3& s = shape.size;
  Polygon out;
  if (shape.kind == ShapeKind::box) out = box_feature(0.5 * s, n);
  if (shape.kind == ShapeKind::mesh) out = hull_feature(*shape.corners, n);
  if (shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule) {
    const double half = 0.5 * s.y(), across = pinned::hypot(n.x(), n.y());
    const double end = n.z() < 0 ? -half : half;
    if (across < kAlong && shape.kind == ShapeKind::cylinder) {
      out = cap(shape, end);
    } else if (std::abs(n.z()) < kAlong) {
      const double scale = s.x() / across;
      for (double z : {-half, half}) out.emplace_back(scale * n.x(), scale * n.y(), z);
    }
  }
  for (Vec3& p : out) p = shape.X * p;
  return out;
}

/// Two axes across n, turning with a's frame: the one of its axes that lies most across comes first.
struct Across {
  Vec3 x, y, n;

  Across(const Mat3& R, const Vec3& normal) : n(normal) {
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
      if (std::abs(R.col(k).dot(n)) < std::abs(R.col(axis).dot(n)) - 0.1) axis = k;
    }
    x = (R.col(axis) - n * n.dot(R.col(axis))).normalized();
    y = n.cross(x);
  }
  Vec3 local(const Vec3& p) const { return {x.dot(p), y.dot(p), n.dot(p)}; }
  Vec3 world(const Vec3& q) const { return q.x() * x + q.y() * y + q.z() * n; }
};

double turn(const Vec3& o, const Vec3& a, const Vec3& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

/// Convex hull of the points' x and y, counter-clockwise (Andrew's monotone chain).
Polygon outline(Polygon points) {
  const auto less = [](const Vec3& a, const Vec3& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); };
  std::sort(points.begin(), points.end(), less);
  Polygon out;
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = out.size();
    for (const Vec3& p : points) {
      while (out.size() >= start + 2 && turn(out[out.size() - 2], out.back(), p) <= kOnePoint * kOnePoint) {
        out.pop_back();
      }
      out.push_back(p);
    }
    out.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return out;
}

/// Height over the x-y plane, linear over a polygon (least squares of its corners) or along a segment.
struct Height {
  Eigen::Vector3d coefficients;  // z = c0 + c1 x + c2 y

  explicit Height(const Polygon& points) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (const Vec3& p : points) {
      const Eigen::Vector2d d = (p - mean).head<2>();
      A += d * d.transpose();
      b += d * (p.z() - mean.z());
    }
    // The smallest slope that fits: across a segment it is zero.
    const Eigen::Vector2d slope = A.completeOrthogonalDecomposition().solve(b);
    coefficients << mean.z() - slope.dot(mean.head<2>()), slope;
  }
  double at(const Vec3& p) const { return coefficients[0] + coefficients[1] * p.x() + coefficients[2] * p.y(); }
};

/// The part of `points` (a polygon or segment) to the left of from -> to (Sutherland and Hodgman).
Polygon left_of(const Polygon& points, const Vec3& from, const Vec3& to) {
  Polygon out;
  const double loose = kOnePoint * pinned::hypot(to.x() - from.x(), to.y() - from.y());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 &p = points[i], &q = points[(i + 1) % points.size()];
    const double at_p = turn(from, to, p) + loose, at_q = turn(from, to, q) + loose;
    if (at_p >= 0) out.push_back(p);
    if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) out.push_back(p + at_p / (at_p - at_q) * (q - p));
  }
  return out;
}

/// `points` within the outline `frame`; a frame of two corners is a segment, which `points` must lie along to have more
/// than a point in common.
Polygon clipped(Polygon points, const Polygon& frame) {
  if (frame.size() > 2) {
    for (std::size_t i = 0; i < frame.size(); ++i) points = left_of(points, frame[i], frame[(i + 1) % frame.size()]);
    return points;
  }
  const auto flat = [](const Vec3& v) { return Vec3(v.x(), v.y(), 0); };
  const Vec3 along = flat(frame[1] - frame[0]), own = flat(points[1] - points[0]);
  if (own.cross(along).norm() > kAlong * own.norm() * along.norm()) return {};
  const Vec3 side(-along.y(), along.x(), 0);
  points = left_of(points, frame[0], frame[0] - side);
  return left_of(points, frame[1], frame[1] + side);
}

struct Candidate {
  Vec3 q;  // across frame; z: middle between both surfaces
  double phi;
};
using Candidates = boost::container::small_vector<Candidate, 48>;

/// Common points of the features that lie on each other, none if they meet in a point.
Candidates common_points(const Convex& a, const Convex& b, const Across& across) {
  Candidates out;
  Polygon on_a = feature_along(a, -across.n), on_b = feature_along(b, across.n);
  if (on_a.size() < 2 || on_b.size() < 2) return out;
  for (Vec3& p : on_a) p = across.local(p);
  for (Vec3& p : on_b) p = across.local(p);
  const Height height_a(on_a), height_b(on_b);
  on_a = outline(on_a);
  on_b = outline(on_b);
  if (on_a.size() < 2 || on_b.size() < 2) return out;
  const bool a_first = on_a.size() <= on_b.size();
  for (const Vec3& p : a_first ? clipped(on_a, on_b) : clipped(on_b, on_a)) {
    const double za = height_a.at(p), zb = height_b.at(p);
    out.push_back({{p.x(), p.y(), 0.5 * (za + zb)}, za - zb});
  }
  return out;
}

/// Slot k gets the candidate that reaches furthest in direction k of 8; a candidate keeps its first slot only. Returns
/// the slot of the deepest.
int spread(const Candidates& candidates, const Across& across, double margin, ConvexManifold& out) {
  std::array<int, 8> taken;
  int deepest = -1, count = 0;
  for (int k = 0; k < 8; ++k) {
    const double angle = k * std::numbers::pi / 4;
    int best = -1;
    double most = -1e300;
    for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
      const double along = pinned::cos(angle) * candidates[i].q.x() + pinned::sin(angle) * candidates[i].q.y();
      if (candidates[i].phi < margin && along > most + kOnePoint) {
        most = along;
        best = i;
      }
    }
    if (best < 0 || std::find(taken.begin(), taken.begin() + count, best) != taken.begin() + count) continue;
    taken[count++] = best;
    out[k] = {true, candidates[best].phi, across.world(candidates[best].q), across.n};
    if (deepest < 0 || out[k].phi < out[deepest].phi) deepest = k;
  }
  return deepest;
}

/// The deepest point goes in with its own gap, in place of the slot that is nearest to it.
void put_deepest(const Gap& gap, double margin, int deepest, ConvexManifold& out) {
  if (gap.phi >= margin) return;
  const Vec3 p = 0.5 * (gap.p_a + gap.p_b);
  if (deepest < 0) {
    out[0] = {true, gap.phi, p, gap.n};
  } else if (gap.phi < out[deepest].phi - kSamePoint) {
    // On faces that are parallel but for the tolerance the slot's place is as good, and steadier.
    const bool elsewhere = out[deepest].phi - gap.phi > 1e-3 * (p - out[deepest].p).norm();
    out[deepest] = {true, gap.phi, elsewhere ? p : out[deepest].p, gap.n};
  }
}

}  // namespace

ConvexManifold touch_convex(const Convex& a, const Convex& b, double margin) {
  ConvexManifold out;
  constexpr double kRounding = 1e-9;  // m: where a bound decides, so would the gap
  const Gap gap = gap_between(a, b, margin + kRounding);
  if (gap.phi >= margin) return out;
  const Across across(a.X.linear(), gap.n);
  const int deepest = spread(common_points(a, b, across), across, margin, out);
  put_deepest(gap, margin, deepest, out);
  return out;
}

}  // namespace graze
