#pragma once
// M = L^T D L with L unit lower triangular in the sparsity of the tree (Featherstone 2008, §6.5: without fill-in), and
// solves with it.

#include "engine/dynamics/tree.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Eliminates dof k from the rows of its ancestors at depth `from` and deeper, which become rows of the factor's rest.
template <class T>
inline void eliminate(const TreeT<T>& tree, int k, int from) {
  const TopologyView& t = tree.topology;
  T* row = tree.M + t.row[k];
  const int* chain = t.chain + t.row[k];
  const T inverse = tree.inverse_D[k];
  for (int d = t.dof_depth[k] - 1; d >= from; --d) {
    const T l = row[d] * inverse;
    T* target = tree.M + t.row[chain[d]];
    for (int e = 0; e <= d; ++e) target[e] = fnma(l, row[e], target[e]);
    row[d] = l;
  }
}

/// Eliminates joint k from the rows of the joints between it and its floating base.
template <class T>
inline void eliminate_joints(const TreeT<T>& tree, int k, const T& inverse) {
  const TopologyView& t = tree.topology;
  T* row = tree.M + t.row[k];
  const int* chain = t.chain + t.row[k];
  for (int d = t.dof_depth[k] - 1; d >= 6; --d) {
    const T l = row[d] * inverse;
    T* target = tree.M + t.row[chain[d]];
    GRAZE_UNROLL
    for (int e = 0; e < 6; ++e) target[e] = fnma(l, row[e], target[e]);
    for (int e = 6; e <= d; ++e) target[e] = fnma(l, row[e], target[e]);
    row[d] = l;
  }
}

/// What x_k takes from its ancestors at depth `from` and deeper.
template <class T>
inline T take_from_ancestors(const TopologyView& t, const T* M, int k, int from, T* x) {
  const T* row = M + t.row[k];
  const int* chain = t.chain + t.row[k];
  const T xk = x[k];
  for (int d = from; d < t.dof_depth[k]; ++d) x[chain[d]] = fnma(row[d], xk, x[chain[d]]);
  return xk;
}

/// Position of M's entry (d, e) in the six rows of a floating body.
constexpr int base_entry(int d, int e) { return d * (d + 1) / 2 + e; }

/// Factors the rows of a tree on a floating body, and x := D^-1 L^-T x on the way. The base's six rows and six of x,
/// which every joint updates, stay in registers.
template <class T>
inline void factor_floating(const TreeT<T>& tree, int base, T* x) {
  const TopologyView& t = tree.topology;
  T* rows = tree.M + t.row[t.v[base]];
  T* at_base = x + t.v[base];
  T B[21], X[6];
  GRAZE_UNROLL
  for (int k = 0; k < 6; ++k) {
    X[k] = at_base[k];
    GRAZE_UNROLL
    for (int d = 0; d <= k; ++d) B[base_entry(k, d)] = rows[base_entry(k, d)];
  }
  for (int body = t.end[base] - 1; body > base; --body) {
    const int k = t.v[body], depth = t.dof_depth[k];
    T* row = tree.M + t.row[k];
    const T inverse = tree.inverse_D[k] = recip(row[depth]);
    eliminate_joints(tree, k, inverse);
    const T xk = x[k];
    const int* chain = t.chain + t.row[k];
    for (int d = 6; d < depth; ++d) x[chain[d]] = fnma(row[d], xk, x[chain[d]]);
    x[k] = xk * inverse;
    GRAZE_UNROLL
    for (int d = 5; d >= 0; --d) {
      const T l = row[d] * inverse;
      GRAZE_UNROLL
      for (int e = 0; e <= d; ++e) B[base_entry(d, e)] = fnma(l, row[e], B[base_entry(d, e)]);
      row[d] = l;
      X[d] = fnma(l, xk, X[d]);
    }
  }
  GRAZE_UNROLL
  for (int k = 5; k >= 0; --k) {
    const T inverse = tree.inverse_D[t.v[base] + k] = recip(B[base_entry(k, k)]);
    GRAZE_UNROLL
    for (int d = k - 1; d >= 0; --d) {
      const T l = B[base_entry(k, d)] * inverse;
      GRAZE_UNROLL
      for (int e = 0; e <= d; ++e) B[base_entry(d, e)] = fnma(l, B[base_entry(k, e)], B[base_entry(d, e)]);
      B[base_entry(k, d)] = l;
      X[d] = fnma(l, X[k], X[d]);
    }
    at_base[k] = X[k] * inverse;
  }
  GRAZE_UNROLL
  for (int k = 0; k < 6; ++k) {
    GRAZE_UNROLL
    for (int d = 0; d <= k; ++d) rows[base_entry(k, d)] = B[base_entry(k, d)];
  }
}

