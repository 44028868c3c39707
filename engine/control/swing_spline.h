#pragma once
// The path of a swing foot (§9.2.5, Figure 71): a cubic spline through four knots at equal intervals, with given
// velocities at both ends.

#include <array>

#include "engine/model/world.h"

namespace graze {

class SwingSpline {
 public:
  SwingSpline() = default;
  /// Knots (m) at t0, t0 + T/3, t0 + 2T/3, t0 + T; velocities (m/s) at the first and last. T > 0.
  SwingSpline(const std::array<Vec3, 4>& knots, const Vec3& v_start, const Vec3& v_end, double t0, double duration);

  struct Sample {
    Vec3 x, xd;
  };
  /// Position and velocity at t; before and after the spline, its ends.
  Sample at(double t) const;

  double start_time() const { return t0_; }
  double duration() const { return duration_; }
  const Vec3& start() const { return knot_[0]; }
  const Vec3& start_velocity() const { return slope_[0]; }

 private:
  std::array<Vec3, 4> knot_{}, slope_{};
  double t0_ = 0, duration_ = 1;
};

/// The four knots of Figure 71: liftoff, `up` above it, `up` above touchdown moved on by overshoot times the horizontal
/// step, touchdown. `up`: step height times the upward direction, m.
std::array<Vec3, 4> swing_knots(const Vec3& liftoff, const Vec3& touchdown, const Vec3& up, double overshoot);

}  // namespace graze
