#include "engine/bullet/shapes.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cassert>
#include <limits>

#include "engine/contact/bullet_convert.h"
#include "engine/lanes/scalar.h"

namespace graze::bullet {
namespace {

/// GJK works on a core shrunk by the margin and rounds edges by it (the outer size stays). Bullet's 4 cm are for
/// furniture; feet here are 8.5 mm. Half a millimetre, and never more than a tenth of the smallest half-extent.
constexpr double kMargin = 5e-4;

double margin_for(double smallest_half_extent) { return std::min(kMargin, 0.1 * smallest_half_extent); }

std::unique_ptr<btCollisionShape> make_box(const Vec3& size) {
  auto box = std::make_unique<btBoxShape>(to_bt(Vec3(0.5 * size)));
  box->setMargin(margin_for(0.5 * size.minCoeff()));
  return box;
}

std::unique_ptr<btCollisionShape> make_cylinder(double radius, double length) {
  auto cylinder = std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, 0.5 * length));
  cylinder->setMargin(margin_for(std::min(radius, 0.5 * length)));
  return cylinder;
}

std::unique_ptr<btCollisionShape> make_hull(const std::vector<Vec3>& corners) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Vec3& corner : corners) hull->addPoint(to_bt(corner), false);
  hull->recalcLocalAabb();
  hull->setMargin(0);  // a hull's margin would be added outside
  return hull;
}

/// Bullet centres a heightfield's box on the middle of its heights; `offset` is that middle.
std::unique_ptr<btCollisionShape> make_terrain(const Shape& shape, btVector3& offset) {
  const HeightGrid& grid = *shape.grid;
  const auto [low, high] = std::minmax_element(grid.height.begin(), grid.height.end());
  auto terrain =
      std::make_unique<btHeightfieldTerrainShape>(grid.nx, grid.ny, grid.height.data(), *low, *high, 2, false);
  const Vec3 scale(shape.size.x() / (grid.nx - 1), shape.size.y() / (grid.ny - 1), shape.size.z());
  terrain->setLocalScaling(to_bt(scale));
  terrain->setMargin(0);
  offset = btVector3(0, 0, 0.5 * (*low + *high) * shape.size.z());
  return terrain;
}

void make_shape(Solid& solid, HullCache& hulls) {
  const Shape& shape = solid.collider->shape;
  const Vec3& size = shape.size;
  btVector3 offset(0, 0, 0);
  switch (shape.kind) {
    case ShapeKind::box:
      solid.shape = make_box(size);
      solid.radius = 0.5 * size.norm();
      break;
    case ShapeKind::sphere:
      solid.shape = std::make_unique<btSphereShape>(size.x());
      solid.radius = size.x();
      break;
    case ShapeKind::cylinder:
      solid.shape = make_cylinder(size.x(), size.y());
      solid.radius = pinned::hypot(size.x(), 0.5 * size.y());
      break;
    case ShapeKind::capsule:
      solid.shape = std::make_unique<btCapsuleShapeZ>(size.x(), size.y());
      solid.radius = size.x() + 0.5 * size.y();
      break;
    case ShapeKind::mesh:
      for (const Vec3& corner : hulls.hull(shape)->corners) {
        solid.corners.push_back(corner.cwiseProduct(size));
        solid.radius = std::max(solid.radius, solid.corners.back().norm());
      }
      solid.shape = make_hull(solid.corners);
      break;
    case ShapeKind::plane:
      solid.shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0);
      solid.radius = std::numeric_limits<double>::infinity();
      break;
    case ShapeKind::heightfield:
      solid.shape = make_terrain(shape, offset);
      solid.radius = std::numeric_limits<double>::infinity();
      break;
  }
  solid.X_BS = to_bt(solid.collider->X_BG);
  solid.X_BS.setOrigin(solid.X_BS * offset);
}

void place(Solid& solid, const btTransform& X_WB) {
  solid.object->setWorldTransform(X_WB * solid.X_BS);
  solid.shape->getAabb(solid.object->getWorldTransform(), solid.aabb_min, solid.aabb_max);
}

}  // namespace

std::shared_ptr<const Hull> HullCache::hull(const Shape& shape) {
  if (shape.hull) return shape.hull;
  for (const auto& [known, hull] : hulls_) {
    if (known == shape.mesh) return hull;
  }
  return hulls_.emplace_back(shape.mesh, hull_of(shape)).second;
}

std::vector<Solid> make_solids(const Model& model, const Forest& forest, HullCache& hulls) {
  std::vector<Solid> solids(model.colliders.size());
  for (std::size_t i = 0; i < solids.size(); ++i) {
    Solid& solid = solids[i];
    solid.collider = &model.colliders[i];
    make_shape(solid, hulls);
    const int body = solid.collider->body;
    if (body >= 0) {
      solid.object = std::make_unique<btMultiBodyLinkCollider>(forest.multibody(body), forest.link(body));
      solid.object->setCollisionFlags(0);
    } else {
      solid.object = std::make_unique<btCollisionObject>();
    }
    solid.object->setCollisionShape(solid.shape.get());
    place(solid, body >= 0 ? to_bt(forest.pose(body)) : btTransform::getIdentity());
  }
  return solids;
}

void place_solids(std::vector<Solid>& solids, const Forest& forest) {
  for (Solid& solid : solids) {
    if (solid.collider->body >= 0) place(solid, to_bt(forest.pose(solid.collider->body)));
  }
}

}  // namespace graze::bullet
