#pragma once
// Articulated-body inertias (Featherstone 2008, §7.3): what the parts of a tree below a joint are to the body above it,
// where the joint gives way. Of M = L^T D L the D of a joint is what its own axis feels of that; L needs not be known.
// Spatial vectors about O, world axes, (angular, linear).

#include "engine/dynamics/factor.h"
#include "engine/dynamics/frames.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// 6 x 6; row r and column c at 6 r + c. From a twist to a wrench.
template <class T>
struct SpatialMatrixT {
  T at[36];
};

template <class T>
inline void to_array(const SpatialT<T>& a, T (&out)[6]) {
  out[0] = a.w.x, out[1] = a.w.y, out[2] = a.w.z, out[3] = a.l.x, out[4] = a.l.y, out[5] = a.l.z;
}
template <class T>
inline SpatialT<T> to_spatial(const T (&a)[6]) {
  return {{a[0], a[1], a[2]}, {a[3], a[4], a[5]}};
}

template <class T>
inline void set_inertia(const InertiaT<T>& I, SpatialMatrixT<T>& A) {
  const T zero(0.0);
  const Vec3T<T>&h = I.h, minus = -I.h;
  const T rows[6][6] = {{I.xx, I.xy, I.xz, zero, minus.z, h.y}, {I.xy, I.yy, I.yz, h.z, zero, minus.x},
                        {I.xz, I.yz, I.zz, minus.y, h.x, zero}, {zero, h.z, minus.y, I.m, zero, zero},
                        {minus.z, zero, h.x, zero, I.m, zero},  {h.y, minus.x, zero, zero, zero, I.m}};
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) A.at[6 * r + c] = rows[r][c];
  }
}

/// x := A^-1 x. A, whose symmetric part is positive definite, is eliminated in place.
template <class T>
inline void solve_in_place(SpatialMatrixT<T>& matrix, T (&x)[6]) {
  T* A = matrix.at;
  for (int k = 0; k < 6; ++k) {
    A[7 * k] = recip(A[7 * k]);
    for (int r = k + 1; r < 6; ++r) {
      const T share = A[6 * r + k] * A[7 * k];
      for (int c = k + 1; c < 6; ++c) A[6 * r + c] = fnma(share, A[6 * k + c], A[6 * r + c]);
      x[r] = fnma(share, x[k], x[r]);
    }
  }
  for (int k = 5; k >= 0; --k) {
    for (int c = k + 1; c < 6; ++c) x[k] = fnma(A[6 * k + c], x[c], x[k]);
    x[k] *= A[7 * k];
  }
}

/// A joint with what is below it: A S, A^T S and S . A S.
template <class T>
struct JointShareT {
  SpatialT<T> U, W;
  T d;
};

template <class T>
inline JointShareT<T> share_of_joint(const SpatialMatrixT<T>& A, const SpatialT<T>& S) {
  T s[6], U[6], W[6];
  to_array(S, s);
  for (int r = 0; r < 6; ++r) {
    T u = A.at[6 * r] * s[0], w = A.at[r] * s[0];
    for (int k = 1; k < 6; ++k) u = fma(A.at[6 * r + k], s[k], u), w = fma(A.at[6 * k + r], s[k], w);
    U[r] = u, W[r] = w;
  }
  const SpatialT<T> column = to_spatial(U);
  return {column, to_spatial(W), dot(S, column)};
}

/// above += A - U W^T / d: what the body above the joint feels of A. inverse: 1 / d, of d with what the joint itself
/// adds.
template <class T>
inline void add_through_joint(const SpatialMatrixT<T>& A, const JointShareT<T>& share, const T& inverse,
                              SpatialMatrixT<T>& above) {
  T U[6], W[6];
  to_array(share.U, U), to_array(share.W, W);
  for (int r = 0; r < 6; ++r) {
    const T scaled = U[r] * inverse;
    for (int k = 0; k < 6; ++k) above.at[6 * r + k] += fnma(scaled, W[k], A.at[6 * r + k]);
  }
}

