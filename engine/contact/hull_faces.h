#pragma once
// Where two convex shapes lie on each other, on lanes. Of each the corners that lie furthest in eight directions, which
// are those of the contact's normal, tilted by what the shapes may turn within the step: of a face that lies along the
// contact its outline, of an edge both ends, else one corner eight times. Then each outline's edges are clipped to the
// other outline.

#include "engine/contact/box.h"
#include "engine/contact/core.h"
#include "engine/contact/hull_ground.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Slope up to which a face or edge counts as lying along the contact, at most (3 degrees).
inline constexpr double kAlongContact = 0.05;
inline constexpr int kOutlineWays = 8;

/// A contact's own frame: z is its normal, from b to a.
template <class T>
struct TouchFrameT {
  Vec3T<T> x, y, n, origin;
  T slope;           // up to which a face or edge lies along the contact: what is steeper is out of reach
  mask_of<T> lanes;  // that want it

  Vec3T<T> local(const Vec3T<T>& p) const {
    const Vec3T<T> from = p - origin;
    return {dot(x, from), dot(y, from), dot(n, from)};
  }
  Vec3T<T> world(const T& px, const T& py, const T& pz) const { return axpy(px, x, axpy(py, y, axpy(pz, n, origin))); }
};

/// Number k of 8, counter-clockwise about z.
template <class T>
inline T along_way(int k, const T& x, const T& y) {
  constexpr double kDiagonal = 0.70710678118654752;
  const T half = k & 1 ? T(kDiagonal) * (k & 2 ? y - x : x + y) : k & 2 ? y : x;
  return k & 4 ? -half : half;
}

/// Corners of the part of the surface that faces along the contact, counter-clockwise about z, contact's frame. Corners
/// repeat where it has fewer than eight.
template <class T>
struct OutlineT {
  Vec3T<T> q[kOutlineWays];
};

/// Of a box or hull. `toward`: 1 or -1, the other shape lies that way along n.
template <class T, class Corner>
inline OutlineT<T> outline_of_corners(const CoreT<T>& core, int count, const T& radius, const Corner& corner,
                                      const TouchFrameT<T>& frame, double toward) {
  const RotT<T>& R = core.X.R;
  const Vec3T<T> x = transposed_times(R, frame.x), y = transposed_times(R, frame.y), n = transposed_times(R, frame.n);
  const Vec3T<T> from = frame.local(core.X.p);
  const Vec3T<T> first = frame.local(core.support(T(toward) * frame.n, frame.lanes));
  OutlineT<T> out;
  T most[kOutlineWays];
  for (int k = 0; k < kOutlineWays; ++k) {
    out.q[k] = first;
    most[k] = fma(frame.slope, along_way(k, first.x, first.y), T(toward) * first.z);
  }
  // What lies so far back is not chosen, even from the other end of the shape.
  const T back = fma(T(-2.2) * frame.slope, radius, T(toward) * first.z);
  for (int i = 0; i < count; ++i) {
    const Vec3T<T> c = corner(i);
    const T z = dot_add(n, c, from.z);
    if (!any(frame.lanes & (T(toward) * z > back))) continue;
    const Vec3T<T> q{dot_add(x, c, from.x), dot_add(y, c, from.y), z};
    for (int k = 0; k < kOutlineWays; ++k) {
      const T along = fma(frame.slope, along_way(k, q.x, q.y), T(toward) * z);
      constexpr double kClearly = 1e-12;  // m, so that rounding does not choose
      const mask_of<T> further = along > most[k] + T(kClearly);
      most[k] = select(further, along, most[k]);
      out.q[k] = select(further, q, out.q[k]);
    }
  }
  return out;
}

