#pragma once
// Joints that follow others (<mimic>): v_follower - multiplier v_leader = target, a bilateral row. Its J is constant,
// so what holds of velocities holds of positions, and its impulses do no work but to take back an error.
//
// Such rows are not swept: a light finger that is geared to a strong motor would make sweeps over row and contact
// creep. They are solved first, and every other row is made to leave them alone. With M = L^T D L, y = L^-T J^T and e
// the y of all rows made orthonormal in D^-1: the change of L v takes D^-1 e (target - e^T L v), and another row's Y
// becomes Y - e (e^T D^-1 Y), whose impulses carry those of the mimic rows with them. A sweep over such rows then stays
// on e^T L v = target to rounding.

#include "engine/contact/path_view.h"
#include "engine/dynamics/factor.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// What is known of a mimic row, all lanes.
template <class T>
struct MimicRowT {
  T speed;    // e^T L v at the beginning, sqrt(J)
  T target;   // e^T L v that the step must end with
  T impulse;  // along e, of the step's free motion: without what other rows carry with them
};

/// The mimic rows of a step; none: count 0.
template <class T>
struct MimicsT {
  int count = 0;
  int dof_count = 0;
  const int* dofs = nullptr;  // that they move, descending, with all their ancestors
  T* y = nullptr;             // per row: e in the order of dofs, then D^-1 e
  MimicRowT<T>* rows = nullptr;

  const T* of(int row) const { return y + 2 * dof_count * row; }
};

/// Of a row whose A falls below this share when the mimic rows have taken theirs, nothing is left that could move.
inline constexpr double kNothingLeft = 1e-12;

/// y = L^-T x on `dofs` (descending, with all ancestors), and D^-1 y behind it. x: per dof, is lost.
template <class T>
inline void factor_row(const TreeT<T>& tree, int count, const int* dofs, T* x, T* y) {
  const TopologyView& t = tree.topology;
  for (int i = 0; i < count; ++i) {
    const int k = dofs[i];
    y[i] = take_from_ancestors(t, tree.M, k, 0, x);
    y[count + i] = y[i] * tree.inverse_D[k];
  }
}

/// Makes row `i` orthogonal to those before it, of length 1; its speed and target with it. A row that nothing can move
/// is left out: zero.
template <class T>
inline void make_orthonormal(MimicsT<T>& mimics, int i) {
  const int n = mimics.dof_count;
  T* y = mimics.y + 2 * n * i;
  MimicRowT<T>& row = mimics.rows[i];
  for (int j = 0; j < i; ++j) {
    const T* e = mimics.of(j);
    T along(0.0);
    for (int d = 0; d < n; ++d) along = fma(e[d], y[n + d], along);
    for (int d = 0; d < 2 * n; ++d) y[d] = fnma(along, e[d], y[d]);
    row.speed = fnma(along, mimics.rows[j].speed, row.speed);
    row.target = fnma(along, mimics.rows[j].target, row.target);
  }
  T square(0.0);
  for (int d = 0; d < n; ++d) square = fma(y[d], y[n + d], square);
  const auto moves = square > T(0.0);
  const T scale = select(moves, recip(sqrt(select(moves, square, T(1.0)))), T(0.0));
  for (int d = 0; d < 2 * n; ++d) y[d] *= scale;
  row.speed *= scale;
  row.target *= scale;
}

/// Brings dz, the change of L v by all else, onto the rows.
template <class T>
inline void follow(MimicsT<T>& mimics, T* dz) {
  const int n = mimics.dof_count;
  for (int i = 0; i < mimics.count; ++i) {
    const T* e = mimics.of(i);
    MimicRowT<T>& row = mimics.rows[i];
    T change(0.0);
    for (int d = 0; d < n; ++d) change = fma(e[d], dz[mimics.dofs[d]], change);
    row.impulse = row.target - row.speed - change;
    for (int d = 0; d < n; ++d) dz[mimics.dofs[d]] = fma(e[n + d], row.impulse, dz[mimics.dofs[d]]);
  }
}

/// Work of their impulses with the mean of v and v*, J: 0 but where an error is taken back, which `brake` must not
/// scale.
template <class T>
inline T work_of(const MimicsT<T>& mimics) {
  T work(0.0);
  for (int i = 0; i < mimics.count; ++i) {
    const MimicRowT<T>& row = mimics.rows[i];
    work = fma(row.impulse, T(0.5) * (row.speed + row.target), work);
  }
  return work;
}

/// Takes what the mimic rows hold out of a row of Y on `dofs`, which contains theirs: y, and D^-1 y behind it. V: T, or
/// Vec3T<T> for three rows at once. Returns the part of its velocity that they hold.
template <class T, class V>
inline V leave_alone(const MimicsT<T>& mimics, int count, const int* dofs, const V& zero, V* y) {
  const int n = mimics.dof_count;
  V held = zero;
  for (int i = 0; i < mimics.count; ++i) {
    const T* e = mimics.of(i);
    V along = zero;
    for (int k = 0, d = 0; d < n; ++k) {
      if (dofs[k] == mimics.dofs[d]) along += e[d++] * y[count + k];
    }
    for (int k = 0, d = 0; d < n; ++k) {
      if (dofs[k] != mimics.dofs[d]) continue;
      y[k] -= e[d] * along;
      y[count + k] -= e[n + d] * along;
      ++d;
    }
    held += (mimics.rows[i].target - mimics.rows[i].speed) * along;
  }
  return held;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
