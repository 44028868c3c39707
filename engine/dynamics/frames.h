#pragma once
// Points and frames that ride on the bodies of a tree: where they are, how they move, how they depend on v, and what
// forces on them do. World axes. A body is an index into Model::bodies; where a function says so, -1 is the world.
// Velocities and Jacobians: Featherstone 2008, §2.8 and §4.1.

#include "engine/dynamics/tree.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// From the origin O of a body's tree to the point p (world), m. After update_poses.
template <class T>
inline Vec3T<T> from_origin(const TreeT<T>& tree, int body, const Vec3T<T>& p) {
  const int root = tree.topology.root[body];
  return root < 0 ? p : p - tree.origin[root];
}

/// World pose of a frame that is fixed to a body (-1: the world) at X_BF. After update_poses.
template <class T>
inline PoseT<T> frame_pose(const TreeT<T>& tree, int body, const PoseT<T>& X_BF) {
  return body < 0 ? X_BF : tree.pose[body] * X_BF;
}

/// Velocity of the point of `body` that is now at p (world), m/s. After update_velocities or update_bias.
template <class T>
inline Vec3T<T> point_velocity(const TreeT<T>& tree, int body, const Vec3T<T>& p) {
  const SpatialT<T>& V = tree.motion[body].V;
  return cross_add(V.w, from_origin(tree, body, p), V.l);
}

/// Classical acceleration of the same point, m/s^2; a body at rest on a table has none. After inverse_dynamics: of its
/// v' (with v' = 0 it is the rate of J, times v).
template <class T>
inline Vec3T<T> point_acceleration(const TreeT<T>& tree, int body, const Vec3T<T>& p) {
  const SpatialT<T>&V = tree.motion[body].V, &A = tree.motion[body].A;
  const Vec3T<T> r = from_origin(tree, body, p), g{tree.gravity[0], tree.gravity[1], tree.gravity[2]};
  return cross_add(V.w, cross_add(V.w, r, V.l), cross_add(A.w, r, A.l + g));
}

