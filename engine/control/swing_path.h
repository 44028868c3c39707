#pragma once
// The path of a swing foot on lanes (§9.2.5, Figure 71): a cubic spline through four knots at equal intervals, with
// given velocities at both ends.

#include "engine/lanes/vec.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct SwingPath {
  Vec3T<T> knot[4], slope[4];  // m, m/s
  T start, duration;           // s

  template <class Mask>
  void replace(const Mask& where, const SwingPath& by) {
    for (int k = 0; k < 4; ++k) {
      knot[k] = select(where, by.knot[k], knot[k]);
      slope[k] = select(where, by.slope[k], slope[k]);
    }
    start = select(where, by.start, start);
    duration = select(where, by.duration, duration);
  }
};

/// Knots at t0, t0 + T/3, t0 + 2T/3, t0 + T; velocities at the first and last. Duration T > 0.
template <class T>
inline SwingPath<T> path_through(const Vec3T<T>* knot, const Vec3T<T>& v_start, const Vec3T<T>& v_end, const T& t0,
                                 const T& duration) {
  SwingPath<T> out{{knot[0], knot[1], knot[2], knot[3]}, {}, t0, duration};
  // Continuous second derivative at the inner knots: m0 + 4 m1 + m2 = 3 (x2 - x0) / h, m1 + 4 m2 + m3 = 3 (x3 - x1) /
  // h, where h = T/3.
  const T rate = T(9.0) / duration;
  const Vec3T<T> r1 = rate * (knot[2] - knot[0]) - v_start, r2 = rate * (knot[3] - knot[1]) - v_end;
  out.slope[0] = v_start;
  out.slope[1] = T(1.0 / 15) * (T(4.0) * r1 - r2);
  out.slope[2] = T(1.0 / 15) * (T(4.0) * r2 - r1);
  out.slope[3] = v_end;
  return out;
}

/// The four knots of Figure 71: liftoff, `up` above it, `up` above touchdown moved on by overshoot times the horizontal
/// step, touchdown. `up`: step height times the upward direction, m.
template <class T>
inline void swing_knots(const Vec3T<T>& liftoff, const Vec3T<T>& touchdown, const Vec3T<T>& up, double overshoot,
                        Vec3T<T>* knot) {
  Vec3T<T> step = touchdown - liftoff;
  step -= (dot(step, up) / max(norm2(up), T(1e-300))) * up;  // horizontal part
  knot[0] = liftoff;
  knot[1] = liftoff + up;
  knot[2] = axpy(T(overshoot), step, touchdown + up);
  knot[3] = touchdown;
}

/// Position and velocity at t; before and after the path, its ends.
template <class T>
inline void sample(const SwingPath<T>& path, const T& t, Vec3T<T>& x, Vec3T<T>& xd) {
  const T h = path.duration * T(1.0 / 3), per_h = T(3.0) / path.duration;
  const T u = min(max(t - path.start, T(0.0)), path.duration) * per_h;
  const mask_of<T> second = u >= T(1.0), third = u >= T(2.0);
  const T s = u - select(third, T(2.0), select(second, T(1.0), T(0.0)));
  const auto pick = [&](const Vec3T<T>* v) { return select(third, v[2], select(second, v[1], v[0])); };
  const Vec3T<T> from = pick(path.knot), rise = pick(path.knot + 1) - from;
  const Vec3T<T> m0 = h * pick(path.slope), m1 = h * pick(path.slope + 1);
  const Vec3T<T> c2 = T(3.0) * rise - (m0 + m0 + m1), c3 = m0 + m1 - (rise + rise);
  x = axpy(s, axpy(s, axpy(s, c3, c2), m0), from);
  xd = per_h * axpy(s, axpy(T(3.0) * s, c3, c2 + c2), m0);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
