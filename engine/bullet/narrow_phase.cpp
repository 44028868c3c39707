#include "engine/bullet/narrow_phase.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include "engine/bullet/analytic.h"

namespace graze::bullet {
namespace {

/// Small pools: a lane has tens of near pairs, Bullet's default memory is for 4096. A full pool falls back to the heap.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 16;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 16;
  return info;
}

ShapeKind kind(const Solid* solid) { return solid->collider->shape.kind; }

bool overlap(const Solid& a, const Solid& b, double reach) {
  for (int k = 0; k < 3; ++k) {
    if (a.aabb_min[k] - reach > b.aabb_max[k] || b.aabb_min[k] - reach > a.aabb_max[k]) return false;
  }
  return true;
}

}  // namespace

btPersistentManifold* NarrowPhase::Dispatcher::getNewManifold(const btCollisionObject* a, const btCollisionObject* b) {
  btPersistentManifold* manifold = btCollisionDispatcher::getNewManifold(a, b);
  manifold->setContactBreakingThreshold(reach);
  return manifold;
}

NarrowPhase::NarrowPhase(const Model& model, const std::vector<Solid>& solids)
    : configuration_(small_pools()), dispatcher_(&configuration_) {
  candidates_.reserve(model.pairs.size());
  for (const ColliderPair& pair : model.pairs) {
    const Solid *a = &solids[pair.a], *b = &solids[pair.b];
    if (!analytic(kind(a), kind(b)) && analytic(kind(b), kind(a))) std::swap(a, b);
    const bool sphere = kind(a) == ShapeKind::sphere || kind(b) == ShapeKind::sphere;
    candidates_.push_back({&pair, a, b, analytic(kind(a), kind(b)), sphere});
  }
}

NarrowPhase::~NarrowPhase() {
  for (Candidate& candidate : candidates_) {
    if (candidate.algorithm) {
      candidate.algorithm->~btCollisionAlgorithm();
      dispatcher_.freeCollisionAlgorithm(candidate.algorithm);
    } else if (candidate.manifold) {
      dispatcher_.releaseManifold(candidate.manifold);
    }
  }
}

bool NarrowPhase::near(const Candidate& candidate, double reach) const {
  // A plane's box is infinite; its own test in touches() is as quick as a box test.
  return kind(candidate.b) == ShapeKind::plane || overlap(*candidate.a, *candidate.b, reach);
}

const std::vector<NearPair>& NarrowPhase::detect(double reach) {
  dispatcher_.reach = reach;
  result_.clear();
  for (Candidate& candidate : candidates_) {
    if (!near(candidate, reach)) {
      if (candidate.manifold) candidate.manifold->clearManifold();
      continue;
    }
    if (candidate.analytic) {
      detect_analytic(candidate, reach);
    } else {
      detect_by_bullet(candidate);
    }
    if (candidate.manifold && candidate.manifold->getNumContacts() > 0) {
      result_.push_back({candidate.pair, candidate.manifold});
    }
  }
  return result_;
}

void NarrowPhase::detect_analytic(Candidate& candidate, double reach) {
  thread_local std::vector<Touch> found;  // scratch memory only
  found.clear();
  touches(*candidate.a, *candidate.b, reach, found);
  if (candidate.manifold) candidate.manifold->clearManifold();
  if (found.empty()) return;
  const btCollisionObject &a = *candidate.a->object, &b = *candidate.b->object;
  if (!candidate.manifold) candidate.manifold = dispatcher_.getNewManifold(&a, &b);
  for (const Touch& touch : found) {
    btManifoldPoint point(a.getWorldTransform().invXform(touch.first), b.getWorldTransform().invXform(touch.second),
                          touch.normal, touch.distance);
    point.m_positionWorldOnA = touch.first;
    point.m_positionWorldOnB = touch.second;
    candidate.manifold->addManifoldPoint(point);
  }
}

void NarrowPhase::detect_by_bullet(Candidate& candidate) {
  if (candidate.fresh && candidate.manifold) candidate.manifold->clearManifold();
  run_algorithm(candidate);
}

std::vector<NarrowPhase::Memory> NarrowPhase::memory() const {
  std::vector<Memory> out;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Candidate& candidate = candidates_[i];
    if (!candidate.algorithm || !candidate.manifold) continue;
    Memory& one = out.emplace_back();
    one.candidate = static_cast<int>(i);
    one.breaking = candidate.manifold->getContactBreakingThreshold();
    one.processing = candidate.manifold->getContactProcessingThreshold();
    for (int k = 0; k < candidate.manifold->getNumContacts(); ++k) {
      one.points.push_back(candidate.manifold->getContactPoint(k));
    }
  }
  return out;
}

/// Bullet's algorithms make their manifolds themselves, when they first look at a pair. So each looks once, and what it
/// found is replaced.
void NarrowPhase::restore(const std::vector<Memory>& memory) {
  for (const Memory& one : memory) {
    Candidate& candidate = candidates_[one.candidate];
    run_algorithm(candidate);
    btPersistentManifold& manifold = *candidate.manifold;
    manifold.clearManifold();
    manifold.setContactBreakingThreshold(one.breaking);
    manifold.setContactProcessingThreshold(one.processing);
    manifold.setNumContacts(static_cast<int>(one.points.size()));
    for (std::size_t k = 0; k < one.points.size(); ++k) manifold.getContactPoint(static_cast<int>(k)) = one.points[k];
  }
}

void NarrowPhase::run_algorithm(Candidate& candidate) {
  const btCollisionObject &a = *candidate.a->object, &b = *candidate.b->object;
  const btCollisionObjectWrapper wrap_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper wrap_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
  if (!candidate.algorithm) {
    candidate.algorithm = dispatcher_.findAlgorithm(&wrap_a, &wrap_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  btDispatcherInfo info;
  btManifoldResult result(&wrap_a, &wrap_b);
  candidate.algorithm->processCollision(&wrap_a, &wrap_b, info, &result);
  if (!candidate.manifold) {
    btManifoldArray manifolds;
    candidate.algorithm->getAllContactManifolds(manifolds);
    if (manifolds.size() > 0) candidate.manifold = manifolds[0];
  }
}

}  // namespace graze::bullet
