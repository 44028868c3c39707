#include "engine/bullet/analytic.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/contact/bullet_convert.h"

namespace graze::bullet {
namespace {

const btTransform& pose(const Solid& solid) { return solid.object->getWorldTransform(); }
const Vec3& size(const Solid& solid) { return solid.collider->shape.size; }

/// Two rim points of a cylinder's cap, a third of a turn from its lowest one, keep it from tipping over one point.
constexpr double kCosineOfThird = -0.5, kSineOfThird = 0.86602540378443865;

void cylinder_points(const Solid& cylinder, const btVector3& down, std::vector<btVector3>& points) {
  const btTransform& X = pose(cylinder);
  const btVector3 axis = X.getBasis().getColumn(2);
  const btVector3 slope = down - axis * axis.dot(down);
  // An upright cylinder has no lowest rim point; any direction that turns with it will do.
  const btVector3 lowest = slope.length2() > 1e-18 ? slope.normalized() : X.getBasis().getColumn(0);
  const double radius = size(cylinder).x(), half = 0.5 * size(cylinder).y();
  for (double end : {-half, half}) {
    const btVector3 centre = X.getOrigin() + axis * end;
    points.push_back(centre + lowest * radius);
    for (double sine : {-kSineOfThird, kSineOfThird}) {
      points.push_back(centre +
                       (lowest * kCosineOfThird + axis.cross(lowest) * sine) * radius);  // both across the axis
    }
  }
}

/// Points of a convex solid that can be its lowest against a plane whose inward direction is `down`.
void support_points(const Solid& solid, const btVector3& down, std::vector<btVector3>& points) {
  const btTransform& X = pose(solid);
  const Vec3& s = size(solid);
  switch (solid.collider->shape.kind) {
    case ShapeKind::sphere:
      points.push_back(X.getOrigin() + down * s.x());
      break;
    case ShapeKind::capsule:
      for (double end : {-0.5, 0.5}) points.push_back(X * btVector3(0, 0, end * s.y()) + down * s.x());
      break;
    case ShapeKind::cylinder:
      cylinder_points(solid, down, points);
      break;
    case ShapeKind::box:
      for (int corner = 0; corner < 8; ++corner) {
        const auto half = [&](int k) { return (corner >> k & 1 ? 0.5 : -0.5) * s[k]; };
        points.push_back(X * btVector3(half(0), half(1), half(2)));
      }
      break;
    case ShapeKind::mesh:
      for (const Vec3& corner : solid.corners) points.push_back(X * to_bt(corner));
      break;
    default:
      assert(false && "no support points");
  }
}

void touch_plane(const Solid& solid, const Solid& plane, double reach, std::vector<Touch>& out) {
  const btVector3 normal = pose(plane).getBasis().getColumn(2);
  if ((pose(solid).getOrigin() - pose(plane).getOrigin()).dot(normal) > solid.radius + reach) return;
  thread_local std::vector<btVector3> points;  // scratch memory only; filled afresh by each call
  points.clear();
  support_points(solid, -normal, points);
  for (const btVector3& point : points) {
    const double distance = (point - pose(plane).getOrigin()).dot(normal);
    if (distance < reach) out.push_back({point, point - normal * distance, normal, distance});
  }
}

void touch_spheres(const Solid& a, const Solid& b, double reach, std::vector<Touch>& out) {
  const btVector3 apart = pose(a).getOrigin() - pose(b).getOrigin();
  const double length = apart.length(), distance = length - a.radius - b.radius;
  if (distance >= reach) return;
  const btVector3 normal = length > 1e-12 ? apart / length : btVector3(0, 0, 1);
  out.push_back({pose(a).getOrigin() - normal * a.radius, pose(b).getOrigin() + normal * b.radius, normal, distance});
}

/// Nearest point of the box's surface to a centre inside it: on the face that is nearest.
Touch deep_in_box(const btVector3& centre, const Vec3& half, double radius) {
  int face = 0;
  for (int k = 1; k < 3; ++k) {
    if (half[k] - std::abs(centre[k]) < half[face] - std::abs(centre[face])) face = k;
  }
  Touch touch;
  touch.normal = btVector3(0, 0, 0);
  touch.normal[face] = centre[face] < 0 ? -1 : 1;
  touch.second = centre;
  touch.second[face] = touch.normal[face] * half[face];
  touch.distance = std::abs(centre[face]) - half[face] - radius;
  return touch;
}

void touch_box(const Solid& sphere, const Solid& box, double reach, std::vector<Touch>& out) {
  const btTransform& X = pose(box);
  const Vec3 half = 0.5 * size(box);
  const btVector3 centre = X.invXform(pose(sphere).getOrigin());
  btVector3 nearest;
  for (int k = 0; k < 3; ++k) nearest[k] = std::clamp(centre[k], -half[k], half[k]);
  const btVector3 apart = centre - nearest;
  const double length = apart.length();
  if (length - sphere.radius >= reach) return;
  Touch touch = length > 1e-12 ? Touch{{}, nearest, apart / length, length - sphere.radius}
                               : deep_in_box(centre, half, sphere.radius);
  touch.normal = X.getBasis() * touch.normal;
  touch.second = X * touch.second;
  touch.first = pose(sphere).getOrigin() - touch.normal * sphere.radius;
  out.push_back(touch);
}

/// Index of the touch for which `score` is largest, the first of equals.
template <class Score>
int best(const std::vector<Touch>& touches, Score score) {
  int at = 0;
  for (int i = 1; i < static_cast<int>(touches.size()); ++i) {
    if (score(touches[i]) > score(touches[at])) at = i;
  }
  return at;
}

/// Keeps four: the deepest, the farthest from it, and the farthest on either side of the line between them.
void keep_four(std::vector<Touch>& touches) {
  if (touches.size() <= 4) return;
  const Touch deepest = touches[best(touches, [](const Touch& t) { return -t.distance; })];
  const Touch far = touches[best(touches, [&](const Touch& t) { return (t.second - deepest.second).length2(); })];
  const btVector3 side = (far.second - deepest.second).cross(deepest.normal);
  const auto offset = [&](const Touch& t) { return (t.second - deepest.second).dot(side); };
  const Touch left = touches[best(touches, offset)];
  const Touch right = touches[best(touches, [&](const Touch& t) { return -offset(t); })];
  touches = {deepest, far, left, right};
}

}  // namespace

bool analytic(ShapeKind first, ShapeKind second) {
  if (second == ShapeKind::plane) return first != ShapeKind::plane && first != ShapeKind::heightfield;
  return first == ShapeKind::sphere && (second == ShapeKind::sphere || second == ShapeKind::box);
}

void touches(const Solid& first, const Solid& second, double reach, std::vector<Touch>& out) {
  const ShapeKind kind = second.collider->shape.kind;
  if (kind == ShapeKind::plane) touch_plane(first, second, reach, out);
  if (kind == ShapeKind::sphere) touch_spheres(first, second, reach, out);
  if (kind == ShapeKind::box) touch_box(first, second, reach, out);
  keep_four(out);
}

}  // namespace graze::bullet
