#pragma once
// Kinematics and inertia of a chain on lanes: T is double or a Pack; N is the number of joints, or 0 for any number up
// to kMaxChainJoints. Everything is in base axes about the base's origin.

#include "engine/dynamics/chain_view.h"
#include "engine/lanes/trig.h"
#include "engine/lanes/vec.h"

// Before a loop over joints: straight code where N is given. Clang writes such code unasked, and will not be asked
// where the number is known at run time only.
#if defined(__clang__)
#define GRAZE_UNROLL_JOINTS
#else
#define GRAZE_UNROLL_JOINTS GRAZE_UNROLL
#endif

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

template <int N>
inline constexpr int kChainRoom = N > 0 ? N : kMaxChainJoints;
template <int N, class Number>
inline int chain_size(const ChainOf<Number>& chain) {
  return N > 0 ? N : chain.n;
}

template <class T, class Number>
inline Vec3T<T> constant_vec3(const Number* p) {
  return {lanes_of<T>(p[0]), lanes_of<T>(p[1]), lanes_of<T>(p[2])};
}
template <class T, class Number>
inline RotT<T> constant_matrix(const Number* p) {
  RotT<T> out;
  for (int k = 0; k < 9; ++k) out.m[k] = lanes_of<T>(p[k]);
  return out;
}

template <class T, class Number>
inline RotT<T> joint_rotation(const ChainJointOf<Number>& joint, const T& q) {
  if (joint.prismatic) return constant_matrix<T>(joint.fixed);
  T s, c;
  sin_cos(q, s, c);
  RotT<T> out;
  for (int k = 0; k < 9; ++k) {
    out.m[k] = fma(s, lanes_of<T>(joint.sine[k]), fma(c, lanes_of<T>(joint.cosine[k]), lanes_of<T>(joint.fixed[k])));
  }
  return out;
}

/// Position of the chain's tip. q: n rows.
template <class T, int N, class Number>
inline Vec3T<T> chain_tip(const ChainOf<Number>& chain, const T* q) {
  Vec3T<T> p = constant_vec3<T>(chain.tip);
  const int n = chain_size<N>(chain);
  GRAZE_UNROLL_JOINTS
  for (int i = n - 1; i >= 0; --i) {
    const ChainJointOf<Number>& joint = chain.joint[i];
    p = PoseT<T>{joint_rotation(joint, q[i]), constant_vec3<T>(joint.offset)} * p;
    if (joint.prismatic) p = axpy(q[i], constant_vec3<T>(joint.axis), p);
  }
  return p;
}

/// Origins and axes of the joints, and the tip.
template <class T, int N>
struct ChainPose {
  Vec3T<T> origin[kChainRoom<N>], axis[kChainRoom<N>];
  Vec3T<T> tip;
};

/// Walks the chain from the base. visit(i, R, p) gets the pose of each body.
template <class T, int N, class Number, class Visit>
inline void walk_chain(const ChainOf<Number>& chain, const T* q, ChainPose<T, N>& out, const Visit& visit) {
  PoseT<T> X{};
  const int n = chain_size<N>(chain);
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) {
    const ChainJointOf<Number>& joint = chain.joint[i];
    const Vec3T<T> offset = constant_vec3<T>(joint.offset), axis = constant_vec3<T>(joint.axis);
    const RotT<T> turn = joint_rotation(joint, q[i]);
    X.p = i == 0 ? offset : X * offset;
    out.axis[i] = i == 0 ? axis : X.R * axis;
    X.R = i == 0 ? turn : X.R * turn;
    if (joint.prismatic) X.p = axpy(q[i], out.axis[i], X.p);
    out.origin[i] = X.p;
    visit(i, X.R, X.p);
  }
  out.tip = X * constant_vec3<T>(chain.tip);
}

/// Column i of the Jacobian of the tip.
template <class T, int N, class Number>
inline Vec3T<T> tip_column(const ChainOf<Number>& chain, const ChainPose<T, N>& pose, int i) {
  return chain.joint[i].prismatic ? pose.axis[i] : cross(pose.axis[i], pose.tip - pose.origin[i]);
}

/// Position of the tip, and its Jacobian: n columns.
template <class T, int N, class Number>
inline Vec3T<T> chain_jacobian(const ChainOf<Number>& chain, const T* q, Vec3T<T>* J) {
  ChainPose<T, N> pose;
  walk_chain(chain, q, pose, [](int, const RotT<T>&, const Vec3T<T>&) {});
  const int n = chain_size<N>(chain);
  GRAZE_UNROLL_JOINTS
  for (int i = 0; i < n; ++i) J[i] = tip_column(chain, pose, i);
  return pose.tip;
}

/// Inertia of a body, or of several, about the base's origin. Value: of the mass, a double where all lanes share it.
template <class T, class Value = double>
struct ChainInertia {
  Value mass;
  Vec3T<T> moment;  // mass times centre, kg m
  T xx, xy, xz, yy, yz, zz;

