#pragma once
// From v* to q+ and v+. The constraints' solve leaves v*, the velocity at q after gravity, torques, Coriolis forces and
// impulses. What free motion keeps is carried over to q+: the momentum of each floating tree, and the kinetic energy of
// every tree, to which neither Coriolis forces nor the change of M do work (docs/physics.md).

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A tree as one rigid body: its centre of mass from O and what inverts its inertia about it.
template <class T>
struct LockedT {
  T m, inverse_m, xx, yy, zz, xy, xz, yz;  // the inverse inertia
  Vec3T<T> c;

  explicit LockedT(const InertiaT<T>& C) : m(C.m), inverse_m(recip(C.m)), c(inverse_m * C.h) {
    const T hx = C.h.x * c.x, hy = C.h.y * c.y, hz = C.h.z * c.z;
    const T Ixx = C.xx - (hy + hz), Iyy = C.yy - (hx + hz), Izz = C.zz - (hx + hy);
    const T Ixy = fma(C.h.x, c.y, C.xy), Ixz = fma(C.h.x, c.z, C.xz), Iyz = fma(C.h.y, c.z, C.yz);
    xx = fnma(Iyz, Iyz, Iyy * Izz), xy = fnma(Ixy, Izz, Ixz * Iyz), xz = fnma(Ixz, Iyy, Ixy * Iyz);
    yy = fnma(Ixz, Ixz, Ixx * Izz), yz = fnma(Ixx, Iyz, Ixy * Ixz), zz = fnma(Ixy, Ixy, Ixx * Iyy);
    const T scale = recip(fma(Ixz, xz, fma(Ixy, xy, Ixx * xx)));
    xx *= scale, yy *= scale, zz *= scale, xy *= scale, xz *= scale, yz *= scale;
  }

  /// Angular momentum about the centre of mass, of momentum P about O.
  Vec3T<T> spin(const SpatialT<T>& P) const { return P.w - cross(c, P.l); }
  /// Angular velocity that has spin L.
  Vec3T<T> turn(const Vec3T<T>& L) const {
    return {fma(xz, L.z, fma(xy, L.y, xx * L.x)), fma(yz, L.z, fma(yy, L.y, xy * L.x)),
            fma(zz, L.z, fma(yz, L.y, xz * L.x))};
  }
  /// Velocity about O that has momentum P.
  SpatialT<T> velocity(const SpatialT<T>& P) const {
    const Vec3T<T> w = turn(spin(P));
    return {w, cross_add(c, w, inverse_m * P.l)};
  }
};

/// What each tree must have after the step.
template <class T>
struct BalanceT {
  // Floating trees, world axes:
  SpatialT<T> momentum;  // about O of the beginning
  Vec3T<T> origin;       // O of the beginning, m
  Vec3T<T> com;          // centre of mass of the tree, m
  // All trees:
  T kinetic2;  // twice the kinetic energy, J
};

/// Momentum about O that each floating tree must have after the step: what it had, gravity and contacts. Begins the
/// sum of its energy: of bias, gravity's part is no Coriolis force.
template <class T>
inline void expect_momentum(const LaneBlock& block, const TreeT<T>& tree, const ConstraintsT<T>& set, double h) {
  const TopologyView& t = tree.topology;
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  const Vec3T<T> pull{T(h) * tree.gravity[0], T(h) * tree.gravity[1], T(h) * tree.gravity[2]};
  for (int i = 0; i < t.bodies; ++i) {
    if (t.parent[i] < 0) balance[i].kinetic2 = T(0.0);
    if (t.kind[i] != kFloating) continue;
    const InertiaT<T>& C = tree.motion[i].C;
    SpatialT<T>& P = balance[i].momentum;
    balance[i].kinetic2 = dot(pull, P.l);
    balance[i].origin = tree.origin[i];
    P = {cross_add(C.h, pull, P.w), axpy(C.m, pull, P.l)};
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    for (int side = 0; side < 2; ++side) {
      const int body = side == 0 ? path.body_a : path.body_b;
      const int root = body < 0 ? -1 : t.root[body];
      if (root < 0) continue;
      const Vec3T<T> impulse = side == 0 ? to_world(c, c.lambda) : -to_world(c, c.lambda);
      SpatialT<T>& P = balance[root].momentum;
      P = {cross_add(c.p - tree.origin[root], impulse, P.w), P.l + impulse};
    }
  }
}

