#pragma once
// The equation of motion M(q) v' + bias(q, v) = tau + sum of J^T f, forth and back. tau and bias are indexed as v
// (Model::nv): N m and N of joints, torque about O and force of a floating body, world axes. What bodies pass on to
// each other stays in the tree's memory.
//
// In this order, each where its numbers are wanted:
//   update_poses(tree, q)             tree.h    poses, motion subspaces
//   update_mass(tree)                 tree.h    M
//   update_bias(tree, v)              tree.h    velocities, bias (or update_velocities: these alone)
//   forward_dynamics(tree, tau, a)              v'; M becomes its factors
//   inverse_dynamics(tree, v, a, tau)           tau

#include "engine/dynamics/factor.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Spatial velocities of all bodies alone. After update_poses.
template <class T>
inline void update_velocities(const TreeT<T>& tree, const T* v) {
  const TopologyView& t = tree.topology;
  for (int i = 0; i < t.bodies; ++i) {
    const T* vi = v + t.v[i];
    SpatialT<T>& V = tree.motion[i].V;
    if (t.kind[i] == kFloating) {
      V = {{vi[0], vi[1], vi[2]}, {vi[3], vi[4], vi[5]}};
      continue;
    }
    const SpatialT<T>& S = tree.motion[i].S;
    const SpatialT<T> rate{*vi * S.w, *vi * S.l};
    V = t.parent[i] < 0 ? rate : tree.motion[t.parent[i]].V + rate;
  }
}

/// Poses, M, velocities and bias of q (nq) and v (nv). Returns the kinetic energy, J.
template <class T>
inline T update(const TreeT<T>& tree, const T* q, const T* v) {
  update_poses(tree, q);
  update_mass(tree);
  return update_bias(tree, v);
}

/// tau (nv) that holds the trees still against gravity; the bias of v = 0. After update_poses.
template <class T>
inline void gravity_forces(const TreeT<T>& tree, T* tau) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> up{-tree.gravity[0], -tree.gravity[1], -tree.gravity[2]};
  for (int i = 0; i < t.bodies; ++i) {
    const InertiaT<T>& I = tree.motion[i].I;
    tree.motion[i].F = {cross(I.h, up), I.m * up};
  }
  gather_forces(tree, tau);
}

/// tau (nv) for which v' is a (nv): Newton-Euler, without M. With the forces of contacts, tau less add_force's. Also
/// velocities and accelerations (point_acceleration). After update_poses.
template <class T>
inline void inverse_dynamics(const TreeT<T>& tree, const T* v, const T* a, T* tau) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> up{-tree.gravity[0], -tree.gravity[1], -tree.gravity[2]};
  TwistT<T> twist{};
  for (int i = 0; i < t.bodies; ++i) {
    MotionT<T>& motion = tree.motion[i];
    const T* ai = a + t.v[i];
    twist = twist_of(tree, i, v, up, twist);
    const SpatialT<T> own = t.kind[i] == kFloating ? SpatialT<T>{{ai[0], ai[1], ai[2]}, {ai[3], ai[4], ai[5]}}
                                                   : SpatialT<T>{*ai * motion.S.w, *ai * motion.S.l};
    twist.A = twist.A + own;
    motion.V = twist.V;
    motion.A = twist.A;
    motion.F = cross_force_add(twist.V, motion.I * twist.V, motion.I * twist.A);
  }
  gather_forces(tree, tau);
  for (int i = 0; i < t.bodies; ++i) tau[t.v[i]] = fma(tree.body[i].armature, a[t.v[i]], tau[t.v[i]]);
}

/// x := M^-1 x (nv). M is its factors: after factor_and_solve or forward_dynamics.
template <class T>
inline void solve_mass(const TreeT<T>& tree, T* x) {
  const TopologyView& t = tree.topology;
  for (int k = t.nv - 1; k >= 0; --k) x[k] = take_from_ancestors(t, tree.M, k, 0, x) * tree.inverse_D[k];
  solve_L(tree, x);
}

/// a (nv) := v' under tau (nv; with add_force's of contacts). M becomes its factors. After update_mass and update_bias.
template <class T>
inline void forward_dynamics(const TreeT<T>& tree, const T* tau, T* a) {
  const int nv = tree.topology.nv;
  for (int k = 0; k < nv; ++k) a[k] = tau[k] - tree.bias[k];
  factor_and_solve(tree, a);
  solve_L(tree, a);
}

/// M(i, j) of two degrees of freedom, i >= j. After update_mass, before it is factored.
template <class T>
inline T mass_entry(const TreeT<T>& tree, int i, int j) {
  const TopologyView& t = tree.topology;
  const int depth = t.dof_depth[j];
  const bool above = depth <= t.dof_depth[i] && t.chain[t.row[i] + depth] == j;
  return above ? tree.M[t.row[i] + depth] : T(0.0);
}

/// out (nv x nv) := M as a full symmetric matrix. After update_mass, before it is factored.
template <class T>
inline void dense_mass(const TreeT<T>& tree, T* out) {
  const TopologyView& t = tree.topology;
  for (int i = 0; i < t.nv * t.nv; ++i) out[i] = T(0.0);
  for (int i = 0; i < t.nv; ++i) {
    for (int d = 0; d <= t.dof_depth[i]; ++d) {
      const int j = t.chain[t.row[i] + d];
      out[i * t.nv + j] = out[j * t.nv + i] = tree.M[t.row[i] + d];
    }
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
