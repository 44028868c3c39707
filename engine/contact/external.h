#pragma once
// Contact of pairs that have no kernel (has_kernel in collide.h): those of convex hulls, but on the ground. The stepper
// of a block asks for their manifolds between culling and solving. The implementation stands in convex_pairs.h; this
// interface keeps the lane engine from knowing it.

#include "engine/model/model.h"

namespace graze {

class ExternalContacts {
 public:
  virtual ~ExternalContacts() = default;

  /// Takes over the sizes of a lane's shapes.
  virtual void start(int lane, const Model& model) = 0;
  /// The same of what was kept of them: Shape::size of each collider.
  virtual void resize(int lane, const std::vector<Vec3>& sizes) = 0;
  /// Points of pair `pair` of the Model that are nearer than `margin` [lane], for the lanes of the mask (bit l: lane
  /// l). X_a and X_b: world poses of the colliders, [12][lanes], R row by row, then p. Fills all of `rows`,
  /// [ManifoldT::kMax][kManifoldRows][lanes] (see read_manifold). The poses of meshes are those of frames at their
  /// hulls' centres (hull_arrays.h). `axis`, [3][lanes], becomes a unit vector from b to a in b's frame along which the
  /// shapes are apart, in lanes of the mask where they have no points; null: not wanted.
  virtual void collide(int pair, int lanes, unsigned mask, const double* X_a, const double* X_b, const double* margin,
                       double* rows, double* axis) = 0;
};

}  // namespace graze