/// Row k of the lower triangle times v, the part below the diagonal twice: v_k times it, summed, is v . M v.
template <class T>
inline T twice_row(const TopologyView& t, const T* M, int k, const T* v) {
  const T* row = M + t.row[k];
  T half(0.0);
  for (int d = 0; d < t.dof_depth[k]; ++d) half = fma(row[d], v[t.chain[t.row[k] + d]], half);
  return fma(row[t.dof_depth[k]], v[k], half + half);
}

/// Kinetic energy that each tree must have after the step: that of v* at q, and what the Coriolis forces c took from
/// it, K(q, v*) + h c . (v + v*) / 2. To be called with D of q (`driven`: with M_kept, because drives are part of D); v
/// is v*, z is L v*, `before` the v of the beginning. Returns the work of gravity over the step, J.
template <class T>
inline T expect_energy(const LaneBlock& block, const TreeT<T>& tree, const T* v, const T* z, const T* before, double h,
                       bool driven) {
  const TopologyView& t = tree.topology;
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  const Vec3T<T> pull{T(h) * tree.gravity[0], T(h) * tree.gravity[1], T(h) * tree.gravity[2]};
  T gravity2(0.0);
  for (int i = 0; i < t.bodies; ++i) {
    const int first = t.v[i];
    T sum(0.0);
    if (t.kind[i] == kFloating) {
      // Gravity's power is that of the tree's linear momentum: of v, and of v*, whose Coriolis part is not yet
      // restored.
      const SpatialT<T>& P = balance[i].momentum;
      const Vec3T<T> coriolis = axpy(tree.motion[i].C.m, pull,
                                     T(h) * Vec3T<T>{tree.bias[first + 3], tree.bias[first + 4], tree.bias[first + 5]});
      sum = dot(pull, P.l - coriolis);
      gravity2 += sum + balance[i].kinetic2;
    } else if (t.root[i] < 0) {
      const MotionT<T>& motion = tree.motion[i];
      const InertiaT<T>& C = motion.C;
      sum = (v[first] + before[first]) * dot(pull, cross_add(motion.S.w, C.h, C.m * motion.S.l));
      gravity2 += sum;
    }
    for (int k = first; k < first + (t.kind[i] == kFloating ? 6 : 1); ++k) {
      sum = driven ? fma(v[k], twice_row(t, rows<T>(block.M_kept), k, v), sum)
                   : fma(tree.M[t.row[k] + t.dof_depth[k]] * z[k], z[k], sum);
      sum = fma(T(h) * tree.bias[k], v[k] + before[k], sum);
    }
    if (t.kind[i] != kFloating && !driven) sum = fnma(T(h) * tree.body[i].damping, v[first] * v[first], sum);
    balance[block.whole[i]].kinetic2 += sum;
  }
  return T(0.5) * gravity2;
}

/// Turned back about w by the angle h |w| / 2, which is at most an eighth of a turn: L as the body sees it at the
/// middle.
template <class T>
inline Vec3T<T> turned_back(const Vec3T<T>& L, const Vec3T<T>& w, double h) {
  const T x = T(0.25 * h * h) * norm2(w);
  // sin(a) / a and (1 - cos(a)) / a^2 of x = a^2, to rounding for a < 0.4.
  T s(1.0 / 6227020800), c(-1.0 / 87178291200);
  s = fma(s, x, T(-1.0 / 39916800)), c = fma(c, x, T(1.0 / 479001600));
  s = fma(s, x, T(1.0 / 362880)), c = fma(c, x, T(-1.0 / 3628800));
  s = fma(s, x, T(-1.0 / 5040)), c = fma(c, x, T(1.0 / 40320));
  s = fma(s, x, T(1.0 / 120)), c = fma(c, x, T(-1.0 / 720));
  s = fma(s, x, T(-1.0 / 6)), c = fma(c, x, T(1.0 / 24));
  s = fma(s, x, T(1.0)), c = fma(c, x, T(-0.5));
  const Vec3T<T> e = T(-0.5 * h) * w, eL = cross(e, L);
  return axpy(-c, cross(e, eL), axpy(s, eL, L));
}