/// Calls visit(dof, S) with the motion subspace, about O, of each degree of freedom that moves the body (-1: none),
/// from the body to the base. Of a floating body the six are unit vectors, angular before linear.
template <class T, class Visit>
inline void visit_path(const TreeT<T>& tree, int body, const Visit& visit) {
  const TopologyView& t = tree.topology;
  const T zero(0.0), one(1.0);
  const Vec3T<T> none{zero, zero, zero}, unit[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  for (int i = body; i >= 0; i = t.parent[i]) {
    if (t.kind[i] != kFloating) {
      visit(t.v[i], tree.motion[i].S);
      continue;
    }
    for (int k = 0; k < 3; ++k) visit(t.v[i] + k, SpatialT<T>{unit[k], none});
    for (int k = 0; k < 3; ++k) visit(t.v[i] + 3 + k, SpatialT<T>{none, unit[k]});
  }
}

/// Jacobian of a point of a body (-1: the world) that is now at p (world): its velocity is the sum of J[k] v[k]. J: nv
/// columns, all written. After update_poses.
template <class T>
inline void point_jacobian(const TreeT<T>& tree, int body, const Vec3T<T>& p, Vec3T<T>* J) {
  for (int k = 0; k < tree.topology.nv; ++k) J[k] = {T(0.0), T(0.0), T(0.0)};
  if (body < 0) return;
  const Vec3T<T> r = from_origin(tree, body, p);
  visit_path(tree, body, [&](int k, const SpatialT<T>& S) { J[k] = cross_add(S.w, r, S.l); });
}

/// Jacobian of a frame of a body (-1: the world) whose origin is now at p (world): angular velocity and velocity of
/// that origin. J: nv columns, all written. After update_poses.
template <class T>
inline void frame_jacobian(const TreeT<T>& tree, int body, const Vec3T<T>& p, SpatialT<T>* J) {
  const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
  for (int k = 0; k < tree.topology.nv; ++k) J[k] = {none, none};
  if (body < 0) return;
  const Vec3T<T> r = from_origin(tree, body, p);
  visit_path(tree, body, [&](int k, const SpatialT<T>& S) { J[k] = {S.w, cross_add(S.w, r, S.l)}; });
}

/// tau += J^T f of a force (N, world) on the point of a body (-1: nothing happens) that is now at p (world). tau: nv.
/// After update_poses.
template <class T>
inline void add_force(const TreeT<T>& tree, int body, const Vec3T<T>& p, const Vec3T<T>& f, T* tau) {
  if (body < 0) return;
  const SpatialT<T> F{cross(from_origin(tree, body, p), f), f};
  visit_path(tree, body, [&](int k, const SpatialT<T>& S) { tau[k] += dot(S, F); });
}

/// tau += J^T m of a pure torque (N m, world) on a body. tau: nv. After update_poses.
template <class T>
inline void add_torque(const TreeT<T>& tree, int body, const Vec3T<T>& m, T* tau) {
  visit_path(tree, body,
             [&](int k, const SpatialT<T>& S) { tau[k] = fma(S.w.z, m.z, fma(S.w.y, m.y, fma(S.w.x, m.x, tau[k]))); });
}

// --- Contacts --------------------------------------------------------------------------------------------------------
// Two bodies a and b, either may be the world, meet in a point. Vec3T with (x, y, z) standing for (n, s, t) is called
// local.

/// Where two bodies meet: point and axes, right-handed, world.
template <class T>
struct ContactFrameT {
  Vec3T<T> n, s, t;  // normal, from b to a, and two tangents; unit
  Vec3T<T> p;        // m
};

/// Fills s and t of a unit normal without branches (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 2017).
template <class T>
inline void make_tangents(ContactFrameT<T>& c) {
  const T sign = select(c.n.z < T(0.0), T(-1.0), T(1.0));
  const T a = -recip(sign + c.n.z);
  const T b = c.n.x * c.n.y * a;
  c.s = {fma(sign * c.n.x, c.n.x * a, T(1.0)), sign * b, -(sign * c.n.x)};
  c.t = {b, fma(c.n.y, c.n.y * a, sign), -c.n.y};
}

template <class T>
inline Vec3T<T> to_local(const ContactFrameT<T>& c, const Vec3T<T>& a) {
  return {dot(c.n, a), dot(c.s, a), dot(c.t, a)};
}
template <class T>
inline Vec3T<T> to_world(const ContactFrameT<T>& c, const Vec3T<T>& a) {
  return axpy(a.x, c.n, axpy(a.y, c.s, a.z * c.t));
}

/// Row of +-J^T for the joint of a body, local.
template <class T>
inline Vec3T<T> joint_jacobian(const TreeT<T>& tree, int body, double side, const ContactFrameT<T>& c) {
  const SpatialT<T>& S = tree.motion[body].S;
  return to_local(c, T(side) * cross_add(S.w, from_origin(tree, body, c.p), S.l));
}

/// The six rows of +-J^T for a floating body, local.
template <class T>
inline void base_jacobian(const TreeT<T>& tree, int body, double side, const ContactFrameT<T>& c, Vec3T<T> (&y)[6]) {
  const T sign(side);
  const Vec3T<T> r = from_origin(tree, body, c.p);
  const Vec3T<T> n = sign * c.n, s = sign * c.s, t = sign * c.t;
  const Vec3T<T> rn = cross(r, n), rs = cross(r, s), rt = cross(r, t);  // d . (e_k x r) = e_k . (r x d)
  y[0] = {rn.x, rs.x, rt.x}, y[1] = {rn.y, rs.y, rt.y}, y[2] = {rn.z, rs.z, rt.z};
  y[3] = {n.x, s.x, t.x}, y[4] = {n.y, s.y, t.y}, y[5] = {n.z, s.z, t.z};
}

/// Rows of +-J^T for one body's own degrees of freedom into y (by dof), local.
template <class T>
inline void jacobian_rows(const TreeT<T>& tree, int body, double side, const ContactFrameT<T>& c, Vec3T<T>* y) {
  const TopologyView& top = tree.topology;
  y += top.v[body];
  if (top.kind[body] != kFloating) {
    y[0] = joint_jacobian(tree, body, side, c);
    return;
  }
  Vec3T<T> rows[6];
  base_jacobian(tree, body, side, c, rows);
  GRAZE_UNROLL
  for (int d = 0; d < 6; ++d) y[d] = rows[d];
}

/// Contact Jacobian, transposed: the velocity of a's point less that of b's is the sum of y[k] v[k], local. a, b:
/// bodies, -1: the world. y: nv rows, all written. After update_poses.
template <class T>
inline void contact_jacobian(const TreeT<T>& tree, int a, int b, const ContactFrameT<T>& c, Vec3T<T>* y) {
  const TopologyView& t = tree.topology;
  for (int k = 0; k < t.nv; ++k) y[k] = {T(0.0), T(0.0), T(0.0)};
  // What moves both moves neither against the other.
  int i = a, j = b;
  while (i != j) {
    int& outer = i > j ? i : j;  // parents come before children
    jacobian_rows(tree, outer, &outer == &i ? 1.0 : -1.0, c, y);
    outer = t.parent[outer];
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
