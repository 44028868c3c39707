#pragma once
// Terrain: solid below a surface of triangles over a regular grid (each cell is cut from its corner (x+1, y) to
// (x, y+1)); nothing lies beyond its rim. Balls touch it exactly, at up to three faces of different slope. Capsules,
// cylinders and boxes touch it with their ends, rims and corners, and it touches them with its grid points; contact of
// two edges alone is not seen, which is a matter of a fraction of the cell's height difference over their length.
// The cells under a shape differ per lane, so this part runs lane by lane.

#include "engine/contact/box.h"
#include "engine/contact/cylinder.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

using Point3 = Vec3T<double>;

/// A heightfield for one lane, in its own frame.
struct Terrain {
  const HeightView* grid;
  Point3 size;  // extents in x and y, factor of the heights

  double cell_x() const { return size.x / (grid->nx - 1); }
  double cell_y() const { return size.y / (grid->ny - 1); }
  Point3 vertex(int ix, int iy) const {
    return {ix * cell_x() - 0.5 * size.x, iy * cell_y() - 0.5 * size.y, size.z * grid->height[iy * grid->nx + ix]};
  }
};

/// Cells (or grid points) from..to, both included, that a square of half width r about x may touch.
struct CellRange {
  int x0, x1, y0, y1;
};
inline int bounded(double x, int low, int high) { return x >= high ? high : x > low ? static_cast<int>(x) : low; }
inline CellRange cells_near(const Terrain& terrain, const Point3& x, double r) {
  const double cx = 1 / terrain.cell_x(), cy = 1 / terrain.cell_y();
  const double left = (x.x + 0.5 * terrain.size.x - r) * cx, right = (x.x + 0.5 * terrain.size.x + r) * cx;
  const double low = (x.y + 0.5 * terrain.size.y - r) * cy, high = (x.y + 0.5 * terrain.size.y + r) * cy;
  const int nx = terrain.grid->nx, ny = terrain.grid->ny;
  if (!(right >= 0 && high >= 0 && left <= nx - 1 && low <= ny - 1)) return {0, -1, 0, -1};
  return {bounded(left, 0, nx - 2), bounded(right, 0, nx - 2), bounded(low, 0, ny - 2), bounded(high, 0, ny - 2)};
}

/// Whether a height z lies so far below the lowest that something may reach that no distance to it counts: by more than
/// rounding, so that what is left out would not have been taken.
inline bool out_of_reach(double z, double lowest) { return z < lowest - 1e-9 * (1 + abs(lowest)); }

/// Nearest point of a triangle to x (Ericson 2005, §5.1.5).
inline Point3 nearest_on_triangle(const Point3& x, const Point3& a, const Point3& b, const Point3& c) {
  const Point3 ab = b - a, ac = c - a, ax = x - a, bx = x - b, cx = x - c;
  const double d1 = dot(ab, ax), d2 = dot(ac, ax), d3 = dot(ab, bx), d4 = dot(ac, bx), d5 = dot(ab, cx),
               d6 = dot(ac, cx);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return axpy(d1 / (d1 - d3), ab, a);
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return axpy(d2 / (d2 - d6), ac, a);
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return axpy((d4 - d3) / ((d4 - d3) + (d5 - d6)), c - b, b);
  const double scale = 1 / (va + vb + vc);
  return axpy(vb * scale, ab, axpy(vc * scale, ac, a));
}

/// Contacts of one ball: nearest first, each at least 15 degrees from those before.
struct BallOnTerrain {
  static constexpr int kMost = 3;
  int count = 0;
  NearestT<double> found[kMost];

  void add(const NearestT<double>& candidate) {
    constexpr double kAlike = 0.966;  // cos 15 degrees
    int at = 0;
    while (at < count && found[at].d <= candidate.d) {
      if (dot(found[at].n, candidate.n) > kAlike) return;
      ++at;
    }
    // Those behind that look the same way are less near: out.
    NearestT<double> kept[kMost];
    int kept_count = 0;
    for (int i = at; i < count; ++i) {
      if (dot(found[i].n, candidate.n) <= kAlike) kept[kept_count++] = found[i];
    }
    count = at;
    if (count < kMost) found[count++] = candidate;
    for (int i = 0; i < kept_count && count < kMost; ++i) found[count++] = kept[i];
  }
};

