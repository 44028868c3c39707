#pragma once
// Scalar kinematics of a Model: used on the nominal model by controllers, for initial states and in tests.

#include <vector>

#include "engine/model/model.h"

namespace graze {

/// World poses of all bodies for q. `X_WB` is resized to the number of bodies.
void forward_kinematics(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& q, std::vector<Pose>& X_WB);

/// Pose of a frame (body -1: the world).
Pose frame_pose(const Model& model, const std::vector<Pose>& X_WB, int frame);

/// Pose in the world of a base that is fixed to it: the root link, or, if that is `world` itself, the first link that
/// is fixed to it. Identity for a floating base.
Pose fixed_base_pose(const Model& model);

/// Velocity of a point fixed to `body`, now at p_W (world): J * v. 3 x nv, world axes; columns off the path are zero.
Eigen::Matrix3Xd point_jacobian(const Model& model, const std::vector<Pose>& X_WB, int body, const Vec3& p_W);

/// Lowest world z of all colliders of the robot (not objects).
double lowest_point(const Model& model, const std::vector<Pose>& X_WB);

/// Of a turn by `angle` (rad) about the unit vector `axis`.
Mat3 rotation_about(const Vec3& axis, double angle);

/// R = Rz(yaw) Ry(pitch) Rx(roll), rpy = (roll, pitch, yaw), rad.
Mat3 rotation_from_rpy(const Vec3& rpy);
Vec3 rpy_from_rotation(const Mat3& R);

}  // namespace graze