/// Of a sphere, capsule or cylinder: the rim of the cap, the ends of the side, or a point.
template <class T>
inline OutlineT<T> outline_of_round(const CoreT<T>& core, const TouchFrameT<T>& frame, double toward) {
  const RotT<T>& R = core.X.R;
  const Vec3T<T> out_W = T(toward) * frame.n, n = transposed_times(R, out_W), s = core.shape.size;
  const Vec3T<T> point = axpy(core.rounding(), out_W, core.support(out_W, frame.lanes));
  const Vec3T<T> x = transposed_times(R, frame.x), y = transposed_times(R, frame.y);
  const T across = sqrt(fma(n.x, n.x, n.y * n.y)), half = T(0.5) * s.y;
  const bool cylinder = core.kind == kinds::cylinder, sphere = core.kind == kinds::sphere;
  const mask_of<T> on_cap = cylinder ? across < frame.slope : no_lane<T>();
  const mask_of<T> on_side = sphere ? no_lane<T>() : abs(n.z) < frame.slope;
  const Vec3T<T> middle = axpy(-(half * sign(n.z)), R.column(2), point);  // of the side's line
  OutlineT<T> out;
  for (int k = 0; k < kOutlineWays; ++k) {
    const Vec3T<T> way{along_way(k, x.x, y.x), along_way(k, x.y, y.y), along_way(k, x.z, y.z)};
    const T scale = s.x / sqrt(max(fma(way.x, way.x, way.y * way.y), T(1e-150)));
    const Vec3T<T> rim = core.X * Vec3T<T>{scale * way.x, scale * way.y, half * sign(n.z)};
    const Vec3T<T> end = axpy(half * sign(way.z), R.column(2), middle);
    out.q[k] = frame.local(select(on_cap, rim, select(on_side, end, point)));
  }
  return out;
}

template <class T>
inline OutlineT<T> outline_of(const CoreT<T>& core, const TouchFrameT<T>& frame, double toward) {
  const Vec3T<T>& s = core.shape.size;
  if (core.kind == kinds::mesh) {
    return outline_of_corners(
        core, core.shape.hull->count, core.radius(), [&](int k) { return hull_corner(core.shape, k); }, frame, toward);
  }
  if (core.kind != kinds::box) return outline_of_round(core, frame, toward);
  const Vec3T<T> half = T(0.5) * s;
  return outline_of_corners(
      core, 8, core.radius(), [&](int k) { return box_corner(half, k); }, frame, toward);
}

/// z over x and y, linear: least squares of an outline's corners, along a segment level across it.
template <class T>
struct HeightT {
  T z, by_x, by_y;

  explicit HeightT(const OutlineT<T>& outline) {
    Vec3T<T> mean{T(0.0), T(0.0), T(0.0)};
    for (const Vec3T<T>& q : outline.q) mean += T(1.0 / kOutlineWays) * q;
    T xx(0.0), xy(0.0), yy(0.0), xz(0.0), yz(0.0);
    for (const Vec3T<T>& q : outline.q) {
      const Vec3T<T> d = q - mean;
      xx = fma(d.x, d.x, xx), xy = fma(d.x, d.y, xy), yy = fma(d.y, d.y, yy);
      xz = fma(d.x, d.z, xz), yz = fma(d.y, d.z, yz);
    }
    constexpr double kFlat = 1e-6;  // width over length, squared: less is a segment, whose matrix has rank 1
    const T trace = xx + yy, det = fma(xx, yy, -(xy * xy));
    const mask_of<T> wide = det > T(kFlat) * trace * trace, some = trace > T(1e-18);
    const T inverse = recip(select(wide, det, select(some, trace * trace, T(1.0))));
    const T scale = select(some, inverse, T(0.0));
    by_x = scale * select(wide, fma(yy, xz, -(xy * yz)), fma(xx, xz, xy * yz));
    by_y = scale * select(wide, fma(xx, yz, -(xy * xz)), fma(xy, xz, yy * yz));
    z = fnma(by_x, mean.x, fnma(by_y, mean.y, mean.z));
  }
  T at(const T& x, const T& y) const { return fma(by_x, x, fma(by_y, y, z)); }
};