/// Signed distance of x from the terrain, within `reach`: above, from the nearest points of the triangles; below, from
/// the plane of the triangle overhead.
inline BallOnTerrain nearest_on_terrain(const Terrain& terrain, const Point3& x, double reach) {
  BallOnTerrain out;
  const CellRange cells = cells_near(terrain, x, reach);
  BallOnTerrain above;
  bool below = false;
  for (int iy = cells.y0; iy <= cells.y1; ++iy) {
    for (int ix = cells.x0; ix <= cells.x1; ++ix) {
      const Point3 corner[4] = {terrain.vertex(ix, iy), terrain.vertex(ix + 1, iy), terrain.vertex(ix, iy + 1),
                                terrain.vertex(ix + 1, iy + 1)};
      const double highest = max(max(corner[0].z, corner[1].z), max(corner[2].z, corner[3].z));
      if (out_of_reach(highest, x.z - reach)) continue;
      // Where x stands within the cell decides which triangle is overhead.
      const double u = (x.x - corner[0].x) / terrain.cell_x(), v = (x.y - corner[0].y) / terrain.cell_y();
      const bool within = u >= 0 && u <= 1 && v >= 0 && v <= 1;
      for (int half = 0; half < 2; ++half) {
        const Point3 &a = half ? corner[3] : corner[0], &b = half ? corner[2] : corner[1],
                     &c = half ? corner[1] : corner[2];
        const Point3 upward = cross(b - a, c - a);
        const Point3 n = (1 / sqrt(norm2(upward))) * upward;
        const double height = dot(n, x - a);
        if (within && (half ? u + v >= 1 : u + v <= 1) && height <= 0) {
          below = true;
          out.add({height, n});
        }
        const Point3 apart = x - nearest_on_triangle(x, a, b, c);
        const double distance = sqrt(norm2(apart));
        if (distance <= reach) above.add({distance, distance > kNoDirection ? (1 / distance) * apart : n});
      }
    }
  }
  return below ? out : above;
}

// --- Lane by lane -------------------------------------------------------------------------------------------------

template <class T>
inline double lane_of(const T& x, int lane) {
  double value[kWidth<T>];
  store(value, x);
  return value[lane];
}
template <class T>
inline Point3 lane_of(const Vec3T<T>& v, int lane) {
  return {lane_of(v.x, lane), lane_of(v.y, lane), lane_of(v.z, lane)};
}

/// One row of results per lane, read back as packs.
template <class T>
struct LaneNearestT {
  double d[kWidth<T>], x[kWidth<T>], y[kWidth<T>], z[kWidth<T>];
  unsigned known = 0;

  void set(int lane, const NearestT<double>& nearest) {
    d[lane] = nearest.d, x[lane] = nearest.n.x, y[lane] = nearest.n.y, z[lane] = nearest.n.z;
    known |= 1u << lane;
  }
  void clear(int lane) { d[lane] = 0, x[lane] = 0, y[lane] = 0, z[lane] = 1; }
  NearestT<T> all() const { return {load<T>(d), {load<T>(x), load<T>(y), load<T>(z)}}; }
};

template <class T>
inline Terrain terrain_of(const ShapeT<T>& shape, int lane) {
  return {shape.terrain + lane, lane_of(shape.size, lane)};
}

/// `count` (up to three) slots from `slot` on for a ball of radius r at x (world).
template <class T>
inline void put_ball_on_terrain(ManifoldT<T>& out, int slot, int count, const Vec3T<T>& x, const T& r,
                                const ShapeT<T>& terrain, const PoseT<T>& X, const T& margin) {
  const Vec3T<T> local = transposed_times(X.R, x - X.p);
  LaneNearestT<T> rows[BallOnTerrain::kMost];
  for (int lane = 0; lane < kWidth<T>; ++lane) {
    const double reach = lane_of(r, lane) + max(lane_of(margin, lane), 0.0);
    const BallOnTerrain ball = nearest_on_terrain(terrain_of(terrain, lane), lane_of(local, lane), reach);
    for (int k = 0; k < count; ++k) {
      rows[k].clear(lane);
      if (k < ball.count) rows[k].set(lane, ball.found[k]);
    }
  }
  for (int k = 0; k < count; ++k) {
    put_ball<T>(out, slot + k, x, r, to_world(X, rows[k].all()), margin, mask_from_bits<T>(rows[k].known));
  }
}

template <class T>
inline void sphere_heightfield(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                               const T& margin, ManifoldT<T>& out) {
  out.count = BallOnTerrain::kMost;
  put_ball_on_terrain(out, 0, out.count, Xa.p, a.size.x, b, Xb, margin);
}

/// The signed distance of a point (shape's frame) from a capsule, cylinder or box, one lane.
inline NearestT<double> nearest_on_shape(ShapeKind kind, const Point3& size, const Point3& x) {
  if (kind == kinds::box) return nearest_on_box(x, 0.5 * size);
  if (kind == kinds::cylinder) return nearest_on_cylinder(x, size.x, 0.5 * size.y);
  const double along = clamp(x.z, -0.5 * size.y, 0.5 * size.y);
  double length;
  const Point3 n = direction(Point3{x.x, x.y, x.z - along}, Point3{1, 0, 0}, length);
  return {length - size.x, n};
}

