#pragma once
// Kinematics, mass matrix and bias forces of a block of trees. World axes, about O (see topology.h). Spatial vectors
// are (angular, linear); the motion subspace of joint i at p_i with axis a_i is S_i = (a_i, p_i x a_i) if revolute, (0,
// a_i) if prismatic. A joint turns about the z axis of its canonical frame, so that its rotation mixes two columns and
// its axis in the world is the third.
//
// A drive's rotor turns about its joint's axis alone: it has a term on the diagonal of M and its kinetic energy, but no
// gyroscopic forces and no part in the momentum of the tree, as if it sat in the world. Its mass is its link's.

#include "engine/dynamics/topology_view.h"
#include "engine/lanes/trig.h"
#include "engine/lanes/vec.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <class T>
struct SpatialT {
  Vec3T<T> w, l;  // angular and linear part

  friend SpatialT operator+(const SpatialT& a, const SpatialT& b) { return {a.w + b.w, a.l + b.l}; }
};

/// Rigid-body inertia about O: mass, first moment m c, and the symmetric tensor about O (xx, yy, zz, xy, xz, yz).
template <class T>
struct InertiaT {
  T m;
  Vec3T<T> h;
  T xx, yy, zz, xy, xz, yz;
};

/// Numbers of one body, which differ from lane to lane but not in time.
template <class T>
struct BodyT {
  RotT<T> R_PC;                    // canonical frame in the parent's body frame, q = 0
  Vec3T<T> p_PC;                   // m
  RotT<T> R_CB;                    // body frame in the canonical frame
  T mass;                          // kg
  Vec3T<T> com;                    // body frame, m
  T ixx, iyy, izz, ixy, ixz, iyz;  // about com, body axes, kg m^2
  T damping;                       // N m s/rad
  T armature;                      // kg m^2 or kg: of the drive's rotor, as the joint feels it
};

/// What a step computes about one body.
template <class T>
struct MotionT {
  Vec3T<T> p;     // origin of the body frame from O, world axes, m
  SpatialT<T> S;  // motion subspace; not for floating bodies
  SpatialT<T> V;  // spatial velocity about O
  SpatialT<T> A;  // spatial acceleration with v' = 0, gravity as upward acceleration; of bodies with a second child
  SpatialT<T> F;  // force that the subtree needs
  InertiaT<T> I;  // of the body
  // Of the subtree: the composite rigid body; of floating bodies and all of trees that stand on the world, and on the
  // way of some others.
  InertiaT<T> C;
};

/// A block of trees: tables, numbers and working memory (owned by the caller).
template <class T>
struct TreeT {
  TopologyView topology;
  const BodyT<T>* body;
  const T* gravity;  // 3, m/s^2
  MotionT<T>* motion;
  PoseT<T>* pose;    // world poses of the body frames
  Vec3T<T>* origin;  // O in the world, per body that is a root; unused otherwise
  T* M;              // row[nv] entries; becomes L and D
  T* inverse_D;      // nv
  T* bias;           // nv
};

template <class T>
inline SpatialT<T> operator*(const InertiaT<T>& I, const SpatialT<T>& V) {
  SpatialT<T> out;
  out.w.x = fma(I.xz, V.w.z, fma(I.xy, V.w.y, I.xx * V.w.x));
  out.w.y = fma(I.yz, V.w.z, fma(I.yy, V.w.y, I.xy * V.w.x));
  out.w.z = fma(I.zz, V.w.z, fma(I.yz, V.w.y, I.xz * V.w.x));
  out.w = cross_add(I.h, V.l, out.w);
  out.l = cross_add(V.w, I.h, I.m * V.l);
  return out;
}

template <class T>
inline T dot(const SpatialT<T>& a, const SpatialT<T>& b) {
  return dot_add(a.l, b.l, dot(a.w, b.w));
}

/// V x S for motions.
template <class T>
inline SpatialT<T> cross_motion(const SpatialT<T>& V, const SpatialT<T>& S) {
  return {cross(V.w, S.w), cross_add(V.w, S.l, cross(V.l, S.w))};
}

/// V x F + G for forces.
template <class T>
inline SpatialT<T> cross_force_add(const SpatialT<T>& V, const SpatialT<T>& F, const SpatialT<T>& G) {
  return {cross_add(V.w, F.w, cross_add(V.l, F.l, G.w)), cross_add(V.w, F.l, G.l)};
}

