#pragma once
// Colliders of a Model as Bullet collision objects.

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <memory>
#include <utility>
#include <vector>

#include "engine/bullet/tree.h"
#include "engine/model/hull.h"

namespace graze::bullet {

/// Convex hulls of meshes that come without one, found once and shared by all particles (scaled per particle).
class HullCache {
 public:
  std::shared_ptr<const Hull> hull(const Shape& shape);

 private:
  std::vector<std::pair<std::shared_ptr<const Mesh>, std::shared_ptr<const Hull>>> hulls_;
};

/// One collider: its shape, its object in Bullet, and where it is now.
struct Solid {
  const Collider* collider = nullptr;
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btCollisionObject> object;
  btTransform X_BS;              // Bullet's shape frame S in the body frame (differs from G only for heightfields)
  std::vector<Vec3> corners;     // meshes: corners of the scaled hull, in G
  double radius = 0;             // of a ball about G that holds the shape; infinite for planes and heightfields
  btVector3 aabb_min, aabb_max;  // world
};

/// Solids of all colliders. Objects on moving bodies are btMultiBodyLinkColliders.
std::vector<Solid> make_solids(const Model& model, const Forest& forest, HullCache& hulls);

/// Moves the objects on moving bodies to where the bodies are.
void place_solids(std::vector<Solid>& solids, const Forest& forest);

}  // namespace graze::bullet
