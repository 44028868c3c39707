#pragma once
// The gap of one pair of shapes in all lanes, outside of any step: for witnesses, which want distances beyond what the
// solver looks at. And the bounds that tell when a gap need not be measured: from any direction follows a bound,
// because the gap of two convex bodies is the greatest separation over all directions; and a gap that was measured once
// shrinks no faster than its bodies move. Bounds may be wrong by rounding, so their readers count them less a little.

#include "engine/contact/collide.h"
#include "engine/lane_physics/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
inline void store_vec3(double* rows, const Vec3T<T>& v) {
  store(rows, v.x), store(rows + kWidth<T>, v.y), store(rows + 2 * kWidth<T>, v.z);
}

/// One of a pair, where it is.
template <class T>
struct PlacedT {
  ShapeKind kind;
  ShapeT<T> shape;
  PoseT<T> X;

  explicit PlacedT(const GapQuery::Side& side)
      : kind(static_cast<ShapeKind>(side.kind)),
        shape{load_vec3<T>(side.size), side.terrain, side.hull},
        X(load_pose<T>(side.pose)) {}

  /// A sphere, capsule or cylinder lies within its radius about a segment.
  bool has_core() const { return kind == kinds::sphere || kind == kinds::capsule || kind == kinds::cylinder; }
  /// The segment as half a vector.
  Vec3T<T> core() const {
    const T half = kind == kinds::sphere ? T(0.0) : T(0.5) * shape.size.y;
    return half * X.R.column(2);
  }
  /// How far it reaches from its origin along the unit vector n, m. Not for planes and terrain.
  T reach(const Vec3T<T>& n) const { return reach_of_shape(kind, shape, X, n); }
};

/// Separation along a unit vector from b to a: no more than the gap. b may be a plane, and n its normal.
template <class T>
inline T separation_along(const Vec3T<T>& n, const PlacedT<T>& a, const PlacedT<T>& b) {
  const T apart = dot(n, a.X.p - b.X.p) - a.reach(-n);
  return b.kind == kinds::plane ? apart : apart - b.reach(n);
}

/// A direction in which the shapes are nearly as far apart as they are: between their cores, or their origins.
template <class T>
inline Vec3T<T> direction_apart(const PlacedT<T>& a, const PlacedT<T>& b) {
  const Vec3T<T> w = a.X.p - b.X.p;
  T unused;
  if (a.has_core() && b.has_core()) {
    const Vec3T<T> u = a.core(), v = b.core();
    const SegmentPairT<T> nearest = nearest_of_segments(w, u, v);
    return direction(axpy(nearest.s, u, axpy(-nearest.t, v, w)), b.X.R.column(2), unused);
  }
  if (a.has_core() && b.kind == kinds::box) {
    const SegmentInBoxT<T> segment{transposed_times(b.X.R, w), transposed_times(b.X.R, a.core()),
                                   T(0.5) * b.shape.size};
    return b.X.R * nearest_on_box(segment.at(nearest_to_box(segment)), segment.h).n;
  }
  return direction(w, b.X.R.column(2), unused);
}

/// No more than the gap, and quick; a before b by rank_of(). First along the axis that was the best when last seen,
/// which may become another one. Terrain, whose height is not known here, gets a number that says nothing.
template <class T>
inline T bound_of_gap(const PlacedT<T>& a, const PlacedT<T>& b, const GapQuery& query) {
  if (b.kind == kinds::heightfield) return T(-1e300);
  if (b.kind == kinds::plane) return separation_along(b.X.R.column(2), a, b);
  const Vec3T<T> n_B = load_vec3<T>(query.axis);
  const T bound = separation_along(b.X.R * n_B, a, b);
  if ((query.lanes & ~bits(bound >= load<T>(query.enough))) == 0) return bound;
  const Vec3T<T> n = direction_apart(a, b);
  const T other = separation_along(n, a, b);
  const mask_of<T> better = other > bound;
  store_vec3(query.axis, select(better, transposed_times(b.X.R, n), n_B));
  return select(better, other, bound);
}

