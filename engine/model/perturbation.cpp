#include "engine/model/perturbation.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "engine/model/rotation.h"

namespace graze {

namespace {

/// Length of a shape that can be a limb, or 0.
double limb_length(const Shape& shape) {
  if (shape.kind == ShapeKind::box) return shape.size.maxCoeff();
  if (shape.kind == ShapeKind::cylinder || shape.kind == ShapeKind::capsule) return shape.size.y();
  return 0;
}

Shape scaled(const Shape& shape, double length, double radius, const Vec3& size, int axis) {
  Shape out = shape;
  switch (shape.kind) {
    case ShapeKind::box:
      out.size = shape.size.cwiseProduct(size);
      out.size[axis] *= length;
      break;
    case ShapeKind::sphere:
    case ShapeKind::cylinder:
    case ShapeKind::capsule:
      out.size = Vec3(shape.size.x() * radius, shape.size.y() * length, shape.size.z());
      break;
    default:
      out.size = shape.size.cwiseProduct(size);
  }
  return out;
}

/// Diagonal map, in the shape's frame, that takes the mass distribution of the homogeneous old shape to second moments
/// of the homogeneous new one. For boxes, cylinders and spheres this is the ratio of the sizes; a capsule is no affine
/// image of another, but its moments are reached all the same.
Vec3 moment_scale(const Shape& from, const Shape& to) {
  const MassMoments a = MassMoments::of_shape(from, 1), b = MassMoments::of_shape(to, 1);
  const Vec3 ratio = (b.second.diagonal() / b.mass).cwiseQuotient(a.second.diagonal() / a.mass);
  return ratio.cwiseSqrt();
}

MassMoments with_mass(const MassMoments& moments, double density, double mass) {
  return moments.scaled(std::isnan(mass) ? density : mass / moments.mass);
}

/// A heightfield of that spectrum on the grid that it has.
Shape redrawn(Shape shape, const Spectrum& spectrum) {
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = shape.grid->nx, grid->ny = shape.grid->ny;
  grid->height = spectral_heights(spectrum, grid->nx, grid->ny, shape.size.x(), shape.size.y());
  shape.spectrum = std::make_shared<const Spectrum>(spectrum);
  shape.grid = std::move(grid);
  return shape;
}

}  // namespace

/// The map of points, in the primary shape's frame: first the sizes of a box about its centre, then across and along
/// the limb. Along the limb, points beyond its ends move with the ends.
struct LinkPlan::Map {
  Pose X_LG, X_GL;
  Vec3 across = Vec3::Ones();  // factors of all coordinates but that along the limb's length
  int axis = 2;
  double low = 0, high = 0;  // ends of the limb along `axis`, after `across`
  double stretch = 1;
  double fixed = 0;  // coordinate that stays

  double along(double x) const { return x + (stretch - 1) * (std::clamp(x, low, high) - fixed); }
  Vec3 operator()(const Vec3& p_L) const {
    Vec3 g = across.cwiseProduct(X_GL * p_L);
    g[axis] = along(g[axis]);
    return X_LG * g;
  }
};

const std::vector<Geometry>& LinkPlan::shapes(const Link& link) {
  return link.collisions.empty() ? link.visuals : link.collisions;
}

LinkPlan::LinkPlan(const Robot& robot, int link, std::vector<int> children)
    : link_(link), root_(link == 0), children_(std::move(children)) {
  choose_primary(robot);
  if (limb_) choose_ends(robot);
}

const Geometry& LinkPlan::primary(const Robot& robot) const { return shapes(robot.links[link_])[primary_]; }

double LinkPlan::length(const Robot& robot) const { return limb_length(primary(robot).shape); }

void LinkPlan::choose_primary(const Robot& robot) {
  const Link& link = robot.links[link_];
  const std::vector<Geometry>& all = shapes(link);
  double longest = 0, largest = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Shape& shape = all[i].shape;
    if (!link.collisions.empty() || shape.kind != ShapeKind::mesh) volume_ += shape.volume();
    if (limb_length(shape) > longest) {
      longest = limb_length(shape);
      primary_ = static_cast<int>(i);
    } else if (longest == 0 && shape.kind == ShapeKind::sphere && shape.size.x() > largest) {
      largest = shape.size.x();
      primary_ = static_cast<int>(i);
    }
  }
  if (longest == 0) return;
  const Shape& shape = all[primary_].shape;
  limb_ = shape.kind != ShapeKind::box || !root_;
  if (shape.kind == ShapeKind::box) shape.size.maxCoeff(&axis_);
}

