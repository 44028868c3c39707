#pragma once
// The contact solve of a step: sweeps (solver.h), then Newton's method (newton.h) where they have not converged, then
// what sweeps are left.

#include "engine/contact/newton.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Ends Newton's method in `lanes`: contacts and joints have the impulses that are kept, dz what follows from them.
template <class T>
GRAZE_OUT_OF_LINE void take_impulses(const NewtonT<T>& newton, const mask_of<T>& lanes, T* dz) {
  ConstraintsT<T>& set = newton.set;
  T* z = newton.memory.trial;
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  for (int k = 0; k < newton.memory.nv; ++k) z[k] = newton.free[k];
  for (int i = 0; i < set.joint_count; ++i) {
    JointRowT<T>& row = set.joints[i];
    const T* kept = newton.memory.rows[i].kept;
    // The sum with 0 turns -0, whose sign may depend on neighbours, into +0; here and below.
    row.lower = select(lanes, kept[0] + T(0.0), row.lower), row.upper = select(lanes, kept[1] + T(0.0), row.upper);
    row.dry = select(lanes, kept[2] + T(0.0), row.dry);
    apply_row(row, kept[0] - kept[1] + kept[2], z);
  }
  ChangeT<T> change(z);
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    c.lambda = select(lanes, newton.memory.contacts[i].kept + zero, c.lambda);
    change.turn_to(set.paths[c.path]);
    apply_impulse(set.paths[c.path], c, newton.memory.contacts[i].kept, change);
  }
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    const PathView& path = set.paths[c.path];
    change.turn_to(path);
    const Vec3T<T> u = contact_velocity(path, c, change), &at = c.lambda;
    const T length = sqrt(fma(at.y, at.y, at.z * at.z)), radius = c.friction * at.x;
    const auto slips = (radius > T(0.0)) & (length >= T(1.0 - 1e-12) * radius);
    const T rate = sqrt(fma(u.y, u.y, u.z * u.z)) * recip(select(slips, length, T(1.0)));
    const auto here = lanes & mask_from_bits<T>(c.lanes);
    c.slips = select(here, select(slips, T(1.0), T(0.0)), c.slips);
    c.slip_rate = select(here & slips, rate, c.slip_rate);
  }
  change.in_memory();
  for (int k = 0; k < newton.memory.nv; ++k) dz[k] = select(lanes, z[k], dz[k]);
}

/// Makes all contacts of `lanes` compliant and begins with no impulses. A foot that is jammed between two faces has no
/// others: their gap terms ask two points of one body to come nearer to each other, and impulses that squeeze it grow
/// without end.
template <class T>
GRAZE_OUT_OF_LINE void soften(const NewtonT<T>& newton, const mask_of<T>& lanes, T* dz) {
  const T zero(0.0);
  for (int i = 0; i < newton.set.contact_count; ++i) {
    ContactT<T>& c = newton.set.contacts[i];
    const T more = select(lanes, T(kJammedCompliance / 3.0) * (c.ann + c.ass + c.att), zero);
    c.compliance += more, c.guard += more;
    c.ann += more, c.ass += more, c.att += more;
    c.inverse_ann = recip(c.ann);
    invert_A(c);
    Vec3T<T>& kept = newton.memory.contacts[i].kept;
    kept = select(lanes, Vec3T<T>{zero, zero, zero}, kept);
  }
  for (int i = 0; i < newton.set.joint_count; ++i) {
    for (T& kept : newton.memory.rows[i].kept) kept = select(lanes, zero, kept);
  }
  for (int k = 0; k < newton.memory.nv; ++k) {
    dz[k] = select(lanes, newton.free[k], dz[k]);
    newton.memory.start[k] = select(lanes, dz[k], newton.memory.start[k]);
  }
}

/// How far Newton's method is, per lane.
template <class T>
struct NewtonProgressT {
  mask_of<T> going, soft;
  T eps{kFirstEps};
  T merit{0.0}, goal;
  T steps{0.0}, since{0.0};  // of all, and of this proximal step
  T best;                    // m/s, what was left of the laws after the last proximal step
};

/// One step and, where it has got there or cannot, the end of the proximal step.
template <class T>
GRAZE_OUT_OF_LINE void newton_step(const NewtonT<T>& newton, double tolerance, NewtonProgressT<T>& at, T* dz) {
  const NewtonMemoryT<T>& memory = newton.memory;
  newton.assemble(bits(at.going));
  newton.eliminate();
  T share(1.0), next(0.0);
  auto searching = at.going;
  for (int k = 0; k < kHalvings && any(searching); ++k) {
    if (k > 0) share = select(searching, T(0.5) * share, share);
    for (int d = 0; d < memory.nv; ++d) memory.trial[d] = fma(share, memory.step[d], dz[d]);
    next = newton.evaluate(bits(at.going), at.eps, memory.trial);
    const auto good = (next <= fnma(T(0.1) * share, at.merit, at.merit)) | (next < at.goal);
    searching = searching & (!good);
  }
  const auto taken = at.going & ((!searching) | (next <= at.merit));
  at.steps = select(at.going, at.steps + T(1.0), at.steps);
  at.since += T(1.0);
  at.merit = next;
  const auto there = taken & (next < at.goal);
  const auto failed = at.going & ((!taken) | ((!there) & (at.since >= T(kNewtonSteps))));
  for (int d = 0; d < memory.nv; ++d) {
    const T z = select(taken, memory.trial[d], dz[d]);
    memory.start[d] = select(there, z, memory.start[d]);
    dz[d] = select(failed, memory.start[d], z);
  }
  if (!any(there | failed)) return;
  at.best = select(there, newton.left(bits(there), at.eps), at.best);
  newton.keep(there);
  auto done = there & (at.best <= T(tolerance));
  if (any(done)) done = done & (at.soft | (newton.squeezed(bits(done)) <= T(tolerance)));
  at.going = at.going & (!done);
  const auto ended = there & ((at.best <= T(tolerance)) | (at.eps <= T(kLeastEps)));
  const auto stuck = at.going & (ended | (failed & (at.eps >= T(kLargestEps))));
  at.eps = select(there, max(T(kShrink) * at.eps, T(kLeastEps)), select(failed, T(kGrow) * at.eps, at.eps));
  at.since = select(there | failed, T(0.0), at.since);
  at.going = at.going & (!(stuck & at.soft));
  const auto jammed = stuck & at.going;
  if (any(jammed)) {
    soften<T>(newton, jammed, dz);
    at.soft = at.soft | jammed;
    at.eps = select(jammed, T(kFirstEps), at.eps);
    at.best = select(jammed, T(1e300), at.best);
  }
  if (any(at.going)) at.merit = newton.evaluate(bits(at.going), at.eps, dz);
}

