#pragma once
// Where everything stands while a Model is made: a robot is put on the ground, and measured, before there are dynamics
// of it. How it moves, and where its bodies are once it does, is engine/dynamics, which gives the same poses to
// rounding (tests/engine/dynamics).

#include <vector>

#include "engine/model/model.h"

namespace graze {

/// World poses of all bodies at q.
std::vector<Pose> place_bodies(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& q);

/// Pose of a frame (body -1: the world).
Pose frame_pose(const Model& model, const std::vector<Pose>& X_WB, int frame);

/// Pose in the world of a base that is fixed to it: the root link, or, if that is `world` itself, the first link that
/// is fixed to it. Identity for a floating base.
Pose fixed_base_pose(const Model& model);

/// Lowest world z of all colliders of the robot (not objects).
double lowest_point(const Model& model, const std::vector<Pose>& X_WB);

}  // namespace graze