/// What the angular velocity of the step's middle is more than v*'s, of a rigid body with spin L. v* has a whole
/// explicit step of gyroscopic acceleration, I w' = -w x L. The middle's solves the midpoint rule w = I^-1 exp(-h/2 w)
/// L, which is symmetric and so has no drift of energy; two corrections from the explicit one leave (h w)^4.
template <class T>
inline Vec3T<T> spin_of_middle(const LockedT<T>& locked, const Vec3T<T>& L, double h) {
  const Vec3T<T> start = locked.turn(L), slowing = T(h) * locked.turn(cross(start, L));
  Vec3T<T> w = axpy(T(-0.5), slowing, start);
  for (int k = 0; k < 2; ++k) w = locked.turn(turned_back(L, w, h));
  return w - start + slowing;
}

/// A base's quaternion turned at the angular velocity w for h seconds, in some lanes.
template <class T>
inline void turn_base(T* qi, const Vec3T<T>& w, double h, const mask_of<T>& live) {
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
}

/// q+ = q + h v*, floating trees turned at the angular velocity of the middle of the step. Their places follow in
/// restore. Lanes that are not `live` stay.
template <class T>
inline void integrate(const LaneBlock& block, const TreeT<T>& tree, double h, const mask_of<T>& live) {
  const TopologyView& t = tree.topology;
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  T* q = rows<T>(block.q);
  const T* v = rows<T>(block.v);
  for (int i = 0; i < t.bodies; ++i) {
    T* qi = q + t.q[i];
    const T* vi = v + t.v[i];
    if (t.kind[i] != kFloating) {
      qi[0] = select(live, fma(T(h), vi[0], qi[0]), qi[0]);
      continue;
    }
    const LockedT<T> locked(tree.motion[i].C);
    const Vec3T<T> w = Vec3T<T>{vi[0], vi[1], vi[2]} + spin_of_middle(locked, locked.spin(balance[i].momentum), h);
    turn_base<T>(qi, w, h, live);
    balance[i].com = tree.origin[i] + locked.c + (T(h) * locked.inverse_m) * balance[i].momentum.l;
  }
}

/// Bounds of s^2: what has come out of nothing is taken out whatever it is; what is missing is returned in part (ours).
inline constexpr double kLeastScale = 0.0, kMostScale = 1.5;

/// s^2 that gives internal motion of twice the energy `has` the energy `wanted`, as far as that is a correction.
template <class T>
inline T internal_scale(const T& wanted, const T& has, const T& whole) {
  const auto some = has > T(1e-12) * whole;
  const T ratio = select(some, wanted * recip(select(some, has, T(1.0))), T(1.0));
  return sqrt(min(max(ratio, T(kLeastScale)), T(kMostScale)));
}

