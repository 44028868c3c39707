#pragma once
// Chooses the kernel for a pair of shapes and names the features that touch.
//
//              plane  sphere  capsule  cylinder  box  heightfield
//   sphere       1      1        1        1       1       3         slots of the manifold
//   capsule      2      1        2        2       2       4
//   cylinder     8      1        2        8       8       8
//   box          8      1        2        8       8       8
//   mesh         8      8        8        8       8       8        and 8 with another one
//
// Meshes are convex hulls. Planes and heightfields never touch each other.

#include "engine/contact/box_box.h"
#include "engine/contact/capsule.h"
#include "engine/contact/cylinder_box.h"
#include "engine/contact/cylinder_cylinder.h"
#include "engine/contact/hull_ground.h"
#include "engine/contact/hull_pair.h"

namespace graze {

inline namespace GRAZE_ISA_NAMESPACE {

/// As feature_of (features.h), for a point in the shape's frame.
template <class T>
inline T box_feature(const Vec3T<T>& size, const Vec3T<T>& p) {
  const T tolerance(1e-4), one(1.0), zero(0.0);
  const T x = abs(fma(T(0.5), size.x, -abs(p.x))), y = abs(fma(T(0.5), size.y, -abs(p.y)));
  const T z = abs(fma(T(0.5), size.z, -abs(p.z)));
  const T faces =
      select(x <= tolerance, one, zero) + select(y <= tolerance, one, zero) + select(z <= tolerance, one, zero);
  const mask_of<T> on_cap = (z < x) & (z < y);
  const T face = select(on_cap, select(p.z > zero, T(features::top), T(features::bottom)), T(features::side));
  return select(faces > T(2.5), T(features::vertex), select(faces > T(1.5), T(features::edge), face));
}

template <class T>
inline T cylinder_feature(const Vec3T<T>& size, const Vec3T<T>& p) {
  const T tolerance(1e-4);
  const T side = abs(sqrt(fma(p.x, p.x, p.y * p.y)) - size.x), cap = abs(fma(T(0.5), size.y, -abs(p.z)));
  const mask_of<T> rim = (side <= tolerance) & (cap <= tolerance);
  return select(rim, T(features::rim), select(cap < side, T(features::cap), T(features::side)));
}

/// Feature of the shape's surface point x (world).
template <class T>
inline T feature_at(ShapeKind kind, const ShapeT<T>& shape, const PoseT<T>& X, const Vec3T<T>& x) {
  if (kind != kinds::box && kind != kinds::cylinder) return T(features::surface);
  const Vec3T<T> local = transposed_times(X.R, x - X.p);
  return kind == kinds::box ? box_feature(shape.size, local) : cylinder_feature(shape.size, local);
}

/// Features of all points.
template <class T>
inline void name_features(ShapeKind a, const ShapeT<T>& sa, const PoseT<T>& Xa, ShapeKind b, const ShapeT<T>& sb,
                          const PoseT<T>& Xb, ManifoldT<T>& manifold) {
  for (int k = 0; k < manifold.count; ++k) {
    ContactPointT<T>& point = manifold.point[k];
    point.feature_a = point.feature_b = T(features::surface);
    if (!any(point.valid)) continue;
    const T half = T(0.5) * point.phi;
    point.feature_a = feature_at(a, sa, Xa, axpy(half, point.n, point.p));
    point.feature_b = feature_at(b, sb, Xb, axpy(-half, point.n, point.p));
  }
}

/// Place of a shape in the kernels' names: the first of a pair has the lower one.
constexpr int rank_of(ShapeKind kind) {
  using namespace kinds;
  return kind == sphere     ? 0
         : kind == capsule  ? 1
         : kind == cylinder ? 2
         : kind == box      ? 3
         : kind == mesh     ? 4
         : kind == plane    ? 5
                            : 6;
}

/// The kernels with a sphere or capsule first.
template <class T>
inline void collide_round(ShapeKind a, const ShapeT<T>& sa, const PoseT<T>& Xa, ShapeKind b, const ShapeT<T>& sb,
                          const PoseT<T>& Xb, const T& margin, ManifoldT<T>& out) {
  using namespace kinds;
  if (a == sphere) {
    if (b == plane) return sphere_plane(sa, Xa, Xb, margin, out);
    if (b == sphere) return sphere_sphere(sa, Xa, sb, Xb, margin, out);
    if (b == capsule) return sphere_capsule(sa, Xa, sb, Xb, margin, out);
    if (b == cylinder) return sphere_cylinder(sa, Xa, sb, Xb, margin, out);
    if (b == box) return sphere_box(sa, Xa, sb, Xb, margin, out);
    return sphere_heightfield(sa, Xa, sb, Xb, margin, out);
  }
  if (b == plane) return capsule_plane(sa, Xa, Xb, margin, out);
  if (b == capsule) return capsule_capsule(sa, Xa, sb, Xb, margin, out);
  if (b == cylinder) return capsule_cylinder(sa, Xa, sb, Xb, margin, out);
  if (b == box) return capsule_box(sa, Xa, sb, Xb, margin, out);
  return capsule_heightfield(sa, Xa, sb, Xb, margin, out);
}

/// Whether the pair is one of a hull and another convex shape: then collide() sets the manifold's axis, and lanes whose
/// margin is -1e300 take no time.
constexpr bool is_hull_pair(ShapeKind a, ShapeKind b) {
  const bool ground = rank_of(a) >= rank_of(kinds::plane) || rank_of(b) >= rank_of(kinds::plane);
  return (a == kinds::mesh || b == kinds::mesh) && !ground;
}

/// Points of a and b nearer than `margin` (m, per lane).
template <class T>
inline void collide(ShapeKind a, const ShapeT<T>& sa, const PoseT<T>& Xa, ShapeKind b, const ShapeT<T>& sb,
                    const PoseT<T>& Xb, T margin, ManifoldT<T>& out) {
  using namespace kinds;
  out.count = 0;
  if (rank_of(a) > rank_of(b)) {
    collide<T>(b, sb, Xb, a, sa, Xa, margin, out);
    exchange(out);
    return;
  }
  if (rank_of(a) >= rank_of(plane)) return;
  if (b == mesh) {
    hull_pair(a, sa, Xa, sb, Xb, margin, out);
  } else if (rank_of(a) <= rank_of(capsule)) {
    collide_round(a, sa, Xa, b, sb, Xb, margin, out);
  } else if (a == mesh) {
    b == plane ? hull_plane(sa, Xa, Xb, margin, out) : hull_heightfield(sa, Xa, sb, Xb, margin, out);
  } else if (b == plane) {
    a == box ? box_plane(sa, Xa, Xb, margin, out) : cylinder_plane(sa, Xa, Xb, margin, out);
  } else if (b == heightfield) {
    a == box ? box_heightfield(sa, Xa, sb, Xb, margin, out) : cylinder_heightfield(sa, Xa, sb, Xb, margin, out);
  } else if (a == box) {
    box_box(sa, Xa, sb, Xb, margin, out);
  } else {
    b == box ? cylinder_box(sa, Xa, sb, Xb, margin, out) : cylinder_cylinder(sa, Xa, sb, Xb, margin, out);
  }
  name_features(a, sa, Xa, b, sb, Xb, out);
}

/// Radius of a ball about the shape's origin that holds it, m; infinite for planes and heightfields.
template <class T>
inline T bounding_radius(ShapeKind kind, const ShapeT<T>& shape) {
  if (rank_of(kind) >= rank_of(kinds::plane)) return T(1e300);
  return kind == kinds::mesh ? radius_of_hull(shape) : radius_of_shape(kind, shape);
}

/// Lanes in which two shapes of these bounding radii may be nearer than `margin`. A plane counts by its half space.
template <class T>
inline mask_of<T> may_touch(ShapeKind a, const T& radius_a, const PoseT<T>& Xa, ShapeKind b, const T& radius_b,
                            const PoseT<T>& Xb, const T& margin) {
  const Vec3T<T> apart = Xa.p - Xb.p;
  if (b == kinds::plane) return !(dot(Xb.R.column(2), apart) >= radius_a + margin);
  if (a == kinds::plane) return !(-dot(Xa.R.column(2), apart) >= radius_b + margin);
  const T reach = radius_a + radius_b + margin;
  return !(sqrt(norm2(apart)) >= reach);
}

/// A manifold in memory: `rows` is [slot][ManifoldRow][lane].
enum ManifoldRow : int {
  kRowPhi = 0,
  kRowPoint = 1,   // 3
  kRowNormal = 4,  // 3
  kRowFeatureA = 7,
  kRowFeatureB = 8,
  kRowValid = 9,  // 1 or 0
  kManifoldRows = 10
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
