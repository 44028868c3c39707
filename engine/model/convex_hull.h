#pragma once
// Convex hulls: what a collision mesh is to volume, inertia and contact.

#include <memory>

#include "engine/model/world.h"

namespace graze {

/// A triangle of a hull's surface. The plane is that of the whole face, so that narrow triangles have a normal, too.
struct HullFace {
  Eigen::Vector3i corner;  // indices of points, outward counter-clockwise
  Vec3 normal;             // unit, outward
  double offset;           // normal . x of its points
};

/// The convex hull of points; empty when all lie in one plane, within 1e-9 of their extent. By qhull (Barber, Dobkin,
/// Huhdanpaa, ACM Trans. Math. Softw. 22 (1996)). `most`: corners at which it is given up; then the result has more
/// than that. The same points give the same faces in the same order.
std::vector<HullFace> hull_faces(const std::vector<Vec3>& points, std::size_t most);

/// The convex hull of a mesh's vertices: only the vertices on it, in their order, and its triangles. Null when all
/// points lie in one plane. Throws InputError when it has more than kMaxHullCorners, or the mesh
/// more than kMaxHullPoints. Meshes of the same vertices share
/// one, as long as somebody holds it.
std::shared_ptr<const Mesh> convex_hull(const Mesh& mesh);

/// The same of a collision mesh, which must enclose a volume. Throws InputError that says so.
std::shared_ptr<const Mesh> collision_hull(const Mesh& mesh);

}  // namespace graze
