#pragma once
// Eigen <-> Bullet, both in double precision, without loss.

#include <LinearMath/btTransform.h>

#include "engine/model/world.h"

namespace graze {

inline btVector3 to_bt(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 from_bt(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline btMatrix3x3 to_bt(const Mat3& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}
inline Mat3 from_bt(const btMatrix3x3& R) {
  Mat3 out;
  for (int i = 0; i < 3; ++i) out.row(i) << R[i][0], R[i][1], R[i][2];
  return out;
}

inline btQuaternion to_bt(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Quat from_bt(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

inline btTransform to_bt(const Pose& X) { return btTransform(to_bt(Mat3(X.linear())), to_bt(Vec3(X.translation()))); }
inline Pose from_bt(const btTransform& X) {
  Pose out = Pose::Identity();
  out.linear() = from_bt(X.getBasis());
  out.translation() = from_bt(X.getOrigin());
  return out;
}

}  // namespace graze