/// Inertia of a body about O in world axes: R I_com R^T + m (c.c 1 - c c^T).
template <class T>
inline InertiaT<T> inertia_about_origin(const BodyT<T>& body, const RotT<T>& R, const Vec3T<T>& p) {
  const Vec3T<T> c = p + R * body.com;
  InertiaT<T> I;
  I.m = body.mass;
  I.h = body.mass * c;
  const Vec3T<T> i0{body.ixx, body.ixy, body.ixz}, i1{body.ixy, body.iyy, body.iyz}, i2{body.ixz, body.iyz, body.izz};
  const Vec3T<T> rx = R.row(0), ry = R.row(1), rz = R.row(2);
  const Vec3T<T> x{dot(i0, rx), dot(i1, rx), dot(i2, rx)};
  const Vec3T<T> y{dot(i0, ry), dot(i1, ry), dot(i2, ry)};
  const Vec3T<T> z{dot(i0, rz), dot(i1, rz), dot(i2, rz)};
  const T hx = I.h.x * c.x, hy = I.h.y * c.y, hz = I.h.z * c.z;
  I.xx = dot_add(rx, x, hy + hz);
  I.yy = dot_add(ry, y, hx + hz);
  I.zz = dot_add(rz, z, hx + hy);
  I.xy = dot_add(rx, y, -(I.h.x * c.y));
  I.xz = dot_add(rx, z, -(I.h.x * c.z));
  I.yz = dot_add(ry, z, -(I.h.y * c.z));
  return I;
}

