#pragma once
// Rotations by angles, by sines that are the same everywhere (engine/lanes/scalar.h).

#include "engine/model/geometry.h"

namespace graze {

/// Of a turn by `angle` (rad) about the unit vector `axis`.
Mat3 rotation_about(const Vec3& axis, double angle);

/// R = Rz(yaw) Ry(pitch) Rx(roll), rpy = (roll, pitch, yaw), rad.
Mat3 rotation_from_rpy(const Vec3& rpy);
Vec3 rpy_from_rotation(const Mat3& R);

}  // namespace graze
