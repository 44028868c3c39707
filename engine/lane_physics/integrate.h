#pragma once
// From v+ to q+, and what the integrator keeps: momentum.

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Momentum about O that each floating tree must have after the step: what it had, gravity and contacts.
template <class T>
inline void expect_momentum(const LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, double h) {
  const TopologyView& t = tree.topology;
  SpatialT<T>* momentum = reinterpret_cast<SpatialT<T>*>(block.momentum);
  const Vec3T<T> pull{T(h) * tree.gravity[0], T(h) * tree.gravity[1], T(h) * tree.gravity[2]};
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] != kFloating) continue;
    const InertiaT<T>& C = tree.motion[i].C;
    momentum[i] = {cross_add(C.h, pull, momentum[i].w), axpy(C.m, pull, momentum[i].l)};
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    for (int side = 0; side < 2; ++side) {
      const int body = side == 0 ? path.body_a : path.body_b;
      const int root = body < 0 ? -1 : t.root[body];
      if (root < 0) continue;
      const Vec3T<T> impulse = side == 0 ? to_world(c, c.lambda) : -to_world(c, c.lambda);
      momentum[root] = {cross_add(c.p - tree.origin[root], impulse, momentum[root].w), momentum[root].l + impulse};
    }
  }
}

/// q+ = q + h v+, the attitude by the exponential of the (constant) angular velocity. Lanes that are not `live` stay.
template <class T>
inline void integrate(const LaneBlock& block, const TopologyView& t, double h, const mask_of<T>& live) {
  T* q = rows<T>(block.q);
  const T* v = rows<T>(block.v);
  for (int i = 0; i < t.bodies; ++i) {
    T* qi = q + t.q[i];
    const T* vi = v + t.v[i];
    if (t.kind[i] != kFloating) {
      qi[0] = select(live, fma(T(h), vi[0], qi[0]), qi[0]);
      continue;
    }
    const Vec3T<T> w{vi[0], vi[1], vi[2]};
    const T rate = sqrt(norm2(w));
    T s, c;
    sin_cos(T(0.5 * h) * rate, s, c);
    const Vec3T<T> e = select(rate > T(1e-100), s * recip(max(rate, T(1e-100))), T(0.5 * h)) * w;
    const Vec3T<T> x{qi[1], qi[2], qi[3]};
    T qw = fnma(e.x, x.x, fnma(e.y, x.y, fnma(e.z, x.z, c * qi[0])));
    Vec3T<T> qx = axpy(qi[0], e, cross_add(e, x, c * x));
    // One Newton step towards length 1, which rounding alone has changed.
    const T scale = fnma(T(0.5), fma(qw, qw, norm2(qx)), T(1.5));
    qi[0] = select(live, scale * qw, qi[0]);
    qi[1] = select(live, scale * qx.x, qi[1]);
    qi[2] = select(live, scale * qx.y, qi[2]);
    qi[3] = select(live, scale * qx.z, qi[3]);
    for (int k = 0; k < 3; ++k) qi[4 + k] = select(live, fma(T(h), vi[3 + k], qi[4 + k]), qi[4 + k]);
  }
}

/// Gives each floating tree the momentum it must have at its new configuration, by a rigid motion of the whole tree (of
/// second order in h): free flight then keeps momentum to rounding. `before`: O at the beginning of the step.
template <class T>
inline void restore_momentum(const LaneBlock& block, const TreeT<T>& tree, const Vec3T<T>* before,
                             const mask_of<T>& live) {
  const TopologyView& t = tree.topology;
  const SpatialT<T>* momentum = reinterpret_cast<const SpatialT<T>*>(block.momentum);
  T* v = rows<T>(block.v);
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] != kFloating) continue;
    const SpatialT<T> now = momentum_of_tree(tree, i, v);
    const Vec3T<T> moved = tree.origin[i] - before[i];
    const SpatialT<T> missing{momentum[i].w - cross(moved, momentum[i].l) - now.w, momentum[i].l - now.l};
    const SpatialT<T> dv = velocity_for_momentum(tree.motion[i].C, missing);
    T* vi = v + t.v[i];
    vi[0] = select(live, vi[0] + dv.w.x, vi[0]), vi[3] = select(live, vi[3] + dv.l.x, vi[3]);
    vi[1] = select(live, vi[1] + dv.w.y, vi[1]), vi[4] = select(live, vi[4] + dv.l.y, vi[4]);
    vi[2] = select(live, vi[2] + dv.w.z, vi[2]), vi[5] = select(live, vi[5] + dv.l.z, vi[5]);
  }
}

/// Work of the joint torques over the step, with the mean speed.
template <class T>
inline T work(const LaneBlock& block, const T* change, double h, const double* tau) {
  const T* v = rows<T>(block.v);
  T sum(0.0);
  for (int k = 0; k < block.na; ++k) {
    const int dof = block.actuated_dof[k];
    sum = fma(load<T>(tau + k * kWidth<T>), fma(T(0.5), change[dof], v[dof]), sum);
  }
  return T(h) * sum;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
