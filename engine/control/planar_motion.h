#pragma once
// Motion of a base at a constant command, on lanes.

#include "engine/lanes/trig.h"
#include "engine/lanes/vec.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Velocity of the base in its own level frame: linear (m/s) and angular (rad/s).
template <class T>
struct BaseCommandT {
  Vec3T<T> v, w;
};

/// Planar pose of a frame that moves with a constant command for a while from the origin: an exact arc.
template <class T>
struct PlanarPoseT {
  T x, y, yaw;

  Vec3T<T> transform(const Vec3T<T>& p) const {
    T s, c;
    sin_cos(yaw, s, c);
    return {x + fnma(s, p.y, c * p.x), y + fma(c, p.y, s * p.x), p.z};
  }
};

template <class T>
inline PlanarPoseT<T> predict(const BaseCommandT<T>& command, double duration) {
  const T yaw = command.w.z * T(duration);
  T s, c;
  sin_cos(yaw, s, c);
  // Integral of R(w s) v over s: (sin yaw / yaw, (1 - cos yaw) / yaw) times the distance; series for small angles.
  const auto small = abs(yaw) < T(1e-6);
  const T divisor = select(small, T(1.0), yaw);
  const T a = select(small, T(1.0) - yaw * yaw * T(1.0 / 6), s / divisor);
  const T b = select(small, T(0.5) * yaw, (T(1.0) - c) / divisor);
  const T dx = command.v.x * T(duration), dy = command.v.y * T(duration);
  return {fnma(b, dy, a * dx), fma(a, dy, b * dx), yaw};
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
