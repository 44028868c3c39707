#include "engine/dynamics/dynamics_model.h"

namespace graze {

namespace {

/// Rotation whose third column is `axis`, from the coordinate axis that is least along it.
Mat3 frame_of_axis(const Vec3& axis) {
  int least = 0;
  axis.cwiseAbs().minCoeff(&least);
  Mat3 R;
  R.col(2) = axis.normalized();
  R.col(0) = Vec3::Unit(least).cross(R.col(2)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

/// Canonical frame (z along the joint's axis) in the body frame.
Mat3 canonical(const Body& body) {
  return body.type == JointType::floating ? Mat3::Identity() : frame_of_axis(body.axis);
}

}  // namespace

Vec3T<double> to_kernel(const Vec3& a) { return {a.x(), a.y(), a.z()}; }

RotT<double> to_kernel(const Mat3& R) {
  RotT<double> out;
  for (int i = 0; i < 9; ++i) out.m[i] = R(i / 3, i % 3);
  return out;
}

PoseT<double> to_kernel(const Pose& X) { return {to_kernel(Mat3(X.linear())), to_kernel(Vec3(X.translation()))}; }

Vec3 to_eigen(const Vec3T<double>& a) { return {a.x, a.y, a.z}; }

Pose to_eigen(const PoseT<double>& X) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 9; ++i) out.linear()(i / 3, i % 3) = X.R.m[i];
  out.translation() = to_eigen(X.p);
  return out;
}

BodyT<double> body_numbers(const Body& body) {
  const Mat3 R_BC = canonical(body);
  const Mat3& inertia = body.inertia;
  BodyT<double> numbers;
  numbers.R_PC = to_kernel(Mat3(body.X_PB.linear() * R_BC));
  numbers.p_PC = to_kernel(Vec3(body.X_PB.translation()));
  numbers.R_CB = to_kernel(Mat3(R_BC.transpose()));
  numbers.mass = body.mass;
  numbers.com = to_kernel(body.com);
  numbers.ixx = inertia(0, 0), numbers.iyy = inertia(1, 1), numbers.izz = inertia(2, 2);
  numbers.ixy = inertia(0, 1), numbers.ixz = inertia(0, 2), numbers.iyz = inertia(1, 2);
  numbers.damping = body.damping;
  numbers.armature = body.armature;
  return numbers;
}

DynamicsModel::DynamicsModel(const Model& model) : topology_(model), gravity_(model.gravity) {
  for (const Body& body : model.bodies) bodies_.push_back(body_numbers(body));
}

}  // namespace graze