/// The proximal end is the one nearer to the link's joint; if the joint is in the middle, the one farther from the
/// child joints.
void LinkPlan::choose_ends(const Robot& robot) {
  const Geometry& geometry = primary(robot);
  const Vec3 half = 0.5 * limb_length(geometry.shape) * Vec3::Unit(axis_);
  const Vec3 plus = geometry.X_LG * half, minus = geometry.X_LG * Vec3(-half);
  const double difference = plus.norm() - minus.norm();
  if (std::abs(difference) > 1e-9 * half.norm()) {
    direction_ = difference > 0 ? 1 : -1;
    return;
  }
  Vec3 children = Vec3::Zero();
  for (int j : children_) children += robot.joints[j].X_PJ.translation();
  direction_ = children.dot(plus - minus) < 0 ? -1 : 1;
}

void LinkPlan::move_attached(const Map& map, Robot& robot) const {
  Link& link = robot.links[link_];
  std::vector<Geometry>& all = link.collisions.empty() ? link.visuals : link.collisions;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (static_cast<int>(i) == primary_) continue;
    all[i].X_LG.translation() = map(all[i].X_LG.translation());
  }
  for (int j : children_) robot.joints[j].X_PJ.translation() = map(robot.joints[j].X_PJ.translation());
}

void LinkPlan::apply(const LinkChange& change, Robot& robot) const {
  Link& link = robot.links[link_];
  double volume_ratio = 1;
  if (primary_ >= 0) {
    std::vector<Geometry>& all = link.collisions.empty() ? link.visuals : link.collisions;
    Geometry& geometry = all[primary_];
    const Shape before = geometry.shape;
    const Shape after = scaled(before, change.length, change.radius, change.size, axis_);
    Map map;
    map.X_LG = geometry.X_LG;
    map.X_GL = geometry.X_LG.inverse();
    map.axis = axis_;
    map.across = before.kind == ShapeKind::box ? change.size : Vec3(Vec3::Constant(change.radius));
    if (limb_ && before.kind != ShapeKind::box) map.across[axis_] = 1;
    if (limb_) {
      map.high = 0.5 * limb_length(before) * map.across[axis_];
      map.low = -map.high;
      map.stretch = change.length;
      map.fixed = root_ ? 0 : -direction_ * map.high;
    }
    move_attached(map, robot);
    const Vec3 center = geometry.X_LG.translation(), moved = map(center);
    const Mat3 A =
        geometry.X_LG.linear() * moment_scale(before, after).asDiagonal() * geometry.X_LG.linear().transpose();
    link.inertia = link.inertia.transformed(A, moved - A * center);
    volume_ratio = (volume_ - before.volume() + after.volume()) / volume_;
    geometry.shape = after;
    geometry.X_LG.translation() = moved;
  }
  if (!(link.inertia.mass > 0)) return;
  link.inertia = with_mass(link.inertia, change.density * volume_ratio, change.mass);
  link.inertia = link.inertia.transformed(Mat3::Identity(), change.com);
}

std::vector<LinkPlan> link_plans(const Robot& robot) {
  std::unordered_map<std::string_view, std::vector<int>> children;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    children[robot.joints[j].parent].push_back(static_cast<int>(j));
  }
  std::vector<LinkPlan> out;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    out.emplace_back(robot, static_cast<int>(i), std::move(children[robot.links[i].name]));
  }
  return out;
}

void apply(const ObjectChange& change, Object& object) {
  const Shape before = object.shape;
  object.shape = scaled(before, change.length, change.radius, change.size, 2);
  if (object.movable && before.volume() > 0) {
    const Mat3 A = moment_scale(before, object.shape).asDiagonal();
    object.inertia = object.inertia.transformed(A, Vec3::Zero());
    object.inertia = with_mass(object.inertia, change.density * object.shape.volume() / before.volume(), change.mass);
  }
  if (change.spectrum) object.shape = redrawn(object.shape, *change.spectrum);
  if (!change.rpy.hasNaN()) object.X_WO.linear() = rotation_from_rpy(change.rpy);
}

}  // namespace graze
