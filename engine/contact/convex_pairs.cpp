#include "engine/contact/convex_pairs.h"

#include <algorithm>
#include <cassert>

#include "engine/contact/collide.h"
#include "engine/contact/features.h"

namespace graze {
namespace {

Pose pose_of(const double* rows, int lanes, int lane) {
  Pose X = Pose::Identity();
  for (int i = 0; i < 9; ++i) X.linear()(i / 3, i % 3) = rows[i * lanes + lane];
  for (int i = 0; i < 3; ++i) X.translation()[i] = rows[(9 + i) * lanes + lane];
  return X;
}

void write(const ManifoldPoint& point, const Shape& a, const Pose& X_a, const Shape& b, const Pose& X_b, int lanes,
           double* slot) {
  const auto row = [&](int i) -> double& { return slot[i * lanes]; };
  row(kRowPhi) = point.phi;
  for (int i = 0; i < 3; ++i) {
    row(kRowPoint + i) = point.p[i];
    row(kRowNormal + i) = point.n[i];
  }
  row(kRowValid) = point.valid ? 1 : 0;
  row(kRowFeatureA) = row(kRowFeatureB) = features::surface;
  if (!point.valid) return;
  const Vec3 half = 0.5 * point.phi * point.n;
  row(kRowFeatureA) = static_cast<double>(feature_of(a, X_a.inverse() * (point.p + half)));
  row(kRowFeatureB) = static_cast<double>(feature_of(b, X_b.inverse() * (point.p - half)));
}

}  // namespace

ConvexPairs::ConvexPairs(const Model& nominal, int lanes) : pairs_(nominal.pairs), bodies_(lanes) {
  for (const Collider& collider : nominal.colliders) {
    const bool mesh = collider.shape.kind == ShapeKind::mesh;
    hulls_.push_back(mesh ? HullArrays(*hull_of(collider.shape)) : HullArrays());
  }
  for (int lane = 0; lane < lanes; ++lane) start(lane, nominal);
}

void ConvexPairs::start(int lane, const Model& model) {
  assert(model.colliders.size() == hulls_.size());
  std::vector<Vec3> sizes;
  bodies_[lane].resize(hulls_.size());
  for (std::size_t i = 0; i < hulls_.size(); ++i) {
    bodies_[lane][i].shape = model.colliders[i].shape;
    sizes.push_back(model.colliders[i].shape.size);
  }
  resize(lane, sizes);
}

void ConvexPairs::resize(int lane, const std::vector<Vec3>& sizes) {
  assert(sizes.size() == hulls_.size());
  std::vector<Body>& bodies = bodies_[lane];
  for (std::size_t i = 0; i < hulls_.size(); ++i) {
    bodies[i].shape.size = sizes[i];
    std::vector<Vec3> corners;
    for (int k = 0; k < hulls_[i].count(); ++k) corners.push_back(hulls_[i].corner(k).cwiseProduct(sizes[i]));
    bodies[i].corners.assign(corners);
  }
}

void ConvexPairs::collide(int pair, int lanes, unsigned mask, const double* X_a, const double* X_b,
                          const double* margin, double* rows, double* axis) {
  constexpr int kSlots = ManifoldT<double>::kMax;
  std::fill_n(rows, kSlots * kManifoldRows * lanes, 0.0);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(mask >> lane & 1u)) continue;
    const Body &a = body(lane, pairs_[pair].a), &b = body(lane, pairs_[pair].b);
    const Pose pose_a = pose_of(X_a, lanes, lane), pose_b = pose_of(X_b, lanes, lane);
    Gap gap;
    const ConvexManifold manifold = touch_convex({a.shape.kind, a.shape.size, pose_a, &a.corners},
                                                 {b.shape.kind, b.shape.size, pose_b, &b.corners}, margin[lane], &gap);
    if (axis && gap.phi >= margin[lane]) {
      const Vec3 n_B = pose_b.linear().transpose() * gap.n;
      for (int k = 0; k < 3; ++k) axis[k * lanes + lane] = n_B[k];
    }
    for (int k = 0; k < kSlots; ++k) {
      write(manifold[k], a.shape, pose_a, b.shape, pose_b, lanes, rows + k * kManifoldRows * lanes + lane);
    }
  }
}

}  // namespace graze
