#pragma once
// M = L^T D L with L unit lower triangular in the sparsity of the tree (Featherstone 2008, §6.5: without fill-in), and
// solves with it.

#include "engine/dynamics/tree.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Factors tree.M in place: below the diagonal L, on it D; inverse_D is filled.
template <class T>
inline void factor(const TreeT<T>& tree) {
  const TopologyView& t = tree.topology;
  for (int k = t.nv - 1; k >= 0; --k) {
    T* row = tree.M + t.row[k];
    const int* chain = t.chain + t.row[k];
    const int depth = t.dof_depth[k];
    const T inverse = recip(row[depth]);
    tree.inverse_D[k] = inverse;
    for (int d = depth - 1; d >= 0; --d) {
      const T l = row[d] * inverse;
      T* target = tree.M + t.row[chain[d]];
      for (int e = 0; e <= d; ++e) target[e] = fnma(l, row[e], target[e]);
      row[d] = l;
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
