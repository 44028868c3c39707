#pragma once
// What the tests of contact kernels hold them against: support functions and containment of the shapes, written down
// independently of the kernels, and random poses.
//
// The signed gap of two convex bodies is the maximum over unit directions n of the separation
//   s(n) = min over a of n . x - max over b of n . x,
// for bodies that are apart and bodies that overlap. So a direction with s(n) = phi proves that the gap is at least
// phi; two points of the bodies phi apart prove, for phi > 0, that it is no more.

#include <random>

#include "engine/contact/collide.h"
#include "engine/model/world.h"

namespace graze::testing {

using Point = Vec3T<double>;
using PoseD = PoseT<double>;
using ShapeD = ShapeT<double>;
using ManifoldD = ManifoldT<double>;

/// A body: shape with kind and pose.
struct BodyD {
  ShapeKind kind;
  ShapeD shape;
  PoseD X;
};

inline Vec3 eigen(const Point& v) { return {v.x, v.y, v.z}; }
inline Pose eigen(const PoseD& X) {
  Pose out = Pose::Identity();
  for (int i = 0; i < 9; ++i) out.linear()(i / 3, i % 3) = X.R.m[i];
  out.translation() = eigen(X.p);
  return out;
}

inline Point unit(const Point& v) { return (1 / std::sqrt(norm2(v))) * v; }

/// max of n . x over the body, world.
inline double support(const BodyD& body, const Point& n_W) {
  const Point n = transposed_times(body.X.R, n_W), s = body.shape.size;
  const double across = std::hypot(n.x, n.y), centre = dot(n_W, body.X.p);
  switch (body.kind) {
    case ShapeKind::sphere:
      return centre + s.x;
    case ShapeKind::capsule:
      return centre + s.x + 0.5 * s.y * std::abs(n.z);
    case ShapeKind::cylinder:
      return centre + s.x * across + 0.5 * s.y * std::abs(n.z);
    case ShapeKind::box:
      return centre + 0.5 * (s.x * std::abs(n.x) + s.y * std::abs(n.y) + s.z * std::abs(n.z));
    default:  // half space
      return n.z > 1 - 1e-12 ? centre : 1e300;
  }
}

/// s(n), n from b to a.
inline double separation(const BodyD& a, const BodyD& b, const Point& n) { return -support(a, -n) - support(b, n); }

/// How far x lies outside of the body, in the largest of its defining inequalities; 0 inside.
inline double outside(const BodyD& body, const Point& x_W) {
  const Point x = transposed_times(body.X.R, x_W - body.X.p), s = body.shape.size;
  const double along = std::abs(x.z) - 0.5 * s.y, across = std::hypot(x.x, x.y) - s.x;
  double beyond = x.z;
  if (body.kind == ShapeKind::sphere) beyond = std::sqrt(norm2(x)) - s.x;
  if (body.kind == ShapeKind::capsule) beyond = std::hypot(x.x, x.y, std::max(along, 0.0)) - s.x;
  if (body.kind == ShapeKind::cylinder) beyond = std::max(along, across);
  if (body.kind == ShapeKind::box) {
    beyond = std::max({std::abs(x.x) - 0.5 * s.x, std::abs(x.y) - 0.5 * s.y, std::abs(x.z) - 0.5 * s.z});
  }
  return std::max(beyond, 0.0);
}

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }
  double normal() { return std::normal_distribution()(generator_); }
  int below(int n) { return static_cast<int>(generator_() % static_cast<unsigned>(n)); }
  Point direction() { return unit({normal(), normal(), normal()}); }
  RotT<double> rotation() { return rotation_of(Quat(normal(), normal(), normal(), normal()).normalized()); }
  static RotT<double> rotation_of(const Quat& q) {
    const Mat3 R = q.toRotationMatrix();
    RotT<double> out;
    for (int i = 0; i < 9; ++i) out.m[i] = R(i / 3, i % 3);
    return out;
  }
  /// A quarter-turn rotation (faces parallel to the axes), now and then tilted a little.
  RotT<double> aligned_rotation() {
    const double half_pi = 1.5707963267948966;
    Quat q = Quat::Identity();
    for (int k = 0; k < 3; ++k) q = q * Quat(Eigen::AngleAxisd(below(4) * half_pi, Vec3::Unit(k)));
    const double tilt = below(3) == 0 ? std::pow(10.0, uniform(-12, -1)) : 0.0;
    const Point axis = direction();
    return rotation_of(q * Quat(Eigen::AngleAxisd(tilt, Vec3(axis.x, axis.y, axis.z))));
  }
  ShapeD shape(ShapeKind kind) {
    const double r = uniform(0.01, 0.2);
    if (kind == ShapeKind::box) return {{uniform(0.02, 0.4), uniform(0.02, 0.4), uniform(0.02, 0.4)}};
    return {{r, uniform(0.02, 0.5), 0}};
  }

 private:
  std::mt19937 generator_;
};

