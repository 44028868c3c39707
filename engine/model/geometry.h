#pragma once
// Vectors, rotations and poses. Names say in which frame: p_W is a point in world coordinates, R_WB turns from body
// to world.

#include <Eigen/Geometry>

namespace graze {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;
using Pose = Eigen::Isometry3d;  // X_AB: pose of frame B in frame A

}  // namespace graze
