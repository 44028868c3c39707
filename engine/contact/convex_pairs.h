#pragma once
// Pairs without a kernel for the lane engine: takes the poses of each lane, asks convex_manifold.h, writes rows back.

#include "engine/contact/convex_manifold.h"
#include "engine/contact/external.h"
#include "engine/contact/hull_arrays.h"

namespace graze {

class ConvexPairs final : public ExternalContacts {
 public:
  /// All particles share the meshes and pairs of `nominal`.
  ConvexPairs(const Model& nominal, int lanes);

  void start(int lane, const Model& model) override;
  void resize(int lane, const std::vector<Vec3>& sizes) override;
  void collide(int pair, int lanes, unsigned mask, const double* X_a, const double* X_b, const double* margin,
               double* rows, double* axis) override;

 private:
  /// Numbers of one collider in one lane.
  struct Body {
    Shape shape;
    Corners corners;  // meshes: of the scaled hull, from its centre
  };
  const Body& body(int lane, int collider) const { return bodies_[lane][collider]; }

  std::vector<ColliderPair> pairs_;
  std::vector<HullArrays> hulls_;          // per collider; of meshes
  std::vector<std::vector<Body>> bodies_;  // [lane][collider]
};

}  // namespace graze