inline double radius(const BodyD& body) { return bounding_radius(body.kind, body.shape); }

/// A random pair near contact: a is pushed along a random direction until the separation along it is a random fraction
/// of the sizes. `aligned` prefers parallel faces, axes and edges.
inline std::pair<BodyD, BodyD> random_pair(Random& random, ShapeKind a, ShapeKind b, bool aligned) {
  const auto rotation = [&] { return aligned ? random.aligned_rotation() : random.rotation(); };
  BodyD first{a, random.shape(a), {rotation(), {0, 0, 0}}};
  BodyD second{b, random.shape(b), {rotation(), {random.normal(), random.normal(), random.normal()}}};
  const bool by_face = aligned && random.below(2) == 0;
  Point way = by_face ? second.X.R.column(random.below(3)) : random.direction();
  if (b == ShapeKind::plane) way = second.X.R.column(2);
  const double gap = random.below(8) == 0 ? 0.0 : random.uniform(-0.05, 0.03);
  const double reach = support(second, way) - dot(way, second.X.p) + support(first, -way);
  first.X.p = axpy(reach + gap, way, second.X.p);
  if (aligned && b != ShapeKind::plane) first.X.p += random.uniform(0, 0.1) * second.X.R.column(random.below(3));
  if (b == ShapeKind::plane) first.X.p += random.uniform(-1, 1) * second.X.R.column(0);
  return {first, second};
}

inline ManifoldD touch(const BodyD& a, const BodyD& b, double margin) {
  ManifoldD out;
  collide(a.kind, a.shape, a.X, b.kind, b.shape, b.X, margin, out);
  return out;
}

inline int valid_count(const ManifoldD& manifold) {
  int count = 0;
  for (int k = 0; k < manifold.count; ++k) count += manifold.point[k].valid;
  return count;
}

/// The valid point of least gap, or null.
inline const ContactPointT<double>* deepest(const ManifoldD& manifold) {
  const ContactPointT<double>* best = nullptr;
  for (int k = 0; k < manifold.count; ++k) {
    const ContactPointT<double>& point = manifold.point[k];
    if (point.valid && (!best || point.phi < best->phi)) best = &point;
  }
  return best;
}

struct KindPair {
  ShapeKind a, b;
};
/// All pairs of convex shapes with a kernel.
inline const std::vector<KindPair>& kernel_pairs() {
  using enum ShapeKind;
  static const std::vector<KindPair> pairs = {
      {sphere, plane},      {sphere, sphere},   {sphere, capsule},   {sphere, cylinder}, {sphere, box},
      {capsule, plane},     {capsule, capsule}, {capsule, cylinder}, {capsule, box},     {cylinder, plane},
      {cylinder, cylinder}, {cylinder, box},    {box, plane},        {box, box}};
  return pairs;
}
inline std::string name_of(const KindPair& pair) {
  static const char* names[] = {"box", "sphere", "cylinder", "capsule", "mesh", "plane", "heightfield"};
  return std::string(names[static_cast<int>(pair.a)]) + "-" + names[static_cast<int>(pair.b)];
}

}  // namespace graze::testing
