#pragma once
// Rows of joints in the contact solve: limits, dry friction, and drives whose impulse is bounded.

#include "engine/contact/mimic_row.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A joint that is near a limit or has dry friction, or a bounded drive, all lanes.
template <class T>
struct JointRowT {
  int body;  // whose joint it is, or -1: a drive's row
  int count;
  const int* dofs;         // `count` that it moves
  unsigned lanes;          // where it is in force
  T b;                     // joint speed at the beginning, rad/s or m/s; relax_joint adds Y^T dz
  T inverse_a;             // 1 / A, kg m^2 or kg
  T lower_gap, upper_gap;  // gap terms: u + lower_gap >= 0, -u + upper_gap >= 0
  // Dry friction: u + dry_gap + dry_compliance dry = 0 as far as the bounds on dry allow.
  T dry_gap, dry_compliance, inverse_dry;
  T dry_low, dry_high;  // h times the torque, N m s
  T lower, upper, dry;  // impulses; in: warm start
  T* y;                 // Y on dofs, then D^-1 Y
};

/// Adds what impulse `change` on the joint does to dz.
template <class T>
inline void apply_row(const JointRowT<T>& row, const T& change, T* dz) {
  for (int d = 0; d < row.count; ++d) dz[row.dofs[d]] = fma(row.y[row.count + d], change, dz[row.dofs[d]]);
}

/// The joint's speed, with what `dz` has changed.
template <class T>
inline T speed_of(const JointRowT<T>& row, const T* dz) {
  T u = row.b;
  for (int d = 0; d < row.count; ++d) u = fma(row.y[d], dz[row.dofs[d]], u);
  return u;
}

/// set_up_joint where mimic rows come in. scratch: per dof. Lanes in which these hold the joint are left out.
template <class T>
inline void set_up_joint_of_mimics(const TreeT<T>& tree, int dof, const MimicsT<T>& mimics, T* scratch,
                                   JointRowT<T>& row) {
  const int count = row.count;
  for (int d = 0; d < count; ++d) scratch[row.dofs[d]] = T(0.0);
  scratch[dof] = T(1.0);
  factor_row<T>(tree, count, row.dofs, scratch, row.y);
  T before(0.0), a(0.0);
  for (int d = 0; d < count; ++d) before = fma(row.y[d], row.y[count + d], before);
  row.b += leave_alone<T>(mimics, count, row.dofs, T(0.0), row.y);
  for (int d = 0; d < count; ++d) a = fma(row.y[d], row.y[count + d], a);
  const auto moves = a > T(kNothingLeft) * before;
  for (int d = 0; d < 2 * count; ++d) row.y[d] = select(moves, row.y[d], T(0.0));
  row.inverse_a = select(moves, recip(select(moves, a, T(1.0))), T(1.0));
  row.lanes &= bits(moves);
}

/// Y and A of the row of a joint, which moves `path`.
template <class T>
inline void set_up_joint(const TreeT<T>& tree, const T* v, int dof, const JointPathView& path, const MimicsT<T>& mimics,
                         T* scratch, JointRowT<T>& row) {
  row.count = path.count;
  row.dofs = path.dofs;
  row.b = v[dof];
  if (path.mimics) return set_up_joint_of_mimics<T>(tree, dof, mimics, scratch, row);
  const TopologyView& t = tree.topology;
  const int count = path.count;
  const int* chain = path.dofs;
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
  row.inverse_a = recip(a);
}

/// One joint's turn: dry friction, then the limits. Returns how much its speed changed.
template <class T>
inline T relax_joint(const mask_of<T>& moving, JointRowT<T>& row, T* dz) {
  T u = speed_of(row, dz);
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
  apply_row(row, change, dz);
  return abs(change) * a;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