/// Newton's method from impulses and dz as sweeps have left them, in `lanes`. `residual` (m/s) in and out, `steps` out,
/// per lane. Lanes in which it does not converge keep the impulses that they had. Returns those in which it does.
template <class T>
GRAZE_OUT_OF_LINE mask_of<T> solve_by_newton(const NewtonT<T>& newton, int most, double tolerance,
                                             const mask_of<T>& lanes, T* dz, T& steps, T& residual) {
  NewtonMemoryT<T>& memory = newton.memory;
  const ConstraintsT<T>& set = newton.set;
  find_pattern<T>(set, memory);
  T stiffest(0.0);
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    memory.contacts[i].kept = c.lambda;
    stiffest = max(stiffest, select(mask_from_bits<T>(c.lanes), c.ann + c.ass + c.att, T(0.0)));
  }
  for (int i = 0; i < set.joint_count; ++i) {
    const JointRowT<T>& row = set.joints[i];
    T* kept = memory.rows[i].kept;
    kept[0] = row.lower, kept[1] = row.upper, kept[2] = row.dry;
    stiffest = max(stiffest, select(mask_from_bits<T>(row.lanes), recip(row.inverse_a), T(0.0)));
  }
  for (int k = 0; k < memory.nv; ++k) memory.start[k] = memory.before[k] = dz[k];
  NewtonProgressT<T> at;
  at.going = lanes;
  at.soft = lanes & (!lanes);
  // f^T D f bounds the error of a velocity by its own A: (delta u)^2 <= A f^T D f.
  at.goal = T(kNewtonError * kNewtonError * tolerance * tolerance) * recip(max(stiffest, T(1e-300)));
  at.best = T(1e300);
  at.merit = newton.evaluate(bits(lanes), at.eps, dz);
  for (int i = 0; i < most && any(at.going); ++i) newton_step<T>(newton, tolerance, at, dz);
  // What has not converged is not taken: impulses that leave little of the laws may be large where these cannot be met.
  const auto converged = lanes & (at.best <= T(tolerance));
  for (int k = 0; k < memory.nv; ++k) dz[k] = select(lanes, memory.before[k], dz[k]);
  if (any(converged)) take_impulses<T>(newton, converged, dz);
  residual = select(converged, at.best, residual);
  steps = at.steps;
  return converged;
}

/// What bounds the solve of a step.
struct SolveBounds {
  int most_sweeps;
  int newton_after;       // sweeps; from most_sweeps on: no Newton's method
  int most_newton_steps;  // all proximal steps together
  double tolerance;       // m/s (rad/s)
};

/// Impulses and dz of all `lanes`: sweeps, then Newton's method where these have not converged, then what sweeps are
/// left. `steps`: sweeps and steps of Newton's method; `residual` (m/s): the last sweep's largest change of a velocity,
/// or what Newton's method has left of the laws; both per lane.
template <class T>
inline void solve_constraints(const ContactLawT<T>& law, const SolveBounds& bounds, unsigned lanes, const T* inverse_D,
                              const T* free, NewtonMemoryT<T>& memory, ConstraintsT<T>& set, T* dz, T& steps,
                              T& residual) {
  SweepsT<T> at;
  at.moving = mask_from_bits<T>(lanes);
  const int first = bounds.newton_after < bounds.most_sweeps ? bounds.newton_after : bounds.most_sweeps;
  sweep<T>(law, first, bounds.most_sweeps, bounds.tolerance, set, dz, at);
  T newton_steps(0.0);
  if (at.done == 0) at.residual = T(1e300);
  if (bounds.newton_after < bounds.most_sweeps && any(at.moving)) {
    const NewtonT<T> newton{law, set, inverse_D, free, memory, any(law.convex > T(0.0))};
    const auto converged = solve_by_newton<T>(newton, bounds.most_newton_steps, bounds.tolerance, at.moving, dz,
                                              newton_steps, at.residual);
    at.moving = at.moving & (!converged);
    at.from = at.done - kPlainSweeps;
  }
  sweep<T>(law, bounds.most_sweeps, bounds.most_sweeps, bounds.tolerance, set, dz, at);
  steps = at.count + newton_steps;
  residual = at.residual;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
