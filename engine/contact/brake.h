#pragma once
// Impulses of constraints take energy away; they give only what parting bodies that overlap and returning joints to
// their limits take. A solve that has not converged, or has ended where there is no solution (friction that jams), may
// not; nor may Newton's law of restitution where an impact turns the slip round, or where coefficients differ (Stronge
// 1990): then all impulses of the lane are scaled back until they do. The bounce of a single contact gives none: its
// impulse makes -(1 - e) / 2 times the approach with the mean of the velocities before and after.

#include "engine/contact/solver.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// The most that the impulses may give, J: each times the velocity of its bodies at the end, as far as its constraint
/// has set them a speed to part with that is not the bounce of an impact.
template <class T>
GRAZE_OUT_OF_LINE T recovery_work(const ConstraintsT<T>& set, T* dz) {
  T work(0.0);
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    const T u = speed_of(row, dz);
    work = fma(row.lower, max(min(u, -row.lower_gap), T(0.0)), work);
    work = fma(row.upper, max(min(-u, -row.upper_gap), T(0.0)), work);
  }
  ChangeT<T> change(dz);
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    change.turn_to(path);
    // Beyond the target, and without the compliances: the velocity of the bodies themselves.
    const Vec3T<T> past = contact_velocity(path, c, change);
    const Vec3T<T> u{fnma(c.compliance, c.lambda.x, past.x + c.target), fnma(c.guard, c.lambda.y, past.y),
                     fnma(c.guard, c.lambda.z, past.z)};
    work += max(min(dot(c.lambda, u), c.lambda.x * c.recovery), T(0.0));
  }
  change.in_memory();
  return work;
}

/// The largest change that an impulse makes to the velocity of its own constraint, m/s or rad/s: in the measure in
/// which the sweeps tell how far they are from converged.
template <class T>
GRAZE_OUT_OF_LINE T largest_change(const ConstraintsT<T>& set) {
  T most(0.0);
  const auto take = [&most](unsigned lanes, const T& change) {
    most = max(most, select(mask_from_bits<T>(lanes), change, T(0.0)));
  };
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    take(row.lanes, abs(row.dry + row.lower - row.upper) * recip(row.inverse_a));
  }
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    take(c.lanes, max(max(abs(c.lambda.x) * c.ann, abs(c.lambda.y) * c.ass), abs(c.lambda.z) * c.att));
  }
  return most;
}

/// Scales the impulses of those of `lanes` in which they give more than they may. z: L v at the beginning; `free` and
/// `dz`: its change without and with the impulses. Returns the work of the impulses, with the mean of v and v*, J.
/// `taken`: what this has taken of them, in the measure of largest_change(); 0 where nothing is scaled.
template <class T>
inline T brake(const TreeT<T>& tree, ConstraintsT<T>& set, const T* z, const T* free, unsigned lanes, T* dz, T& taken) {
  const TopologyView& t = tree.topology;
  taken = T(0.0);
  // Of impulses scaled by x: x linear + x^2 square beyond the free motion, of which v* has half as much more than the
  // mean velocity.
  T linear(0.0), square(0.0), ahead(0.0);
  for (int k = 0; k < t.nv; ++k) {
    const T change = dz[k] - free[k], push = tree.M[t.row[k] + t.dof_depth[k]] * change;
    linear = fma(push, z[k] + free[k], linear);
    square = fma(push, change, square);
    ahead = fma(push, free[k], ahead);
  }
  square *= T(0.5);
  const T work = fnma(T(0.5), ahead, linear + square);
  if (!any(linear + square > T(0.0))) return work;
  const T room = recovery_work<T>(set, dz) - linear;
  const auto over = (square > room) & mask_from_bits<T>(lanes);
  if (!any(over)) return work;
  const T share = select(over, max(room * recip(select(over, square, T(1.0))), T(0.0)), T(1.0));
  taken = select(over, (T(1.0) - share) * largest_change<T>(set), T(0.0));
  // Where nothing is scaled the bits stay, whatever the neighbours need.
  for (int k = 0; k < t.nv; ++k) dz[k] = select(over, fma(share, dz[k] - free[k], free[k]), dz[k]);
  for (int i = 0; i < set.joint_count; ++i) {
    JointRowT<T>& row = set.joints[i];
    row.lower *= share, row.upper *= share, row.dry *= share;
  }
  for (int i = 0; i < set.contact_count; ++i) set.contacts[i].lambda = share * set.contacts[i].lambda;
  return select(over, share * fma(share, square, fnma(T(0.5), ahead, linear)), work);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
