#include "engine/model/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/model/placement.h"
#include "sampling/constants.h"

namespace graze {
namespace {

/// The robot's shapes alone, fixed to the world as they stand.
Model frozen(const Model& model, const std::vector<Pose>& X_WB) {
  Model out;
  for (const Collider& collider : model.colliders) {
    if (collider.is_object) continue;
    Collider& copy = out.colliders.emplace_back(collider);
    if (collider.body >= 0) copy.X_BG = X_WB[collider.body] * collider.X_BG;
    copy.body = -1;
  }
  return out;
}

/// How far the shapes of `robot` reach along the world's axis `turned` brings to point down.
double reach(Model robot, const Quat& turned) {
  for (Collider& collider : robot.colliders) collider.X_BG = Pose(turned) * collider.X_BG;
  return -lowest_point(robot, {});
}

}  // namespace

bool is_of_robot(const Model& model, std::size_t body) {
  return model.bodies[body].type != JointType::floating || (body == 0 && model.floating_base);
}

double whole_mass(const Robot& robot) {
  double mass = 0;
  for (const Link& link : robot.links) mass += link.inertia.mass;
  return mass;
}

std::string mass_text(const Robot& robot, const Model& model) {
  const std::string whole = fmt::format("{:.4g} kg", whole_mass(robot)),
                    moving = fmt::format("{:.4g} kg", robot_mass(model));
  return whole == moving ? whole : fmt::format("{}, {} of it moving", whole, moving);
}

double robot_mass(const Model& model) {
  double mass = 0;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    if (is_of_robot(model, i)) mass += model.bodies[i].mass;
  }
  return mass;
}

double robot_weight(const Model& model) { return robot_mass(model) * model.gravity.norm(); }

Vec3 robot_extent(const Model& model, const State& state) {
  const std::vector<Pose> X_WB = place_bodies(model, state.q);
  Vec3 low = Vec3::Constant(kInfinity), high = -low;
  for (std::size_t i = 0; i < model.frames.size(); ++i) {
    const Frame& frame = model.frames[i];
    if (frame.body >= 0 && !is_of_robot(model, static_cast<std::size_t>(frame.body))) continue;
    const Vec3 p = frame_pose(model, X_WB, static_cast<int>(i)).translation();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Model robot = frozen(model, X_WB);
  for (std::size_t i = 0; robot.colliders.empty() && i < model.bodies.size(); ++i) {
    if (!is_of_robot(model, i)) continue;
    const Vec3 p = X_WB[i] * model.bodies[i].com;
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 along = Vec3::Unit(axis), down = -Vec3::UnitZ();
    const double up = reach(robot, Quat::FromTwoVectors(along, down));
    if (!std::isfinite(up)) continue;  // no shapes
    high[axis] = std::max(high[axis], up);
    low[axis] = std::min(low[axis], -reach(robot, Quat::FromTwoVectors(-along, down)));
  }
  return (high - low).cwiseMax(0.0);
}

}  // namespace graze
