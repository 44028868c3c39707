#pragma once
// The gap of one pair of shapes in all lanes, outside of any step: for witnesses, which want distances beyond what the
// solver looks at.

#include "engine/contact/collide.h"
#include "engine/lane_physics/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// The segment about which a sphere, capsule or cylinder lies within its radius, as half a vector.
template <class T>
inline Vec3T<T> core_of(ShapeKind kind, const ShapeT<T>& shape, const PoseT<T>& X) {
  const T half = kind == kinds::sphere ? T(0.0) : T(0.5) * shape.size.y;
  return half * X.R.column(2);
}

inline bool has_core(ShapeKind kind) {
  return kind == kinds::sphere || kind == kinds::capsule || kind == kinds::cylinder;
}

/// No more than the gap, and quick. Terrain, whose height is not known here, gets a number that says nothing.
template <class T>
inline T least_gap(ShapeKind a, const ShapeT<T>& sa, const PoseT<T>& Xa, ShapeKind b, const ShapeT<T>& sb,
                   const PoseT<T>& Xb) {
  using namespace kinds;
  if (b == plane) return dot(Xb.R.column(2), Xa.p - Xb.p) - bounding_radius(a, sa);
  if (a == heightfield || b == heightfield) return T(-1e300);
  if (has_core(a) && has_core(b)) {
    const Vec3T<T> u = core_of(a, sa, Xa), v = core_of(b, sb, Xb), w = Xa.p - Xb.p;
    const SegmentPairT<T> nearest = nearest_of_segments(w, u, v);
    return sqrt(norm2(axpy(nearest.s, u, axpy(-nearest.t, v, w)))) - sa.size.x - sb.size.x;
  }
  if (has_core(a) && b == box) {
    const SegmentInBoxT<T> segment{transposed_times(Xb.R, Xa.p - Xb.p), transposed_times(Xb.R, core_of(a, sa, Xa)),
                                   T(0.5) * sb.size};
    return nearest_on_box(segment.at(nearest_to_box(segment)), segment.h).d - sa.size.x;
  }
  return sqrt(norm2(Xa.p - Xb.p)) - bounding_radius(a, sa) - bounding_radius(b, sb);
}

template <class T>
inline ShapeT<T> shape_of(const GapQuery::Side& side) {
  return {load_vec3<T>(side.size), side.terrain};
}

/// Points as collide() has them, as rows.
template <class T>
inline void write_manifold(const ManifoldT<T>& manifold, double* rows) {
  constexpr int W = kWidth<T>;
  for (int k = 0; k < ManifoldT<T>::kMax; ++k) {
    double* slot = rows + k * kManifoldRows * W;
    if (k >= manifold.count) {
      store(slot + kRowValid * W, T(0.0));
      continue;
    }
    const ContactPointT<T>& point = manifold.point[k];
    store(slot + kRowPhi * W, point.phi);
    store(slot + kRowFeatureA * W, point.feature_a);
    store(slot + kRowFeatureB * W, point.feature_b);
    store(slot + kRowValid * W, select(point.valid, T(1.0), T(0.0)));
  }
}

template <class T>
bool measure_gap(const GapQuery& query) {
  const ShapeKind a = static_cast<ShapeKind>(query.a.kind), b = static_cast<ShapeKind>(query.b.kind);
  const ShapeT<T> sa = shape_of<T>(query.a), sb = shape_of<T>(query.b);
  const PoseT<T> Xa = load_pose<T>(query.a.pose), Xb = load_pose<T>(query.b.pose);
  const T enough = load<T>(query.enough);
  const bool a_first = rank_of(a) <= rank_of(b);
  const T bound = a_first ? least_gap(a, sa, Xa, b, sb, Xb) : least_gap(b, sb, Xb, a, sa, Xa);
  store(query.bound, bound);
  if ((query.lanes & ~bits(bound >= enough)) == 0) return false;
  ManifoldT<T> manifold;
  collide<T>(a, sa, Xa, b, sb, Xb, load<T>(query.reach), manifold);
  write_manifold(manifold, query.manifold);
  return true;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
