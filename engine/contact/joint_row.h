#pragma once
// Rows of joints in the contact solve: limits, dry friction, and drives whose impulse is bounded.

#include "engine/dynamics/factor.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A joint that is near a limit or has dry friction, or a bounded drive, all lanes.
template <class T>
struct JointRowT {
  int body;  // whose joint it is, or -1: a drive's row
  int dof;
  unsigned lanes;          // where it is in force
  T b;                     // joint speed at the beginning, rad/s or m/s; relax_joint adds Y^T dz
  T inverse_a;             // 1 / A, kg m^2 or kg
  T lower_gap, upper_gap;  // gap terms: u + lower_gap >= 0, -u + upper_gap >= 0
  // Dry friction: u + dry_gap + dry_compliance dry = 0 as far as the bounds on dry allow.
  T dry_gap, dry_compliance, inverse_dry;
  T dry_low, dry_high;  // h times the torque, N m s
  T lower, upper, dry;  // impulses; in: warm start
  T* y;                 // Y along the chain of dof, then D^-1 Y
};

/// Adds what impulse `change` on the joint does to dz.
template <class T>
inline void apply_row(const TopologyView& t, const JointRowT<T>& row, const T& change, T* dz) {
  const int count = t.dof_depth[row.dof] + 1;
  const int* chain = t.chain + t.row[row.dof];
  for (int d = 0; d < count; ++d) dz[chain[d]] = fma(row.y[count + d], change, dz[chain[d]]);
}

/// Y and A of a joint's row.
template <class T>
inline void set_up_joint(const TreeT<T>& tree, const T* v, JointRowT<T>& row) {
  const TopologyView& t = tree.topology;
  const int count = t.dof_depth[row.dof] + 1;
  const int* chain = t.chain + t.row[row.dof];
  for (int d = 0; d < count; ++d) row.y[d] = T(0.0);
  row.y[count - 1] = T(1.0);
  T a(0.0);
  for (int d = count - 1; d >= 0; --d) {
    const T y = row.y[d];
    const T* L = tree.M + t.row[chain[d]];
    for (int e = 0; e < d; ++e) row.y[e] = fnma(L[e], y, row.y[e]);
    row.y[count + d] = y * tree.inverse_D[chain[d]];
    a = fma(y, row.y[count + d], a);
  }
  row.b = v[row.dof];
  row.inverse_a = recip(a);
}

/// One joint's turn: dry friction, then the limits. Returns how much its speed changed.
template <class T>
inline T relax_joint(const TopologyView& t, const mask_of<T>& moving, JointRowT<T>& row, T* dz) {
  const int count = t.dof_depth[row.dof] + 1;
  const int* chain = t.chain + t.row[row.dof];
  T u = row.b;
  for (int d = 0; d < count; ++d) u = fma(row.y[d], dz[chain[d]], u);
  const auto turn = moving & mask_from_bits<T>(row.lanes);
  // Each of the three is eliminated exactly given the others; a limit and friction together converge over sweeps.
  const T dry = min(max(fnma(fma(row.dry_compliance, row.dry, u + row.dry_gap), row.inverse_dry, row.dry), row.dry_low),
                    row.dry_high);
  const T a = recip(row.inverse_a);
  u = fma(a, dry - row.dry, u);
  // One impulse, up or down: the range between the limits is not empty.
  const T limit = row.lower - row.upper;
  const T lower = max(T(0.0), fnma(u + row.lower_gap, row.inverse_a, limit));
  const T upper = max(T(0.0), select(lower > T(0.0), T(0.0), fma(u - row.upper_gap, row.inverse_a, -limit)));
  const T change = select(turn, (dry - row.dry) + (lower - upper - limit), T(0.0));
  row.dry = select(turn, dry, row.dry);
  row.lower = select(turn, lower, row.lower);
  row.upper = select(turn, upper, row.upper);
  apply_row(t, row, change, dz);
  return abs(change) * a;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
