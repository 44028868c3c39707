#pragma once
// Convex hulls: what a collision mesh is to contact, volume and inertia.

#include <memory>

#include "engine/model/world.h"

namespace graze {

/// The convex hull of a mesh's vertices: only the vertices on it, triangles outward counter-clockwise. Points that lie
/// within 1e-9 of the mesh's extent of a face count as on it. Null when all points lie in one plane. Quickhull: Barber,
/// Dobkin, Huhdanpaa, ACM Trans. Math. Softw. 22 (1996).
std::shared_ptr<const Mesh> convex_hull(const Mesh& mesh);

/// The same of a collision mesh, which must enclose a volume. Throws InputError that says so.
std::shared_ptr<const Mesh> collision_hull(const Mesh& mesh);

}  // namespace graze
