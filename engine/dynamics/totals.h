#pragma once
// What the bodies of one tree have together: mass, centre of mass and how it moves, momentum, energy. A tree is named
// by its `top`, the body without parent at its base (TopologyView::top): 0 for a robot. A robot on a fixed base whose
// first joints are several has as many trees.

#include "engine/dynamics/frames.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// The tree as one rigid body, about O. After update_poses.
template <class T>
inline InertiaT<T> inertia_of_tree(const TreeT<T>& tree, int top) {
  const TopologyView& t = tree.topology;
  InertiaT<T> sum = tree.motion[top].I;
  for (int i = top + 1; i < t.bodies; ++i) {
    if (t.top[i] == top) sum = sum + tree.motion[i].I;
  }
  return sum;
}

/// Mass of the tree, kg.
template <class T>
inline T mass_of_tree(const TreeT<T>& tree, int top) {
  const TopologyView& t = tree.topology;
  T sum = tree.body[top].mass;
  for (int i = top + 1; i < t.bodies; ++i) {
    if (t.top[i] == top) sum += tree.body[i].mass;
  }
  return sum;
}

/// Origin O of the tree in the world, m. After update_poses.
template <class T>
inline Vec3T<T> origin_of_tree(const TreeT<T>& tree, int top) {
  return tree.topology.root[top] < 0 ? Vec3T<T>{T(0.0), T(0.0), T(0.0)} : tree.origin[top];
}

/// Centre of mass of the tree in the world, m. After update_poses.
template <class T>
inline Vec3T<T> centre_of_mass(const TreeT<T>& tree, int top) {
  const InertiaT<T> I = inertia_of_tree(tree, top);
  return axpy(recip(I.m), I.h, origin_of_tree(tree, top));
}

/// Jacobian of the centre of mass: its velocity is the sum of J[k] v[k]. J: nv columns, all written. After
/// update_poses.
template <class T>
inline void com_jacobian(const TreeT<T>& tree, int top, Vec3T<T>* J) {
  const TopologyView& t = tree.topology;
  for (int k = 0; k < t.nv; ++k) J[k] = {T(0.0), T(0.0), T(0.0)};
  for (int i = top; i < t.bodies; ++i) {
    if (t.top[i] != top) continue;
    const InertiaT<T>& I = tree.motion[i].I;
    visit_path(tree, i, [&](int k, const SpatialT<T>& S) { J[k] = cross_add(S.w, I.h, axpy(I.m, S.l, J[k])); });
  }
  const T inverse = recip(mass_of_tree(tree, top));
  for (int k = 0; k < t.nv; ++k) J[k] = inverse * J[k];
}

/// Momentum of the tree, without that of rotors: angular about O, N m s, and linear, N s. After update_velocities or
/// update_bias.
template <class T>
inline SpatialT<T> momentum_about_origin(const TreeT<T>& tree, int top) {
  const TopologyView& t = tree.topology;
  SpatialT<T> P = tree.motion[top].I * tree.motion[top].V;
  for (int i = top + 1; i < t.bodies; ++i) {
    if (t.top[i] == top) P = P + tree.motion[i].I * tree.motion[i].V;
  }
  return P;
}

/// The same with the angular momentum about the point p (world).
template <class T>
inline SpatialT<T> momentum_about(const TreeT<T>& tree, int top, const Vec3T<T>& p) {
  const SpatialT<T> P = momentum_about_origin(tree, top);
  return {P.w - cross(p - origin_of_tree(tree, top), P.l), P.l};
}

/// Velocity of the tree's centre of mass, m/s. After update_velocities or update_bias.
template <class T>
inline Vec3T<T> com_velocity(const TreeT<T>& tree, int top) {
  return recip(mass_of_tree(tree, top)) * momentum_about_origin(tree, top).l;
}

/// Kinetic energy of all trees with their rotors, J; update_bias returns it, too. After update_velocities or
/// update_bias of v.
template <class T>
inline T kinetic_energy(const TreeT<T>& tree, const T* v) {
  T energy(0.0);
  for (int i = 0; i < tree.topology.bodies; ++i) {
    const MotionT<T>& motion = tree.motion[i];
    const T speed = v[tree.topology.v[i]];
    energy = fma(T(0.5), fma(tree.body[i].armature * speed, speed, dot(motion.V, motion.I * motion.V)), energy);
  }
  return energy;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