  Vec3T<T> times(const Vec3T<T>& w) const {
    return {fma(xz, w.z, fma(xy, w.y, xx * w.x)), fma(yz, w.z, fma(yy, w.y, xy * w.x)),
            fma(zz, w.z, fma(yz, w.y, xz * w.x))};
  }
  ChainInertia& operator+=(const ChainInertia& b) {
    mass = mass + b.mass;
    moment += b.moment;
    xx += b.xx;
    xy += b.xy;
    xz += b.xz;
    yy += b.yy;
    yz += b.yz;
    zz += b.zz;
    return *this;
  }
};

template <class T, class Number>
inline ChainInertia<T, ValueOf<T, Number>> body_inertia(const ChainJointOf<Number>& body, const RotT<T>& R,
                                                        const Vec3T<T>& p) {
  constexpr int entry[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
  RotT<T> full;
  for (int k = 0; k < 9; ++k) full.m[k] = lanes_of<T>(body.inertia[entry[k]]);
  const RotT<T> RI = R * full;
  const Vec3T<T> c = PoseT<T>{R, p} * constant_vec3<T>(body.com), mc = lanes_of<T>(body.mass) * c;
  ChainInertia<T, ValueOf<T, Number>> out;
  out.mass = value_of<T>(body.mass);
  out.moment = mc;
  // R I R^T + m (c^2 1 - c c^T)
  out.xx = dot_add(RI.row(0), R.row(0), fma(mc.y, c.y, mc.z * c.z));
  out.yy = dot_add(RI.row(1), R.row(1), fma(mc.z, c.z, mc.x * c.x));
  out.zz = dot_add(RI.row(2), R.row(2), fma(mc.x, c.x, mc.y * c.y));
  out.xy = dot_add(RI.row(0), R.row(1), -(mc.x * c.y));
  out.xz = dot_add(RI.row(0), R.row(2), -(mc.x * c.z));
  out.yz = dot_add(RI.row(1), R.row(2), -(mc.y * c.z));
  return out;
}

/// Joint-space inertia with the base held still, by composite bodies (Featherstone, 2008, §6.2). `body`: inertia of
/// each body; spoiled. M: row-major with rows of kChainRoom<N>; the lower triangle is filled.
template <class T, int N, class Number>
inline void chain_inertia(const ChainOf<Number>& chain, const ChainPose<T, N>& pose,
                          ChainInertia<T, ValueOf<T, Number>>* body, T* M) {
  constexpr int row = kChainRoom<N>;
  const int n = chain_size<N>(chain);
  GRAZE_UNROLL_JOINTS
  for (int i = n - 1; i >= 0; --i) {
    if (i + 1 < n) body[i] += body[i + 1];
    const Vec3T<T>& a = pose.axis[i];
    Vec3T<T> force, moment;  // momentum of the composite body at unit joint velocity
    if (chain.joint[i].prismatic) {
      force = T(body[i].mass) * a;
      moment = cross(body[i].moment, a);
    } else {
      const Vec3T<T> v = cross(pose.origin[i], a);
      force = axpy(T(body[i].mass), v, cross(a, body[i].moment));
      moment = body[i].times(a) + cross(body[i].moment, v);
    }
    GRAZE_UNROLL_JOINTS
    for (int j = 0; j <= i; ++j) {
      const Vec3T<T>& b = pose.axis[j];
      M[i * row + j] =
          chain.joint[j].prismatic ? dot(b, force) : dot_add(b, moment, dot(cross(pose.origin[j], b), force));
    }
    M[i * row + i] += lanes_of<T>(chain.joint[i].armature);
  }
}

/// Solves A x = b for a symmetric positive definite A by L D L^T. A: lower triangle, row-major with rows of Row;
/// spoiled. b: right-hand side in, solution out.
template <class T, int N, int Row>
inline void solve_spd(int size, T* A, T* b) {
  const int n = N > 0 ? N : size;
  T inverse_d[Row];
  // Column by column; A[j][k] becomes L_jk.
  GRAZE_UNROLL_JOINTS
  for (int j = 0; j < n; ++j) {
    T d = A[j * Row + j];
    GRAZE_UNROLL_JOINTS
    for (int k = 0; k < j; ++k) {
      const T scaled = A[j * Row + k];  // L_jk D_k
      A[j * Row + k] = scaled * inverse_d[k];
      d = fnma(scaled, A[j * Row + k], d);
    }
    inverse_d[j] = recip(d);
    GRAZE_UNROLL_JOINTS
    for (int i = j + 1; i < n; ++i) {
      GRAZE_UNROLL_JOINTS
      for (int k = 0; k < j; ++k) A[i * Row + j] = fnma(A[i * Row + k], A[j * Row + k], A[i * Row + j]);
    }
    GRAZE_UNROLL_JOINTS
    for (int k = 0; k < j; ++k) b[j] = fnma(A[j * Row + k], b[k], b[j]);
  }
  GRAZE_UNROLL_JOINTS
  for (int i = n - 1; i >= 0; --i) {
    b[i] = b[i] * inverse_d[i];
    GRAZE_UNROLL_JOINTS
    for (int k = i + 1; k < n; ++k) b[i] = fnma(A[k * Row + i], b[k], b[i]);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
