#pragma once
// Contact points of the pairs that a Model allows, and of no others: there is no broad phase to forget one and no order
// that depends on addresses. Planes against anything, and spheres against spheres and boxes, are computed in closed
// form with all their points at once and no memory of the step before (analytic.h); the other pairs go through Bullet's
// algorithms (box-box by separating axes, GJK/EPA with persistent manifolds, triangles of a heightfield).

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include <memory>
#include <vector>

#include "engine/bullet/shapes.h"

namespace graze::bullet {

/// A pair with its manifold of this step (null while the pair has never been near).
struct NearPair {
  const ColliderPair* pair = nullptr;
  btPersistentManifold* manifold = nullptr;
};

class NarrowPhase {
 public:
  NarrowPhase(const Model& model, const std::vector<Solid>& solids);
  ~NarrowPhase();
  NarrowPhase(const NarrowPhase&) = delete;
  NarrowPhase& operator=(const NarrowPhase&) = delete;

  /// Finds all points nearer than `reach` (m). The result holds the pairs with points, in the Model's order.
  const std::vector<NearPair>& detect(double reach);
  btDispatcher& dispatcher() { return dispatcher_; }

  /// The points that Bullet's algorithms gather over the steps, as they are kept between two of them.
  struct Memory {
    int candidate;                // place in Model::pairs
    double breaking, processing;  // the manifold's thresholds, m
    std::vector<btManifoldPoint> points;
  };
  std::vector<Memory> memory() const;
  /// Of a narrow phase over the same particle, whose solids stand where they stood when it was taken.
  void restore(const std::vector<Memory>& memory);

 private:
  /// Gives new manifolds the reach of this step instead of Bullet's global 2 cm.
  struct Dispatcher : btCollisionDispatcher {
    double reach = 0;
    using btCollisionDispatcher::btCollisionDispatcher;
    btPersistentManifold* getNewManifold(const btCollisionObject* a, const btCollisionObject* b) override;
  };
  struct Candidate {
    const ColliderPair* pair;
    const Solid *a, *b;
    bool analytic, fresh;  // fresh: one exact point per step, so the points of the last step are dropped
    btPersistentManifold* manifold = nullptr;
    btCollisionAlgorithm* algorithm = nullptr;
  };
  bool near(const Candidate& candidate, double reach) const;
  void detect_analytic(Candidate& candidate, double reach);
  void detect_by_bullet(Candidate& candidate);
  /// One look of Bullet's algorithm for the pair, which is made at the first, and makes the manifold.
  void run_algorithm(Candidate& candidate);

  btDefaultCollisionConfiguration configuration_;
  Dispatcher dispatcher_;
  std::vector<Candidate> candidates_;
  std::vector<NearPair> result_;
};

}  // namespace graze::bullet