/// The grid point that is deepest in (or nearest to) a shape of bounding radius `radius`, as a contact of the shape.
struct GridPoint {
  bool found = false;
  double phi = 0;
  Point3 x, n;  // terrain's frame; n toward the shape
};
inline GridPoint deepest_grid_point(const Terrain& terrain, ShapeKind kind, const Point3& size,
                                    const PoseT<double>& X_TS, double radius, double margin) {
  GridPoint best;
  best.phi = margin;
  const CellRange cells = cells_near(terrain, X_TS.p, radius + max(margin, 0.0));
  for (int iy = cells.y0; iy <= cells.y1 + 1; ++iy) {
    for (int ix = cells.x0; ix <= cells.x1 + 1; ++ix) {
      const Point3 x = terrain.vertex(ix, iy);
      if (out_of_reach(x.z, X_TS.p.z - radius - max(margin, 0.0))) continue;
      const NearestT<double> nearest = nearest_on_shape(kind, size, transposed_times(X_TS.R, x - X_TS.p));
      if (nearest.d < best.phi) best = {true, nearest.d, x, -(X_TS.R * nearest.n)};
    }
  }
  return best;
}

template <class T>
inline PoseT<double> lane_of(const PoseT<T>& X, int lane) {
  PoseT<double> out;
  for (int i = 0; i < 9; ++i) out.R.m[i] = lane_of(X.R.m[i], lane);
  out.p = lane_of(X.p, lane);
  return out;
}

/// Adds the deepest grid point where it is deeper than every slot, in place of the slot that is least deep.
template <class T>
inline void add_grid_point(ShapeKind kind, const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b,
                           const PoseT<T>& Xb, const T& radius, const T& margin, ManifoldT<T>& out) {
  const PoseT<T> X_TS{transposed_times(Xb.R, Xa.R), transposed_times(Xb.R, Xa.p - Xb.p)};
  LaneNearestT<T> normal;
  double px[kWidth<T>], py[kWidth<T>], pz[kWidth<T>];
  for (int lane = 0; lane < kWidth<T>; ++lane) {
    const GridPoint point = deepest_grid_point(terrain_of(b, lane), kind, lane_of(a.size, lane), lane_of(X_TS, lane),
                                               lane_of(radius, lane), lane_of(margin, lane));
    normal.clear(lane);
    px[lane] = py[lane] = pz[lane] = 0;
    if (!point.found) continue;
    normal.set(lane, {point.phi, point.n});
    px[lane] = point.x.x, py[lane] = point.x.y, pz[lane] = point.x.z;
  }
  if (normal.known == 0) return;
  const NearestT<T> at = to_world(Xb, normal.all());
  const Vec3T<T> x = Xb * Vec3T<T>{load<T>(px), load<T>(py), load<T>(pz)};
  T least(-1e300), deepest(1e300), slot(0.0);
  for (int k = 0; k < out.count; ++k) {
    const T phi = select(out.point[k].valid, out.point[k].phi, T(1e300));
    deepest = min(deepest, phi);
    const mask_of<T> further = phi > least;
    least = select(further, phi, least);
    slot = select(further, T(k), slot);
  }
  const mask_of<T> missing = mask_from_bits<T>(normal.known) & (at.d < deepest - T(kSameGap));
  for (int k = 0; k < out.count; ++k) {
    put_where<T>(out, k, missing & (slot == T(k)), at.d, axpy(T(0.5) * at.d, at.n, x), at.n);
  }
}

template <class T>
inline void capsule_heightfield(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                                const T& margin, ManifoldT<T>& out) {
  out.count = 4;
  for (int k = 0; k < 2; ++k) {
    const Vec3T<T> x = axpy((k == 0 ? T(-0.5) : T(0.5)) * a.size.y, Xa.R.column(2), Xa.p);
    put_ball_on_terrain(out, 2 * k, 2, x, a.size.x, b, Xb, margin);
  }
  add_grid_point(kinds::capsule, a, Xa, b, Xb, fma(T(0.5), a.size.y, a.size.x), margin, out);
}

template <class T>
inline void cylinder_heightfield(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                                 const T& margin, ManifoldT<T>& out) {
  out.count = 8;
  const Vec3T<T> lowest = lowest_across(Xa.R, -Xb.R.column(2));
  for (int k = 0; k < 8; ++k) put_ball_on_terrain(out, k, 1, rim_point(a, Xa, lowest, k), T(0.0), b, Xb, margin);
  add_grid_point(kinds::cylinder, a, Xa, b, Xb, fma(T(0.5), a.size.y, a.size.x), margin, out);
}

template <class T>
inline void box_heightfield(const ShapeT<T>& a, const PoseT<T>& Xa, const ShapeT<T>& b, const PoseT<T>& Xb,
                            const T& margin, ManifoldT<T>& out) {
  out.count = 8;
  const Vec3T<T> half = T(0.5) * a.size;
  for (int k = 0; k < 8; ++k) put_ball_on_terrain(out, k, 1, Xa * box_corner(half, k), T(0.0), b, Xb, margin);
  add_grid_point(kinds::box, a, Xa, b, Xb, sqrt(norm2(half)), margin, out);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
