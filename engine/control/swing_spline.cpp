#include "engine/control/swing_spline.h"

#include <algorithm>
#include <cassert>

namespace graze {

SwingSpline::SwingSpline(const std::array<Vec3, 4>& knots, const Vec3& v_start, const Vec3& v_end, double t0,
                         double duration)
    : knot_(knots), t0_(t0), duration_(duration) {
  assert(duration > 0);
  // Continuous second derivative at the inner knots: m0 + 4 m1 + m2 = 3 (x2 - x0) / h, m1 + 4 m2 + m3 = 3 (x3 - x1) /
  // h.
  const double h = duration / 3;
  const Vec3 r1 = 3 / h * (knot_[2] - knot_[0]) - v_start;
  const Vec3 r2 = 3 / h * (knot_[3] - knot_[1]) - v_end;
  slope_ = {v_start, (4 * r1 - r2) / 15, (4 * r2 - r1) / 15, v_end};
}

SwingSpline::Sample SwingSpline::at(double t) const {
  const double h = duration_ / 3;
  const double u = std::clamp(t - t0_, 0.0, duration_) / h;
  const int i = std::min(static_cast<int>(u), 2);
  const double s = u - i;
  const Vec3 rise = knot_[i + 1] - knot_[i];
  const Vec3 m0 = h * slope_[i], m1 = h * slope_[i + 1];
  const Vec3 c2 = 3 * rise - 2 * m0 - m1, c3 = m0 + m1 - 2 * rise;
  return {knot_[i] + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2 * c2 + 3 * s * c3)) / h};
}

std::array<Vec3, 4> swing_knots(const Vec3& liftoff, const Vec3& touchdown, const Vec3& up, double overshoot) {
  Vec3 step = touchdown - liftoff;
  step -= step.dot(up) / std::max(up.squaredNorm(), 1e-300) * up;  // horizontal part
  return {liftoff, liftoff + up, touchdown + up + overshoot * step, touchdown};
}

}  // namespace graze