/// restore of one floating tree.
template <class T>
inline void restore_floating(const TreeT<T>& tree, int base, const BalanceT<T>& to, const mask_of<T>& live,
                             const mask_of<T>& held, T* q, T* v) {
  const TopologyView& t = tree.topology;
  const LockedT<T> locked(tree.motion[base].C);
  T* place = q + t.q[base] + 4;
  const Vec3T<T> O = select(live, to.com - locked.c, to.origin);
  place[0] = O.x, place[1] = O.y, place[2] = O.z;
  tree.origin[base] = O;
  tree.pose[base].p = O;
  SpatialT<T> joints{{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};  // momentum of the joints' motion
  T joints2(0.0);                                                          // twice its energy
  for (int i = base + 1; i < t.end[base]; ++i) {
    tree.pose[i].p = tree.motion[i].p + O;
    const int dof = t.v[i], depth = t.dof_depth[dof];
    const T* row = tree.M + t.row[dof];  // its first six entries belong to the base
    const int* chain = t.chain + t.row[dof];
    joints.w = axpy(v[dof], Vec3T<T>{row[0], row[1], row[2]}, joints.w);
    joints.l = axpy(v[dof], Vec3T<T>{row[3], row[4], row[5]}, joints.l);
    T half = T(0.5) * row[depth] * v[dof];
    for (int d = 6; d < depth; ++d) half = fma(row[d], v[chain[d]], half);
    joints2 = fma(v[dof] + v[dof], half, joints2);
  }
  const SpatialT<T> momentum{to.momentum.w - cross(O - to.origin, to.momentum.l), to.momentum.l};
  const SpatialT<T> outer = locked.velocity(momentum), inner = locked.velocity(joints);
  const T outer2 = dot(outer, momentum), inner2 = joints2 - dot(inner, joints);
  const T s = select(held, T(1.0), internal_scale(to.kinetic2 - outer2, inner2, joints2));
  T* vb = v + t.v[base];
  const Vec3T<T> w = axpy(-s, inner.w, outer.w), l = axpy(-s, inner.l, outer.l);
  vb[0] = select(live, w.x, vb[0]), vb[1] = select(live, w.y, vb[1]), vb[2] = select(live, w.z, vb[2]);
  vb[3] = select(live, l.x, vb[3]), vb[4] = select(live, l.y, vb[4]), vb[5] = select(live, l.z, vb[5]);
  for (int k = t.v[base] + 6; k < t.v[base] + 5 + t.end[base] - base; ++k) v[k] = select(live, s * v[k], v[k]);
}

/// Puts the floating trees where their centres of mass must be, sets them to the momentum they must have, by a rigid
/// motion of the whole tree (of second order in h), and all trees their kinetic energy, by a factor on the motion
/// within them that has no momentum. After update_poses and update_mass of q+.
template <class T>
inline void restore(const LaneBlock& block, const TreeT<T>& tree, const mask_of<T>& live) {
  const TopologyView& t = tree.topology;
  BalanceT<T>* balance = rows<BalanceT<T>>(block.balance);
  T *q = rows<T>(block.q), *v = rows<T>(block.v);
  // Prescribed motion keeps its speed.
  unsigned prescribed = 0;
  for (int i = 0; i < t.bodies; ++i) prescribed |= block.locked[i];
  const auto held = mask_from_bits<T>(prescribed);
  T* now2 = rows<T>(block.scratch);  // twice the kinetic energy of trees that stand on the world
  for (int i = 0; i < t.bodies; ++i) {
    if (t.root[i] >= 0) continue;
    const T* row = tree.M + t.row[t.v[i]];
    const int depth = t.dof_depth[t.v[i]];
    T half = T(0.5) * row[depth] * v[t.v[i]];
    for (int d = 0; d < depth; ++d) half = fma(row[d], v[t.chain[t.row[t.v[i]] + d]], half);
    if (t.parent[i] < 0) now2[i] = T(0.0);
    now2[block.whole[i]] = fma(v[t.v[i]] + v[t.v[i]], half, now2[block.whole[i]]);
  }
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] == kFloating) {
      restore_floating<T>(tree, i, balance[i], live, held, q, v);
      continue;
    }
    if (t.root[i] >= 0) continue;
    T& s = balance[i].momentum.w.x;
    const BalanceT<T>& top = balance[block.whole[i]];
    if (t.parent[i] < 0) s = select(held, T(1.0), internal_scale(top.kinetic2, now2[i], now2[i]));
    v[t.v[i]] = select(live, top.momentum.w.x * v[t.v[i]], v[t.v[i]]);
  }
}

/// What implicit dampers give over the step where the speed changes its sign in it, with the mean speed as for all
/// work: their torque is that of the end, which points the other way for a part of the way. Each takes energy at the
/// speed of the end; the work of what turned the joint is too large by as much. `change`: of v.
template <class T>
inline T given_by_dampers(const LaneBlock& block, const TreeT<T>& tree, const T* change, double h) {
  const T* v = rows<T>(block.v);
  T sum(0.0);
  for (int i = 0; i < tree.topology.bodies; ++i) {
    if (tree.topology.kind[i] == kFloating) continue;
    const int k = tree.topology.v[i];
    const T end = v[k] + change[k], mean = fma(T(0.5), change[k], v[k]);
    sum += max(-(tree.body[i].damping * end * mean), T(0.0));
  }
  return T(h) * sum;
}

/// Work of the joint torques over the step, with the mean speed.
template <class T>
inline T work(const LaneBlock& block, const T* change, double h, const DriveView& drive) {
  const T* v = rows<T>(block.v);
  T sum(0.0);
  for (int k = 0; k < block.na; ++k) {
    const int dof = block.actuated_dof[k];
    const T tau = drive.q ? rows<T>(block.servo)[kServoRows * k + 2] : load<T>(drive.tau + k * kWidth<T>);
    sum = fma(tau, fma(T(0.5), change[dof], v[dof]), sum);
  }
  return T(h) * sum;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
