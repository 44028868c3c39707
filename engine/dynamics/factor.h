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
  for (int d = t.dof_depth[k] - 1; d >= from; --d) {
    const T l = row[d] * tree.inverse_D[k];
    T* target = tree.M + t.row[chain[d]];
    for (int e = 0; e <= d; ++e) target[e] = fnma(l, row[e], target[e]);
    row[d] = l;
  }
}

/// Position of M's entry (d, e) in the six rows of a floating body.
constexpr int base_entry(int d, int e) { return d * (d + 1) / 2 + e; }

/// A tree on a floating body. The base's six rows, which every joint updates, stay in registers.
template <class T>
inline void factor_floating(const TreeT<T>& tree, int base) {
  const TopologyView& t = tree.topology;
  T* rows = tree.M + t.row[t.v[base]];
  T B[21];
  for (int i = 0; i < 21; ++i) B[i] = rows[i];
  for (int body = t.end[base] - 1; body > base; --body) {
    const int k = t.v[body];
    T* row = tree.M + t.row[k];
    const T inverse = tree.inverse_D[k] = recip(row[t.dof_depth[k]]);
    eliminate(tree, k, 6);
    GRAZE_UNROLL
    for (int d = 5; d >= 0; --d) {
      const T l = row[d] * inverse;
      GRAZE_UNROLL
      for (int e = 0; e <= d; ++e) B[base_entry(d, e)] = fnma(l, row[e], B[base_entry(d, e)]);
      row[d] = l;
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
    }
  }
  for (int i = 0; i < 21; ++i) rows[i] = B[i];
}

/// Factors tree.M in place: below the diagonal L, on it D; inverse_D is filled.
template <class T>
inline void factor(const TreeT<T>& tree) {
  const TopologyView& t = tree.topology;
  for (int i = t.bodies - 1; i >= 0; --i) {
    if (t.kind[i] == kFloating) {
      factor_floating(tree, i);
    } else if (t.root[i] < 0) {
      const int k = t.v[i];
      tree.inverse_D[k] = recip(tree.M[t.row[k] + t.dof_depth[k]]);
      eliminate(tree, k, 0);
    }
  }
}

/// x := L^-T x
template <class T>
inline void solve_LT(const TreeT<T>& tree, T* x) {
  const TopologyView& t = tree.topology;
  for (int k = t.nv - 1; k >= 0; --k) {
    const T* row = tree.M + t.row[k];
    const int* chain = t.chain + t.row[k];
    const T xk = x[k];
    for (int d = 0; d < t.dof_depth[k]; ++d) x[chain[d]] = fnma(row[d], xk, x[chain[d]]);
  }
}

/// x := L^-1 x
template <class T>
inline void solve_L(const TreeT<T>& tree, T* x) {
  const TopologyView& t = tree.topology;
  for (int k = 0; k < t.nv; ++k) {
    const T* row = tree.M + t.row[k];
    const int* chain = t.chain + t.row[k];
    T sum = x[k];
    for (int d = 0; d < t.dof_depth[k]; ++d) sum = fnma(row[d], x[chain[d]], sum);
    x[k] = sum;
  }
}

/// x := M^-1 x
template <class T>
inline void solve_M(const TreeT<T>& tree, T* x) {
  solve_LT(tree, x);
  for (int k = 0; k < tree.topology.nv; ++k) x[k] *= tree.inverse_D[k];
  solve_L(tree, x);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
