#include "engine/model/rotation.h"

#include "engine/lanes/scalar.h"

namespace graze {

Mat3 rotation_about(const Vec3& axis, double angle) {
  // As Eigen::AngleAxis, whose sines are the C library's: R = c 1 + (1 - c) a a^T + s [a]x.
  const auto [s, c] = pinned::sin_cos(angle);
  const Vec3 sine = s * axis, rest = (1 - c) * axis;
  const double xy = rest.x() * axis.y(), xz = rest.x() * axis.z(), yz = rest.y() * axis.z();
  Mat3 R;
  R << rest.x() * axis.x() + c, xy - sine.z(), xz + sine.y(),  //
      xy + sine.z(), rest.y() * axis.y() + c, yz - sine.x(),   //
      xz - sine.y(), yz + sine.x(), rest.z() * axis.z() + c;
  return R;
}

Mat3 rotation_from_rpy(const Vec3& rpy) {
  const auto turned = [&](int k) {
    const auto [s, c] = pinned::sin_cos(rpy[k] / 2);
    const Vec3 v = s * Vec3::Unit(k);
    return Quat(c, v.x(), v.y(), v.z());
  };
  return (turned(2) * turned(1) * turned(0)).toRotationMatrix();
}

Vec3 rpy_from_rotation(const Mat3& R) {
  const double yaw = pinned::atan2(R(1, 0), R(0, 0));
  const double pitch = pinned::atan2(0 - R(2, 0), pinned::hypot(R(0, 0), R(1, 0)));  // 0 - 0 is +0
  // Roll from Rz(-yaw) R, so that what yaw misses near pitch = +-90 deg, where both turn about one axis, roll makes up.
  const auto [s, c] = pinned::sin_cos(yaw);
  const double roll = pinned::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

}  // namespace graze