/// The direction of the least gap in `lanes` becomes the axis. R: of the shape in whose frame the axis stands; the
/// points' normals times `toward` point away from it.
template <class T>
inline void keep_axis(const ManifoldT<T>& manifold, const mask_of<T>& lanes, const RotT<T>& R, double toward,
                      double* axis) {
  T least(1e300);
  Vec3T<T> best = load_vec3<T>(axis);
  for (int k = 0; k < manifold.count; ++k) {
    const ContactPointT<T>& point = manifold.point[k];
    const mask_of<T> less = lanes & point.valid & (point.phi < least);
    least = select(less, point.phi, least);
    best = select(less, transposed_times(R, T(toward) * point.n), best);
  }
  store_vec3(axis, best);
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
unsigned measure_gap(const GapQuery& query) {
  const PlacedT<T> a(query.a), b(query.b);
  const bool a_first = rank_of(a.kind) <= rank_of(b.kind);
  const PlacedT<T>&first = a_first ? a : b, &second = a_first ? b : a;
  const T bound = bound_of_gap(first, second, query);
  store(query.bound, bound);
  const unsigned open = query.lanes & ~bits(bound >= load<T>(query.enough));
  if (open == 0) return 0;
  const mask_of<T> lanes = mask_from_bits<T>(open);
  // The other lanes ask for nothing, so that no work is done for them.
  const bool terrain = second.kind == kinds::heightfield;
  const T reach = terrain ? load<T>(query.reach) : select(lanes, load<T>(query.reach), T(-1e300));
  ManifoldT<T> manifold;
  collide<T>(a.kind, a.shape, a.X, b.kind, b.shape, b.X, reach, manifold);
  if (!terrain) keep_axis(manifold, lanes, second.X.R, a_first ? 1.0 : -1.0, query.axis);
  write_manifold(manifold, query.manifold);
  return open;
}

/// Chords of turns at 1 m: |R' - R| is |R' - R|_F / sqrt(2).
template <class T>
void add_moves(const MoveQuery& query) {
  constexpr int W = kWidth<T>;
  const mask_of<T> fresh = mask_from_bits<T>(query.fresh);
  for (int i = 0; i < query.count; ++i) {
    const double* now = query.X + 12 * W * query.body[i];
    double *last = query.last + 12 * W * i, *turn = query.turn + W * i, *way = query.way + W * i;
    T turned(0.0), gone(0.0);
    for (int k = 0; k < 12; ++k) {
      const T x = load<T>(now + k * W), d = x - load<T>(last + k * W);
      k < 9 ? turned = fma(d, d, turned) : gone = fma(d, d, gone);
      store(last + k * W, x);
    }
    store(turn, select(fresh, T(0.0), load<T>(turn) + sqrt(T(0.5) * turned)));
    store(way, select(fresh, T(0.0), load<T>(way) + sqrt(gone)));
  }
}

/// A body's points have gone no farther than its origin, and the chord of the turn at its radius.
template <class T>
void add_travel(const TravelQuery& query) {
  constexpr int W = kWidth<T>;
  T most(0.0);
  for (int i = 0; i < query.count; ++i) {
    const int row = W * query.row[i];
    double* travel = query.travel + W * (i + 1);
    const T now = fma(load<T>(query.radius + W * i), load<T>(query.turn + row), load<T>(query.way + row));
    most = max(now - load<T>(travel), most);
    store(travel, now);
  }
  store(query.most, most);
}

template <class T>
int find_due(const DueQuery& query) {
  constexpr int W = kWidth<T>;
  const T enough = load<T>(query.enough);
  T lowest(1e300);
  int count = 0;
  for (int i = 0; i < query.count; ++i) {
    const int* places = query.places + 2 * i;
    const T bound = load<T>(query.reserve + i * W) -
                    (load<T>(query.travel + places[0] * W) + load<T>(query.travel + places[1] * W));
    const unsigned due = query.lanes & ~bits(bound >= enough);
    lowest = min(select(mask_from_bits<T>(due), T(1e300), bound), lowest);
    // Without a branch, which would be guessed wrong often: what is not due is written over.
    query.due[count] = i;
    query.due_lanes[count] = due;
    count += due != 0 ? 1 : 0;
  }
  store(query.lowest, lowest);
  return count;
}

/// Products and sums are rounded one by one, as witnesses' margins in archives have been from the start.
template <class T>
void place(const double* X_WB, const double* X_BG, double* X_WG) {
  constexpr int W = kWidth<T>;
  const auto row = [](const double* X, int i) { return load<T>(X + i * W); };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      const int first = j < 3 ? j : 9, step = j < 3 ? 3 : 1;
      T sum = j < 3 ? T(0.0) : row(X_WB, 9 + i);
      for (int k = 0; k < 3; ++k) sum = sum + row(X_WB, 3 * i + k) * row(X_BG, first + step * k);
      store(X_WG + (j < 3 ? 3 * i + j : 9 + i) * W, sum);
    }
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
