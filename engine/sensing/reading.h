#pragma once
// Readings on lanes: true value plus error, roll, pitch and yaw, forces on links. Inactive lanes keep what they had.

#include "engine/lanes/arc.h"
#include "engine/lanes/trig.h"
#include "engine/sensing/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// out = value in the active lanes.
template <class T>
inline void store_active(const mask_of<T>& active, const T& value, double* out) {
  store(out, select(active, value, load<T>(out)));
}

/// Roll, pitch, yaw of the rotation of a unit quaternion w, x, y, z, R = Rz Ry Rx, as rpy_from_rotation().
template <class T>
inline void roll_pitch_yaw(const T& w, const T& x, const T& y, const T& z, T (&rpy)[3]) {
  const T R00 = T(1.0) - T(2.0) * fma(y, y, z * z), R10 = T(2.0) * fma(x, y, w * z);
  const T R20 = T(2.0) * (x * z - w * y);
  const T R01 = T(2.0) * (x * y - w * z), R11 = T(1.0) - T(2.0) * fma(x, x, z * z);
  const T R02 = T(2.0) * fma(x, z, w * y), R12 = T(2.0) * (y * z - w * x);
  rpy[2] = atan2(R10, R00);
  rpy[1] = atan2(T(0.0) - R20, sqrt(fma(R00, R00, R10 * R10)));  // 0 - 0 is +0
  // Roll from Rz(-yaw) R, so that what yaw misses near pitch = +-90 deg, where both turn about one axis, roll makes up.
  T s, c;
  sin_cos(rpy[2], s, c);
  rpy[0] = atan2(s * R02 - c * R12, c * R11 - s * R01);
}

template <class T>
inline void read_attitude(const ReadingView& view, const mask_of<T>& active) {
  constexpr int W = kWidth<T>;
  const auto q = [&](int i) { return load<T>(view.quaternion + i * W); };
  T rpy[3];
  roll_pitch_yaw(q(0), q(1), q(2), q(3), rpy);
  for (int i = 0; i < 3; ++i) {
    store_active(active, rpy[i] + load<T>(view.rpy_error + i * W), view.rpy + i * W);
  }
}

template <class T>
inline void read_forces(const ReadingView& view, const mask_of<T>& active) {
  constexpr int W = kWidth<T>;
  for (int f = 0; f < view.frame_count; ++f) store_active(active, T(0.0), view.link_force + f * W);
  for (int i = 0; i < view.force_count; ++i) {
    const LinkForce& share = view.forces[i];
    double* force = view.link_force + share.frame * W;
    const T sum = load<T>(force) + load<T>(share.impulse) / T(view.h);
    store_active(mask_from_bits<T>(share.lanes & view.active), sum, force);
  }
}

template <class T>
void read_sensors(const ReadingView& view) {
  constexpr int W = kWidth<T>;
  const auto active = mask_from_bits<T>(view.active);
  for (int i = 0; i < view.reading_count; ++i) {
    const Reading& reading = view.readings[i];
    const T value = load<T>(view.source[reading.source] + reading.source_row * W);
    const T error = load<T>(view.error + reading.error_row * W);
    store_active(active, value + error, view.out[reading.group] + reading.row * W);
  }
  if (view.quaternion != nullptr) read_attitude<T>(view, active);
  if (view.frame_count > 0) read_forces<T>(view, active);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