/// Per joint's body U of the tree alone. diagonal: per degree of freedom, what M has there beside the bodies' inertias.
/// A: per body, working memory. After update_poses.
template <class T>
inline void articulate(const TreeT<T>& tree, const T* diagonal, SpatialMatrixT<T>* A, SpatialT<T>* U) {
  const TopologyView& t = tree.topology;
  for (int i = 0; i < t.bodies; ++i) set_inertia(tree.motion[i].I, A[i]);
  for (int i = t.bodies - 1; i >= 0; --i) {
    if (t.kind[i] == kFloating) continue;
    const JointShareT<T> share = share_of_joint(A[i], tree.motion[i].S);
    U[i] = share.U;
    if (t.parent[i] >= 0) add_through_joint(A[i], share, recip(share.d + diagonal[t.v[i]]), A[t.parent[i]]);
  }
}

/// Calls put(dof, x) for each element of x = L^-T g, from the leaves to the bases: what M^-1 = L^-1 D^-1 L^-T makes of
/// joint forces first. F: per body, working memory. After articulate and the factorisation of M.
template <class T, class Put>
inline void visit_forces(const TreeT<T>& tree, const SpatialT<T>* U, const T* g, SpatialT<T>* F, const Put& put) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
  for (int i = 0; i < t.bodies; ++i) F[i] = {none, none};
  for (int i = t.bodies - 1; i >= 0; --i) {
    const int k = t.v[i];
    if (t.kind[i] == kFloating) {
      T B[6], f[6];
      to_array(F[i], f);
      for (int d = 0; d < 6; ++d) B[d] = g[k + d] - f[d];
      const T* rows = tree.M + t.row[k];
      for (int c = 5; c >= 0; --c) {
        for (int d = 0; d < c; ++d) B[d] = fnma(rows[base_entry(c, d)], B[c], B[d]);
        put(k + c, B[c]);
      }
      continue;
    }
    const T x = g[k] - dot(tree.motion[i].S, F[i]);
    put(k, x);
    if (t.parent[i] < 0) continue;
    SpatialT<T>& above = F[t.parent[i]];
    const T given = x * tree.inverse_D[k];
    above.w += axpy(given, U[i].w, F[i].w), above.l += axpy(given, U[i].l, F[i].l);
  }
}

/// L^-T J^T of a point of one body, three columns at a time, from the body to the base: a force on it, of which each
/// joint gives way to its share, goes up the tree. put(dof, y) for each degree of freedom on the way. c: the point and
/// its axes; side: +1 or -1. After articulate and the factorisation of M.
template <class T, class Put>
inline void visit_rows(const TreeT<T>& tree, const SpatialT<T>* U, int body, double side, const ContactFrameT<T>& c,
                       const Put& put) {
  const TopologyView& t = tree.topology;
  const Vec3T<T> r = from_origin(tree, body, c.p);
  const T sign(side);
  SpatialT<T> f[3] = {{cross(r, c.n), c.n}, {cross(r, c.s), c.s}, {cross(r, c.t), c.t}};
  for (SpatialT<T>& of : f) of = {sign * of.w, sign * of.l};
  int i = body;
  for (; i >= 0 && t.kind[i] != kFloating; i = t.parent[i]) {
    const int k = t.v[i];
    const SpatialT<T>& S = tree.motion[i].S;
    const Vec3T<T> y{dot(S, f[0]), dot(S, f[1]), dot(S, f[2])};
    put(k, y);
    const Vec3T<T> gives = -tree.inverse_D[k] * y;
    f[0] = {axpy(gives.x, U[i].w, f[0].w), axpy(gives.x, U[i].l, f[0].l)};
    f[1] = {axpy(gives.y, U[i].w, f[1].w), axpy(gives.y, U[i].l, f[1].l)};
    f[2] = {axpy(gives.z, U[i].w, f[2].w), axpy(gives.z, U[i].l, f[2].l)};
  }
  if (i < 0) return;
  Vec3T<T> B[6];
  T n[6], s[6], x[6];
  to_array(f[0], n), to_array(f[1], s), to_array(f[2], x);
  for (int d = 0; d < 6; ++d) B[d] = {n[d], s[d], x[d]};
  const T* rows = tree.M + t.row[t.v[i]];
  for (int k = 5; k >= 0; --k) {
    for (int d = 0; d < k; ++d) {
      const T& l = rows[base_entry(k, d)];
      B[d] = {fnma(l, B[k].x, B[d].x), fnma(l, B[k].y, B[d].y), fnma(l, B[k].z, B[d].z)};
    }
    put(t.v[i] + k, B[k]);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
