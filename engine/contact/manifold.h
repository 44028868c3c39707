#pragma once
// Contact geometry on lanes: where two shapes touch or come near. The kernels (sphere.h, capsule.h, cylinder.h, box.h,
// box_box.h, heightfield.h; chosen in collide.h) take two shapes with their poses and give a manifold: up to eight
// points with signed gap, normal and features. They have no memory: a manifold depends on the poses alone. They are
// branch-free per lane, so that T = double and every lane of a Pack get the same bits.

#include "engine/lanes/vec.h"

namespace graze {

enum class ShapeKind;  // engine/model/world.h, which kernels may not include; collide_checks.cpp compares the numbers
namespace kinds {
inline constexpr ShapeKind box = ShapeKind(0), sphere = ShapeKind(1), cylinder = ShapeKind(2), capsule = ShapeKind(3);
inline constexpr ShapeKind mesh = ShapeKind(4), plane = ShapeKind(5), heightfield = ShapeKind(6);
}  // namespace kinds

/// Numbers of Feature (contact_record.h).
namespace features {
inline constexpr double surface = 0, top = 1, bottom = 2, side = 3, edge = 4, vertex = 5, cap = 6, rim = 7;
}  // namespace features

/// HeightGrid without its containers. Extent and height factor are in Shape::size.
struct HeightView {
  int nx, ny;
  const double* height;  // [iy][ix]
};

/// Hull without its containers, in a frame at its centre, before Shape::size. One for all lanes; sizes differ by lane.
struct HullView {
  static constexpr int kSide = 8;  // corners that are looked at side by side
  int count;
  const double *x, *y, *z;  // corners, m; filled up with the first one to a multiple of kSide
  double radius;            // of a ball about the centre that holds them, m
};

inline namespace GRAZE_ISA_NAMESPACE {

/// A shape: `size` as Shape::size, per lane.
template <class T>
struct ShapeT {
  Vec3T<T> size;
  const HeightView* terrain = nullptr;  // heightfields only: one for each lane
  const HullView* hull = nullptr;       // meshes only; the shape's frame is at the hull's centre
};

template <class T>
struct ContactPointT {
  T phi;                   // signed gap, m; negative: penetration
  Vec3T<T> p;              // world, m, in the middle between both surfaces
  Vec3T<T> n;              // world, unit, from b to a
  T feature_a, feature_b;  // see features
  mask_of<T> valid;        // phi < margin, and the slot is in use
};

/// Slot k means the same part of the shapes from step to step wherever the geometry allows it (warm starts go by slot).
template <class T>
struct ManifoldT {
  static constexpr int kMax = 8;
  int count = 0;  // slots that this pair of shapes uses, the same in all lanes
  ContactPointT<T> point[kMax];
  Vec3T<T> axis{T(0.0), T(0.0), T(0.0)};  // pairs of hulls: a unit vector from b to a (world) along which they are
                                          // apart where they have no points
};

// --- For the kernels ---------------------------------------------------------------------------------------------

/// Below this length (m) a difference of points has no direction.
inline constexpr double kNoDirection = 1e-12;
/// Cosine up to which a normal counts as a face's: then the manifold has the points that span the face contact.
inline constexpr double kFaceCosine = 0.999;
/// Two ways out of an overlap that differ by less (m) are the same: the first in a fixed order is taken.
inline constexpr double kSameGap = 1e-9;
/// Two gaps that differ by less (m) are those of the same point.
inline constexpr double kSamePoint = 1e-12;

template <class T>
inline T clamp(const T& x, const T& low, const T& high) {
  return min(max(x, low), high);
}
/// 1 or -1; 1 for zero.
template <class T>
inline T sign(const T& x) {
  return select(x < T(0.0), T(-1.0), T(1.0));
}
/// x without values too small to divide by.
template <class T>
inline T divisor(const T& x) {
  return select(abs(x) < T(1e-150), T(1e-150), x);
}

/// v / |v|, or `otherwise` where v has no direction. `length` is |v|.
template <class T>
inline Vec3T<T> direction(const Vec3T<T>& v, const Vec3T<T>& otherwise, T& length) {
  length = sqrt(norm2(v));
  const auto known = length > T(kNoDirection);
  return select(known, recip(select(known, length, T(1.0))) * v, otherwise);
}

/// Fills slot k of a manifold. `p` lies in the middle between the surfaces.
template <class T>
inline void put(ManifoldT<T>& out, int k, const T& phi, const Vec3T<T>& p, const Vec3T<T>& n, const mask_of<T>& valid) {
  ContactPointT<T>& point = out.point[k];
  point.phi = phi;
  point.p = p;
  point.n = n;
  point.valid = valid;
}
template <class T>
inline void put_where(ManifoldT<T>& out, int k, const mask_of<T>& where, const T& phi, const Vec3T<T>& p,
                      const Vec3T<T>& n) {
  ContactPointT<T>& point = out.point[k];
  point.phi = select(where, phi, point.phi);
  point.p = select(where, p, point.p);
  point.n = select(where, n, point.n);
  point.valid = point.valid | where;
}

/// The manifold of (b, a) as one of (a, b).
template <class T>
inline void exchange(ManifoldT<T>& manifold) {
  for (int k = 0; k < manifold.count; ++k) {
    ContactPointT<T>& point = manifold.point[k];
    point.n = -point.n;
    const T feature = point.feature_a;
    point.feature_a = point.feature_b;
    point.feature_b = feature;
  }
  manifold.axis = -manifold.axis;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