/// Factors tree.M in place: below the diagonal L, on it D; inverse_D is filled. On the way x := D^-1 L^-T x.
template <class T>
inline void factor_and_solve(const TreeT<T>& tree, T* x) {
  const TopologyView& t = tree.topology;
  for (int i = t.bodies - 1; i >= 0; --i) {
    if (t.kind[i] == kFloating) {
      factor_floating(tree, i, x);
    } else if (t.root[i] < 0) {
      const int k = t.v[i];
      tree.inverse_D[k] = recip(tree.M[t.row[k] + t.dof_depth[k]]);
      eliminate(tree, k, 0);
      x[k] = take_from_ancestors(t, tree.M, k, 0, x) * tree.inverse_D[k];
    }
  }
}

/// x := L^-1 x for a tree on a floating body.
template <class T>
inline void solve_L_floating(const TopologyView& t, const T* M, int base, T* x) {
  T B[6];
  T* at_base = x + t.v[base];
  GRAZE_UNROLL
  for (int d = 0; d < 6; ++d) B[d] = at_base[d];
  const T* rows = M + t.row[t.v[base]];
  GRAZE_UNROLL
  for (int k = 1; k < 6; ++k) {
    GRAZE_UNROLL
    for (int d = 0; d < k; ++d) B[k] = fnma(rows[base_entry(k, d)], B[d], B[k]);
  }
  GRAZE_UNROLL
  for (int d = 0; d < 6; ++d) at_base[d] = B[d];
  for (int body = base + 1; body < t.end[base]; ++body) {
    const int k = t.v[body];
    const T* row = M + t.row[k];
    const int* chain = t.chain + t.row[k];
    // Two chains of sums, because a sum waits for the one before it.
    T even = fnma(row[4], B[4], fnma(row[2], B[2], fnma(row[0], B[0], x[k])));
    const T odd = fma(row[5], B[5], fma(row[3], B[3], row[1] * B[1]));
    for (int d = 6; d < t.dof_depth[k]; ++d) even = fnma(row[d], x[chain[d]], even);
    x[k] = even - odd;
  }
}

/// x := L^-1 x
template <class T>
inline void solve_L(const TreeT<T>& tree, T* x) {
  const TopologyView& t = tree.topology;
  for (int i = 0; i < t.bodies; ++i) {
    if (t.kind[i] == kFloating) {
      solve_L_floating(t, tree.M, i, x);
    } else if (t.root[i] < 0) {
      const int k = t.v[i];
      const T* row = tree.M + t.row[k];
      const int* chain = t.chain + t.row[k];
      T sum = x[k];
      for (int d = 0; d < t.dof_depth[k]; ++d) sum = fnma(row[d], x[chain[d]], sum);
      x[k] = sum;
    }
  }
}

/// z := L x
template <class T>
inline void times_L(const TreeT<T>& tree, const T* x, T* z) {
  const TopologyView& t = tree.topology;
  for (int k = 0; k < t.nv; ++k) {
    const T* row = tree.M + t.row[k];
    const int* chain = t.chain + t.row[k];
    T sum = x[k];
    for (int d = 0; d < t.dof_depth[k]; ++d) sum = fma(row[d], x[chain[d]], sum);
    z[k] = sum;
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
