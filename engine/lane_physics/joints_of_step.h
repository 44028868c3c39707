#pragma once
// The joints of a step: limits, dry friction, and which follow others.

#include "engine/contact/solver.h"
#include "engine/lane_physics/block_view.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// rad/s or m/s, fastest return of a joint that is beyond its limit (our choice, as for bullet).
inline constexpr double kLimitRecovery = 0.2;

/// The mimic rows, whose impulses go into dz: the change of L v by all but constraints. An error of position is taken
/// back as an overshoot of a limit is.
template <class T>
inline MimicsT<T> follow_mimics(const LaneBlock& block, const TreeT<T>& tree, double h, T* dz) {
  MimicsT<T> mimics;
  if (block.mimic_count == 0) return mimics;
  const T *q = rows<T>(block.q), *v = rows<T>(block.v);
  T* x = rows<T>(block.scratch);
  mimics.count = block.mimic_count;
  mimics.dof_count = block.mimic_dof_count;
  mimics.dofs = block.mimic_dofs;
  mimics.y = rows<T>(block.mimic_rows);
  mimics.rows = reinterpret_cast<MimicRowT<T>*>(mimics.y + 2 * mimics.dof_count * mimics.count);
  for (int i = 0; i < mimics.count; ++i) {
    const MimicView& view = block.mimics[i];
    const T multiplier = rows<T>(block.mimic)[2 * i], offset = rows<T>(block.mimic)[2 * i + 1];
    for (int d = 0; d < mimics.dof_count; ++d) x[mimics.dofs[d]] = T(0.0);
    x[view.dof] = T(1.0);
    x[view.other_dof] = -multiplier;
    factor_row<T>(tree, mimics.dof_count, mimics.dofs, x, mimics.y + 2 * mimics.dof_count * i);
    const T error = fnma(multiplier, q[view.other_q], q[view.q] - offset);
    MimicRowT<T>& row = mimics.rows[i];
    row.speed = fnma(multiplier, v[view.other_dof], v[view.dof]);
    row.target = max(min(T(-0.2 / h) * error, T(kLimitRecovery)), T(-kLimitRecovery));
    make_orthonormal<T>(mimics, i);
  }
  follow<T>(mimics, dz);
  return mimics;
}

/// Rows of the joints that are near a limit or have dry friction.
template <class T>
inline int set_up_joints(LaneBlock& block, const TreeT<T>& tree, const MimicsT<T>& mimics, double h, unsigned active) {
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
    const JointPathView& path = block.joint_paths[dof];
    JointRowT<T>& row = joints[count];
    row.body = body;
    row.lanes = lanes;
    row.y = free_rows;
    if (lanes != 0) set_up_joint<T>(tree, v, dof, path, mimics, rows<T>(block.scratch), row);
    const auto in_force = mask_from_bits<T>(row.lanes);
    for (int k = 0; k < 3; ++k) warm[k] = select(in_force, warm[k], T(0.0));
    if (lanes == 0) continue;
    ++count;
    free_rows += 2 * path.count;
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