/// The inside of an outline as half planes m_x x + m_y y <= bound: of its edges, and of how far it reaches in eight
/// directions, which bounds segments and points, too.
template <class T>
struct InsideT {
  static constexpr int kPlanes = 2 * kOutlineWays;
  T mx[kPlanes], my[kPlanes], bound[kPlanes];

  explicit InsideT(const OutlineT<T>& outline) {
    constexpr double kLoose = 1e-8;  // m, so much outside still counts as on the edge
    for (int k = 0; k < kOutlineWays; ++k) {
      const Vec3T<T>&from = outline.q[k], &to = outline.q[(k + 1) % kOutlineWays];
      const T ex = to.x - from.x, ey = to.y - from.y, length = sqrt(fma(ex, ex, ey * ey));
      const T scale = recip(max(length, T(kNoDirection)));
      mx[k] = scale * ey, my[k] = -(scale * ex);
      bound[k] = fma(mx[k], from.x, fma(my[k], from.y, T(kLoose)));
      const int r = k + kOutlineWays;
      mx[r] = along_way(k, T(1.0), T(0.0)), my[r] = along_way(k, T(0.0), T(1.0));
      T most(-1e300);
      for (const Vec3T<T>& q : outline.q) most = max(fma(mx[r], q.x, my[r] * q.y), most);
      bound[r] = most + T(kLoose);
    }
  }

  /// The part of a segment that lies inside, as parameters; none where low > high.
  void clip(const Vec3T<T>& from, const Vec3T<T>& to, T& low, T& high) const {
    low = T(0.0), high = T(1.0);
    for (int k = 0; k < kPlanes; ++k) {
      const T f = fma(mx[k], from.x, fma(my[k], from.y, -bound[k]));
      const T g = fma(mx[k], to.x, fma(my[k], to.y, -bound[k]));
      const mask_of<T> out_at_f = f > T(0.0), out_at_g = g > T(0.0);
      const T t = f / (f - g);
      low = select(out_at_f, select(out_at_g, T(2.0), max(t, low)), low);
      high = select(out_at_g & !out_at_f, min(t, high), high);
    }
  }
};

/// Points that both outlines have in common, nearer than the margin, shown to `spread`.
template <class T>
class CommonPointsT {
 public:
  /// `gap`: of the shapes, along the contact's normal: no point has less.
  CommonPointsT(const OutlineT<T>& a, const OutlineT<T>& b, const TouchFrameT<T>& frame, const T& gap, const T& margin)
      : height_a_(a), height_b_(b), frame_(frame), gap_(gap), margin_(margin) {}

  /// Edges of one outline within the other. Points are numbered from `number` on.
  void show_edges(const OutlineT<T>& edges, const InsideT<T>& inside, int number, SpreadT<T>& spread) const {
    for (int k = 0; k < kOutlineWays; ++k) {
      const Vec3T<T>&from = edges.q[k], &to = edges.q[(k + 1) % kOutlineWays];
      T low, high;
      inside.clip(from, to, low, high);
      const mask_of<T> some = low <= high;
      if (!any(some)) continue;
      const Vec3T<T> way = to - from;
      show(number + 2 * k, some, axpy(low, way, from), spread);
      show(number + 2 * k + 1, some & (high < T(1.0)), axpy(high, way, from), spread);
    }
  }

 private:
  void show(int number, const mask_of<T>& some, const Vec3T<T>& q, SpreadT<T>& spread) const {
    const T z_a = height_a_.at(q.x, q.y), z_b = height_b_.at(q.x, q.y), phi = max(z_a - z_b, gap_);
    const mask_of<T> near = some & (phi < margin_);
    if (any(near)) spread.show(number, near, phi, frame_.world(q.x, q.y, T(0.5) * (z_a + z_b)), frame_.n);
  }

  HeightT<T> height_a_, height_b_;
  const TouchFrameT<T>& frame_;
  const T &gap_, &margin_;
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