template <class T>
inline InertiaT<T> operator+(const InertiaT<T>& a, const InertiaT<T>& b) {
  return {a.m + b.m, a.h + b.h, a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
}

/// Rotation of a unit quaternion w, x, y, z.
template <class T>
inline RotT<T> rotation(const T& w, const T& x, const T& y, const T& z) {
  const T x2 = x + x, y2 = y + y, z2 = z + z;
  RotT<T> R;
  R.m[0] = fnma(y, y2, fnma(z, z2, T(1.0)));
  R.m[1] = fnma(w, z2, x * y2);
  R.m[2] = fma(w, y2, x * z2);
  R.m[3] = fma(w, z2, x * y2);
  R.m[4] = fnma(x, x2, fnma(z, z2, T(1.0)));
  R.m[5] = fnma(w, x2, y * z2);
  R.m[6] = fnma(w, y2, x * z2);
  R.m[7] = fma(w, x2, y * z2);
  R.m[8] = fnma(x, x2, fnma(y, y2, T(1.0)));
  return R;
}

/// Turns the first two columns of R by the angle about the third.
template <class T>
inline void turn(RotT<T>& R, const T& angle) {
  T s, c;
  sin_cos(angle, s, c);
  for (int i = 0; i < 3; ++i) {
    const T a = R.m[3 * i], b = R.m[3 * i + 1];
    R.m[3 * i] = fma(b, s, a * c);
    R.m[3 * i + 1] = fnma(a, s, b * c);
  }
}

/// Pose of a body with its position from O instead of the world's origin.
template <class T>
using FromOriginT = PoseT<T>;

/// Body frame of joint i; fills its motion subspace. `before`: body i - 1.
template <class T>
inline FromOriginT<T> place_body(const TreeT<T>& tree, int i, const T& q, const FromOriginT<T>& before) {
  const TopologyView& t = tree.topology;
  const BodyT<T>& body = tree.body[i];
  SpatialT<T>& S = tree.motion[i].S;
  const int parent = t.parent[i];
  RotT<T> R = body.R_PC;
  Vec3T<T> p = body.p_PC;
  if (parent >= 0 && parent == i - 1) {
    p = before * p;
    R = before.R * R;
  } else if (parent >= 0) {
    const RotT<T>& above = tree.pose[parent].R;
    p = tree.motion[parent].p + above * p;
    R = above * R;
  }
  const Vec3T<T> axis = R.column(2);
  if (t.kind[i] == kRevolute) {
    S = {axis, cross(p, axis)};
    turn(R, q);
  } else {
    p = axpy(q, axis, p);
    S = {{T(0.0), T(0.0), T(0.0)}, axis};
  }
  return {R * body.R_CB, p};
}

/// Poses, motion subspaces and own inertias of all bodies for q. One pass, because the numbers of a block do not fit
/// the nearest cache.
template <class T>
inline void update_poses(const TreeT<T>& tree, const T* q) {
  const TopologyView& t = tree.topology;
  FromOriginT<T> X;
  for (int i = 0; i < t.bodies; ++i) {
    MotionT<T>& motion = tree.motion[i];
    const T* qi = q + t.q[i];
    if (t.kind[i] == kFloating) {
      X = {rotation(qi[0], qi[1], qi[2], qi[3]), {T(0.0), T(0.0), T(0.0)}};
      tree.origin[i] = {qi[4], qi[5], qi[6]};
    } else {
      X = place_body(tree, i, *qi, X);
    }
    motion.p = X.p;
    tree.pose[i].R = X.R;
    tree.pose[i].p = t.root[i] < 0 ? X.p : X.p + tree.origin[t.root[i]];
    motion.I = inertia_about_origin(tree.body[i], X.R, X.p);
  }
}

/// Rows of M of a joint: S_j . (I S_i) up the ancestors.
template <class T>
inline void mass_row(const TreeT<T>& tree, int i, const InertiaT<T>& C) {
  const TopologyView& t = tree.topology;
  const SpatialT<T> S = tree.motion[i].S, force = C * S;
  const int dof = t.v[i];
  T* row = tree.M + t.row[dof];
  row[t.dof_depth[dof]] = dot(S, force) + tree.body[i].armature;
  for (int j = t.parent[i]; j >= 0; j = t.parent[j]) {
    T* at = row + t.dof_depth[t.v[j]];
    if (t.kind[j] == kFloating) {
      at[0] = force.w.x, at[1] = force.w.y, at[2] = force.w.z;
      at[3] = force.l.x, at[4] = force.l.y, at[5] = force.l.z;
    } else {
      at[0] = dot(tree.motion[j].S, force);
    }
  }
}

/// Whether body i is the only child of the body before it: then what it passes on need not go through memory.
inline bool continues_limb(const TopologyView& t, int i) {
  return i > 0 && t.parent[i] == i - 1 && t.last_child[i - 1] == i;
}

/// The six rows of a floating body: its subtree's inertia as a 6 x 6 matrix.
template <class T>
inline void mass_rows_of_base(const TreeT<T>& tree, int i) {
  const TopologyView& t = tree.topology;
  const InertiaT<T>& I = tree.motion[i].C;
  T* M = tree.M + t.row[t.v[i]];  // rows of 1, 2, 3, 4, 5 and 6 entries
  const T zero(0.0);
  M[0] = I.xx;
  M[1] = I.xy, M[2] = I.yy;
  M[3] = I.xz, M[4] = I.yz, M[5] = I.zz;
  M[6] = zero, M[7] = I.h.z, M[8] = -I.h.y, M[9] = I.m;
  M[10] = -I.h.z, M[11] = zero, M[12] = I.h.x, M[13] = zero, M[14] = I.m;
  M[15] = I.h.y, M[16] = -I.h.x, M[17] = zero, M[18] = zero, M[19] = zero, M[20] = I.m;
}

/// From the leaves to the bases the inertias of the subtrees, and M. After update_poses.
template <class T>
inline void update_mass(const TreeT<T>& tree) {
  const TopologyView& t = tree.topology;
  InertiaT<T> C;
  bool carried = false;  // C is that of body i's only child
  for (int i = t.bodies - 1; i >= 0; --i) {
    if (t.kind[i] == kFloating) {
      if (t.last_child[i] < 0) tree.motion[i].C = tree.motion[i].I;
      mass_rows_of_base(tree, i);
      continue;
    }
    if (carried) {
      C = tree.motion[i].I + C;
    } else {
      const InertiaT<T>* own = t.last_child[i] < 0 ? &tree.motion[i].I : &tree.motion[i].C;
      C = *own;
    }
    mass_row(tree, i, C);
    const int parent = t.parent[i];
    carried = continues_limb(t, i) && t.kind[parent] != kFloating;
    if (t.root[i] < 0) tree.motion[i].C = C;
    if (parent >= 0 && !carried) {
      MotionT<T>& above = tree.motion[parent];
      const InertiaT<T>* sum = t.last_child[parent] == i ? &above.I : &above.C;
      above.C = *sum + C;
    }
  }
}

/// Potential energy of all bodies, J.
template <class T>
inline T potential_energy(const TreeT<T>& tree) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> g{tree.gravity[0], tree.gravity[1], tree.gravity[2]};
  T energy(0.0);
  for (int i = 0; i < t.bodies; ++i) {
    if (t.parent[i] >= 0) continue;
    const InertiaT<T>& C = tree.motion[i].C;
    energy -= dot(g, C.h);
    if (t.root[i] >= 0) energy = fnma(C.m, dot(g, tree.origin[i]), energy);
  }
  return energy;
}

