#pragma once
// The joints of a step: limits and dry friction.

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// rad/s or m/s, fastest return of a joint that is beyond its limit (our choice, as for bullet).
inline constexpr double kLimitRecovery = 0.2;

/// Rows of the joints that are near a limit or have dry friction.
template <class T>
inline int set_up_joints(LaneBlock& block, const TreeT<T>& tree, double h, unsigned active) {
  const TopologyView& t = tree.topology;
  const T *q = rows<T>(block.q), *v = rows<T>(block.v);
  JointRowT<T>* joints = reinterpret_cast<JointRowT<T>*>(block.joints);
  T* free_rows = rows<T>(block.joint_rows);
  int count = 0;
  for (int i = 0; i < block.watched_count; ++i) {
    const int body = block.watched_body[i], dof = t.v[body];
    const T* limit = rows<T>(block.limit) + 3 * body;
    T* warm = rows<T>(block.joint_impulse) + 3 * body;
    const T below = q[t.q[body]] - limit[0], above = limit[1] - q[t.q[body]];
    // Near: closer than ten steps at this speed, and a reserve for impulses.
    const T near = fma(T(10.0 * h), abs(v[dof]), T(0.02));
    const unsigned lanes = bits((below < near) | (above < near) | (limit[2] > T(0.0))) & active & ~block.locked[body];
    const auto in_force = mask_from_bits<T>(lanes);
    for (int k = 0; k < 3; ++k) warm[k] = select(in_force, warm[k], T(0.0));
    if (lanes == 0) continue;
    JointRowT<T>& row = joints[count++];
    row.body = body;
    row.dof = dof;
    row.lanes = lanes;
    row.y = free_rows;
    free_rows += 2 * (t.dof_depth[dof] + 1);
    set_up_joint<T>(tree, v, row);
    const T rate(1.0 / h);
    const auto gap = [&](const T& x) {
      return select(x < T(0.0), max(T(0.2) * x * rate, T(-kLimitRecovery)), x * rate);
    };
    row.lower_gap = gap(below);
    row.upper_gap = gap(above);
    row.dry_gap = row.dry_compliance = T(0.0);
    row.inverse_dry = row.inverse_a;
    row.dry_high = T(h) * limit[2];
    row.dry_low = -row.dry_high;
    row.lower = warm[0], row.upper = warm[1], row.dry = min(max(warm[2], row.dry_low), row.dry_high);
  }
  return count;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
