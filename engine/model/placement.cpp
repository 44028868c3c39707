#include "engine/model/placement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/lanes/scalar.h"
#include "engine/model/rotation.h"

namespace graze {

namespace {

Pose joint_motion(const Body& body, const Eigen::Ref<const Eigen::VectorXd>& q) {
  Pose X = Pose::Identity();
  switch (body.type) {
    case JointType::revolute:
      X.linear() = rotation_about(body.axis, q[body.q]);
      break;
    case JointType::prismatic:
      X.translation() = q[body.q] * body.axis;
      break;
    case JointType::floating:
      X.linear() = Quat(q[body.q], q[body.q + 1], q[body.q + 2], q[body.q + 3]).normalized().toRotationMatrix();
      X.translation() = q.segment<3>(body.q + 4);
      break;
    case JointType::fixed:
      break;
  }
  return X;
}

double lowest_of_mesh(const Shape& shape, const Pose& X_WG) {
  double lowest = std::numeric_limits<double>::infinity();
  // Where it will rest: what contact sees may be a little smaller than the mesh.
  for (const Vec3& vertex : shape.hull ? shape.hull->corners : shape.mesh->vertices) {
    lowest = std::min(lowest, (X_WG * vertex.cwiseProduct(shape.size).eval()).z());
  }
  return lowest;
}

double lowest_of_shape(const Shape& shape, const Pose& X_WG) {
  const double z = X_WG.translation().z();
  const Vec3 up_G = X_WG.linear().row(2);  // world z seen from the shape
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return z - up_G.cwiseAbs().dot(s) / 2;
    case ShapeKind::sphere:
      return z - s.x();
    case ShapeKind::cylinder:
      return z - std::abs(up_G.z()) * s.y() / 2 - s.x() * pinned::hypot(up_G.x(), up_G.y());
    case ShapeKind::capsule:
      return z - std::abs(up_G.z()) * s.y() / 2 - s.x();
    case ShapeKind::mesh:
      return lowest_of_mesh(shape, X_WG);
    case ShapeKind::plane:
    case ShapeKind::heightfield:
      break;
  }
  return std::numeric_limits<double>::infinity();  // terrain has no lowest point
}

}  // namespace

std::vector<Pose> place_bodies(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& q) {
  std::vector<Pose> X_WB;
  X_WB.reserve(model.bodies.size());
  for (const Body& body : model.bodies) {
    const Pose X_PC = body.X_PB * joint_motion(body, q);
    X_WB.push_back(body.parent < 0 ? X_PC : X_WB[body.parent] * X_PC);
  }
  return X_WB;
}

Pose frame_pose(const Model& model, const std::vector<Pose>& X_WB, int frame) {
  const Frame& f = model.frames[frame];
  return f.body < 0 ? f.X_BF : X_WB[f.body] * f.X_BF;
}

Pose fixed_base_pose(const Model& model) {
  if (model.floating_base) return Pose::Identity();
  const Frame* base = nullptr;
  for (const Frame& frame : model.frames) {
    if (frame.body >= 0) continue;
    if (base == nullptr || base->name == "world") base = &frame;
    if (base->name != "world") break;
  }
  return base != nullptr ? base->X_BF : Pose::Identity();
}

double lowest_point(const Model& model, const std::vector<Pose>& X_WB) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Collider& collider : model.colliders) {
    if (collider.is_object) continue;
    const Pose X_WG = collider.body < 0 ? collider.X_BG : X_WB[collider.body] * collider.X_BG;
    lowest = std::min(lowest, lowest_of_shape(collider.shape, X_WG));
  }
  return lowest;
}

}  // namespace graze