/// Momentum about O of the tree on a floating body: the six base rows of M, times v.
template <class T>
inline SpatialT<T> momentum_of_tree(const TreeT<T>& tree, int base, const T* v) {
  const TopologyView& t = tree.topology;
  const T* vb = v + t.v[base];
  SpatialT<T> P = tree.motion[base].C * SpatialT<T>{{vb[0], vb[1], vb[2]}, {vb[3], vb[4], vb[5]}};
  for (int i = base + 1; i < t.bodies; ++i) {
    if (t.root[i] != base) continue;
    const int dof = t.v[i];
    const T* row = tree.M + t.row[dof];  // its first six entries belong to the base
    P.w = axpy(v[dof], Vec3T<T>{row[0], row[1], row[2]}, P.w);
    P.l = axpy(v[dof], Vec3T<T>{row[3], row[4], row[5]}, P.l);
  }
  return P;
}

/// What a body passes on to its children in update_bias: spatial velocity and acceleration.
template <class T>
struct TwistT {
  SpatialT<T> V, A;
};

/// Velocity and acceleration of body i with v' = 0. `before`: those of body i - 1.
template <class T>
inline TwistT<T> twist_of(const TreeT<T>& tree, int i, const T* v, const Vec3T<T>& up, const TwistT<T>& before) {
  const TopologyView& t = tree.topology;
  const T* vi = v + t.v[i];
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  if (t.kind[i] == kFloating) {
    const Vec3T<T> w{vi[0], vi[1], vi[2]}, l{vi[3], vi[4], vi[5]};
    // The state's linear acceleration is the classical one of the moving point O; the spatial one is less by w x v.
    return {{w, l}, {zero, cross_add(l, w, up)}};
  }
  const SpatialT<T>& S = tree.motion[i].S;
  const SpatialT<T> rate{*vi * S.w, *vi * S.l};
  const int parent = t.parent[i];
  if (parent < 0) return {rate, {zero, up}};
  if (parent == i - 1) return {before.V + rate, before.A + cross_motion(before.V, rate)};
  const MotionT<T>& above = tree.motion[parent];
  return {above.V + rate, above.A + cross_motion(above.V, rate)};
}

/// The forces motion.F that the bodies need, summed from the leaves to the bases (F is then of the subtree, on the way
/// of some), as joint forces: out (nv).
template <class T>
inline void gather_forces(const TreeT<T>& tree, T* out) {
  const TopologyView& t = tree.topology;
  for (int i = t.bodies - 1; i >= 0; --i) {
    SpatialT<T> F = tree.motion[i].F;
    T* own = out + t.v[i];
    if (t.kind[i] == kFloating) {
      own[0] = F.w.x, own[1] = F.w.y, own[2] = F.w.z;
      own[3] = F.l.x, own[4] = F.l.y, own[5] = F.l.z;
      continue;
    }
    own[0] = dot(tree.motion[i].S, F);
    while (continues_limb(t, i) && t.kind[i - 1] != kFloating) {
      --i;
      F = tree.motion[i].F + F;
      out[t.v[i]] = dot(tree.motion[i].S, F);
    }
    if (t.parent[i] >= 0) tree.motion[t.parent[i]].F = tree.motion[t.parent[i]].F + F;
  }
}

/// Velocities, accelerations with v' = 0, forces and from them the bias (M v' + bias = tau). Returns the kinetic
/// energy. After update_poses and update_mass.
template <class T>
inline T update_bias(const TreeT<T>& tree, const T* v) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> up{-tree.gravity[0], -tree.gravity[1], -tree.gravity[2]};
  T energy(0.0);
  TwistT<T> twist{};
  for (int i = 0; i < t.bodies; ++i) {
    MotionT<T>& motion = tree.motion[i];
    twist = twist_of(tree, i, v, up, twist);
    const InertiaT<T> I = motion.I;
    const SpatialT<T> momentum = I * twist.V;
    const T speed = v[t.v[i]];  // of a joint; floating bodies have no rotor
    energy = fma(T(0.5), fma(tree.body[i].armature * speed, speed, dot(twist.V, momentum)), energy);
    motion.F = cross_force_add(twist.V, momentum, I * twist.A);
    motion.V = twist.V;
    if (t.last_child[i] > i + 1) motion.A = twist.A;
  }
  gather_forces(tree, tree.bias);
  return energy;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
