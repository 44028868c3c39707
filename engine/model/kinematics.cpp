#include "engine/model/kinematics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/lanes/scalar.h"

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

/// Columns of one body's joint in the Jacobian of a point that it carries.
void add_columns(const Body& body, const Pose& X_WB, const Vec3& p_W, Eigen::Matrix3Xd& J) {
  const Vec3 r = p_W - X_WB.translation();
  if (body.type == JointType::floating) {
    for (int k = 0; k < 3; ++k) J.col(body.v + k) = Vec3::Unit(k).cross(r);
    J.block<3, 3>(0, body.v + 3).setIdentity();
    return;
  }
  const Vec3 axis_W = X_WB.linear() * body.axis;
  J.col(body.v) = body.type == JointType::revolute ? Vec3(axis_W.cross(r)) : axis_W;
}

double lowest_of_mesh(const Shape& shape, const Pose& X_WG) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : shape.mesh->vertices) {
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

void forward_kinematics(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& q, std::vector<Pose>& X_WB) {
  X_WB.resize(model.bodies.size());
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const Pose X_PC = body.X_PB * joint_motion(body, q);
    X_WB[i] = body.parent < 0 ? X_PC : X_WB[body.parent] * X_PC;
  }
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

Eigen::Matrix3Xd point_jacobian(const Model& model, const std::vector<Pose>& X_WB, int body, const Vec3& p_W) {
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, model.nv);
  for (int b = body; b >= 0; b = model.bodies[b].parent) add_columns(model.bodies[b], X_WB[b], p_W, J);
  return J;
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
