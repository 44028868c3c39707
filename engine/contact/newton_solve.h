#pragma once
// The contact solve of a step: sweeps (solver.h), then Newton's method (newton.h) where they have not converged, then
// what sweeps are left.

#include "engine/contact/newton_lane.h"
#include "engine/contact/newton_tree.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Coulomb's law by corrections, our choice, found on a limp chain of 60 joints and a hand: convex programs before its
/// own Newton's method is tried from where they have led; rounds of both; eps at first, of all but the first program.
inline constexpr int kCorrections = 3, kRounds = 4;
inline constexpr double kNearEps = 1e-3;

/// Makes all contacts of a lane compliant. A foot that is jammed between two faces has no others: their gap terms ask
/// two points of one body to come nearer to each other, and impulses that squeeze it grow without end.
template <class T>
GRAZE_OUT_OF_LINE void soften(ConstraintsT<T>& set, int lane) {
  const auto here = mask_from_bits<T>(1u << lane);
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    const T more = select(here, T(kJammedCompliance / 3.0) * (c.ann + c.ass + c.att), T(0.0));
    c.compliance += more, c.guard += more;
    c.ann += more, c.ass += more, c.att += more;
    c.inverse_ann = recip(c.ann);
    invert_A(c);
  }
}

/// Speed at which contacts of a softened lane that overlap by more than kSunk give way, m/s: a spring whose time
/// constant is that of the mass that the contact feels is too soft for a load that is many times as heavy.
template <class T>
GRAZE_OUT_OF_LINE double giving_way(const ConstraintsT<T>& set, int lane) {
  constexpr double kOfA = kJammedCompliance / (3.0 * (1.0 + kJammedCompliance));  // of what A is with it
  double most = 0.0;
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    if ((c.lanes >> lane & 1u) == 0 || number_of(c.phi, lane) > -kSunk) continue;
    most = max(most, kOfA * number_of(c.ann + c.ass + c.att, lane) * number_of(c.lambda.x, lane));
  }
  return most;
}

/// Newton's method on one lane.
class NewtonRun {
 public:
  enum class End { converged, jammed, failed };

  /// `accepted`: what may be left of the laws where the tolerance cannot be reached, m/s. `eps`: at first.
  NewtonRun(NewtonProblem& problem, double tolerance, double accepted, double eps = kFirstEps)
      : p_(problem), tolerance_(tolerance), accepted_(max(accepted, tolerance)), eps_(eps) {
    // f^T D f bounds the error of a velocity by its own A: (delta u)^2 <= A f^T D f.
    double stiffest = 1e-300;
    for (int i = 0; i < (p_.contact_count + 7) / 8; ++i) {
      const ContactsOfEight& c = p_.contact_packs[i];
      Eight own(0.0);
      for (int k = 0; k < c.dof_count; ++k) {
        own = fma(Eight(p_.inverse_D[c.dofs[k]]), norm2(c.columns[k]), own);
      }
      stiffest = max(stiffest, largest(own));
    }
    for (int i = 0; i < p_.joint_count; ++i) {
      stiffest = max(stiffest, number(p_.joint_packs[i / 8].r, i % 8));
    }
    stiffest_ = stiffest;
    goal_ = kNewtonError * kNewtonError * tolerance * tolerance / stiffest;
  }

  /// From z and the kept impulses. `soft`: softened before.
  End run(int most, bool soft) {
    copy(p_.start, p_.z);
    merit_ = p_.evaluate(eps_, p_.z);
    while (steps_ < most) {
      const Outcome outcome = step();
      if (outcome == Outcome::going) continue;
      const bool there = outcome == Outcome::there;
      bool falls = false;
      if (there) {
        const double left = p_.left(eps_);
        falls = left < kFalls * best_;
        best_ = left;
        squeezed_ = soft ? 0.0 : p_.squeezed();
        p_.keep();
        if (max(best_, squeezed_) <= tolerance_) return least_ < kLeastEps && !bears() ? End::jammed : End::converged;
      }
      const bool ended = there && (best_ <= tolerance_ || (eps_ <= least_ && !falls));
      if (ended && best_ > accepted_ && least_ > kLastEps) {
        least_ = kLastEps, eps_ = kFewer * eps_;
      } else if (ended || (!there && (eps_ >= kLargestEps || least_ < kLeastEps))) {
        return is_accepted() ? End::converged : soft ? End::failed : End::jammed;
      } else {
        eps_ = there ? max(kShrink * eps_, least_) : kGrow * eps_;
      }
      since_ = 0;
      merit_ = p_.evaluate(eps_, p_.z);
    }
    // Below kLeastEps impulses of a jam may grow without end.
    return is_accepted() ? End::converged : least_ < kLeastEps && !soft ? End::jammed : End::failed;
  }

  int steps() const { return steps_; }
  double left() const { return best_; }  // of the laws after the last proximal step, m/s
  /// Whether the impulses that are kept are none of a jam.
  bool bears() const { return p_.pressed() <= kMostSqueeze * p_.momentum; }

 private:
  enum class Outcome { going, there, failed };
  static constexpr double kFewer = 0.1;  // of eps, from kLeastEps on, where the law is not kept

  /// Of the impulses that are kept.
  bool is_accepted() const { return max(best_, squeezed_) <= accepted_ && (least_ >= kLeastEps || bears()); }

  /// Whether velocities and impulses fit: exactly where this can be the last proximal step, else as well as the laws
  /// are kept, which the steps that follow will better.
  bool is_there(double merit) const {
    if (merit < goal_) return true;
    const double left = p_.left(eps_);
    return left > accepted_ && merit * stiffest_ < left * left;
  }

  void copy(double* to, const double* from) const {
    for (int k = 0; k < p_.width; k += 8) store(to + k, load<Eight>(from + k));
  }

  /// One step of Newton's method and, where it has got there or cannot, the end of the proximal step.
  Outcome step() {
    p_.assemble();
    p_.eliminate();
    // The convex law has an energy to go down; the others have what does not fit, which must become less.
    double share = p_.convex ? p_.find_length(eps_) : 1.0, next = 0.0;
    bool good = false;
    for (int k = 0; k < kHalvings && !good; ++k, share *= 0.5) {
      for (int d = 0; d < p_.width; d += 8) {
        store(p_.trial + d, fma(Eight(share), load<Eight>(p_.step + d), load<Eight>(p_.z + d)));
      }
      next = p_.evaluate(eps_, p_.trial);
      good = p_.convex || next <= fnma(0.1 * share, merit_, merit_) || next < goal_;
    }
    const bool taken = good || next <= merit_;
    ++steps_, ++since_;
    merit_ = next;
    if (taken) copy(p_.z, p_.trial);
    if (taken && is_there(next)) {
      copy(p_.start, p_.z);
      return Outcome::there;
    }
    if (taken && since_ < kNewtonSteps) return Outcome::going;
    copy(p_.z, p_.start);
    return Outcome::failed;
  }

  NewtonProblem& p_;
  double tolerance_, accepted_, stiffest_, goal_;
  double eps_, least_ = kLeastEps, merit_ = 0.0, best_ = 1e300, squeezed_ = 1e300;
  int steps_ = 0, since_ = 0;  // of all, and of this proximal step
};

/// Gives a lane's contacts and joints the impulses that are kept, dz what follows from them.
template <class T>
GRAZE_OUT_OF_LINE void take_impulses(const NewtonProblem& p, int lane, ConstraintsT<T>& set, T* dz) {
  for (int k = 0; k < p.width; k += 8) store(p.gradient + k, Eight(0.0));
  for (int i = 0, n = 0; i < set.joint_count; ++i) {
    JointRowT<T>& row = set.joints[i];
    if (!(row.lanes >> lane & 1u)) continue;
    const JointsOfEight& pack = p.joint_packs[n / 8];
    // The sum with 0 turns -0 into +0; here and below.
    const double lower = number(pack.kept[0], n % 8) + 0.0, upper = number(pack.kept[1], n % 8) + 0.0;
    const double dry = number(pack.kept[2], n % 8) + 0.0;
    set_number(row.lower, lane, lower), set_number(row.upper, lane, upper), set_number(row.dry, lane, dry);
    p.take(p.joints[n++], lower - upper + dry);
  }
  const Vec3T<double> zero{0.0, 0.0, 0.0};
  for (int i = 0, n = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    if (!(c.lanes >> lane & 1u)) continue;
    const Vec3T<double> kept = numbers_of(p.contact_packs[n / 8].kept, n % 8) + zero;
    set_numbers(c.lambda, lane, kept);
    p.take(p.contacts[n++], kept.x, kept.y, kept.z);
  }
  for (int k = 0; k < p.nv; ++k) {
    p.z[k] = fnma(p.gradient[k], p.inverse_D[k], p.free[k]);
    set_number(dz[k], lane, p.z[k]);
  }
}

/// Where a lane's contacts slip, and at what rate.
template <class T>
GRAZE_OUT_OF_LINE void take_slips(const NewtonProblem& p, int lane, ConstraintsT<T>& set) {
  for (int i = 0; i < (p.contact_count + 7) / 8; ++i) {
    ContactsOfEight& c = p.contact_packs[i];
    const SlipT<Eight> slip = slip_of<Eight>(c.friction, c.guard, c.kept, p.velocity(c, p.z));
    c.n.x = select(slip.slips, Eight(1.0), Eight(0.0));
    c.n.y = slip.rate;
  }
  for (int i = 0, n = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    if (!(c.lanes >> lane & 1u)) continue;
    const ContactsOfEight& pack = p.contact_packs[n / 8];
    const double slips = number(pack.n.x, n % 8);
    set_number(c.slips, lane, slips);
    if (slips > 0.0) set_number(c.slip_rate, lane, number(pack.n.y, n % 8));
    ++n;
  }
}

/// What bounds the solve of a step.
struct SolveBounds {
  int most_sweeps;
  int newton_after;          // sweeps; from most_sweeps on: no Newton's method
  int most_newton_steps;     // of one attempt, all its proximal steps together
  double tolerance;          // m/s (rad/s)
  double accepted = 0.0;     // likewise, of Newton's method where it cannot reach the tolerance
  int tree_after = 1 << 30;  // sweeps before newton_tree.h; from newton_after on: never
};

/// Coulomb's law of rigid contacts as a row of convex programs, each corrected by the slip of the one before, in one
/// lane: for what Newton's method on the law itself, which has no energy to go down, cannot finish from where sweeps
/// end.
template <class T>
class CorrectedRun {
 public:
  CorrectedRun(ContactLawT<T> law, const NewtonT<T>& newton, const SolveBounds& bounds, int lane, ConstraintsT<T>& set,
               T* dz)
      : bounds_(bounds), lane_(lane), set_(set), dz_(dz) {
    set_number(law.convex, lane, 1.0);
    NewtonLane<T> of_lane(law, set, newton, lane);
    of_lane.begin(dz);
    problem_ = of_lane.problem();
  }

  static bool can(const ContactLawT<T>& law, int lane) {
    return !(number_of(law.convex, lane) > 0.0) && !(number_of(law.compliance, lane) > 0.0);
  }

  /// Returns whether it converges; if not, impulses and dz are as they were.
  bool run(T& residual) {
    for (int round = 0; round < kRounds; ++round) {
      problem_.convex = true;
      for (int n = 0; n < kCorrections; ++n) {
        if (!solve(n + round > 0 ? kNearEps : kFirstEps)) return false;
        const double changed = problem_.correct();
        if (changed <= bounds_.tolerance) return take(max(left_, changed), residual);
      }
      problem_.leave_uncorrected();
      if (solve(kNearEps)) return take(left_, residual);
      problem_.correct();
    }
    return false;
  }

  int steps() const { return steps_; }

 private:
  /// Newton's method from where the one before has ended.
  bool solve(double eps) {
    NewtonRun run(problem_, bounds_.tolerance, bounds_.accepted, eps);
    const bool converged = run.run(bounds_.most_newton_steps, false) == NewtonRun::End::converged && run.bears();
    steps_ += run.steps();
    left_ = run.left();
    return converged;
  }

  bool take(double left, T& residual) const {
    take_impulses(problem_, lane_, set_, dz_);
    set_number(residual, lane_, left);
    take_slips(problem_, lane_, set_);
    return true;
  }

  const SolveBounds& bounds_;
  int lane_;
  ConstraintsT<T>& set_;
  T* dz_;
  NewtonProblem problem_;
  int steps_ = 0;
  double left_ = 0.0;  // of the law, m/s
};

/// Newton's method from impulses and dz as sweeps have left them, in one lane. `residual` (m/s) in and out, `steps`
/// out. Returns whether it converges; if not, impulses and dz are as they were.
template <class T>
GRAZE_OUT_OF_LINE bool solve_by_newton(const ContactLawT<T>& law, const NewtonT<T>& newton, const SolveBounds& bounds,
                                       int lane, ConstraintsT<T>& set, T* dz, T& steps, T& residual) {
  using End = NewtonRun::End;
  int taken = 0;
  bool converged = false;
  for (int attempt = 0; attempt < 2; ++attempt) {
    const bool soft = attempt == 1;
    if (soft) soften(set, lane);
    NewtonLane<T> of_lane(law, set, newton, lane);
    if (soft) {
      of_lane.begin_at_rest();
    } else {
      of_lane.begin(dz);
    }
    NewtonRun run(of_lane.problem(), bounds.tolerance, bounds.accepted);
    const End end = run.run(bounds.most_newton_steps, soft);
    taken += run.steps();
    if (end != End::converged && !soft && CorrectedRun<T>::can(law, lane)) {
      CorrectedRun<T> corrected(law, newton, bounds, lane, set, dz);
      converged = corrected.run(residual);
      taken += corrected.steps();
      if (converged) break;
    }
    if (end == End::jammed) continue;
    // What has not converged is not taken: impulses that leave little of the laws may be large where these cannot be
    // met.
    converged = end == End::converged;
    if (!converged) break;
    take_impulses(of_lane.problem(), lane, set, dz);
    set_number(residual, lane, max(run.left(), soft ? giving_way(set, lane) : 0.0));
    take_slips(of_lane.problem(), lane, set);
    break;
  }
  set_number(steps, lane, taken);
  return converged;
}

/// Newton's method on all of `lanes` whose matrix is a tree's. Returns the lanes that converge; others keep impulses
/// and dz.
template <class T>
GRAZE_OUT_OF_LINE unsigned solve_by_tree(const ContactLawT<T>& law, const NewtonT<T>& newton, const SolveBounds& bounds,
                                         unsigned lanes, ConstraintsT<T>& set, T* dz, T& steps, T& residual) {
  if (lanes == 0) return 0;
  TreeNewton<T> run(newton, bounds.tolerance, bounds.accepted, set);
  lanes = run.eligible(law, lanes);
  return lanes == 0 ? 0 : run.run(lanes, bounds.most_newton_steps, dz, steps, residual);
}

/// Impulses and dz of all `lanes`: sweeps, then Newton's method where these have not converged, then what sweeps are
/// left. `steps`: sweeps and steps of Newton's method; `residual` (m/s): the last sweep's largest change of a velocity,
/// or what Newton's method has left of the laws; both per lane.
template <class T>
inline void solve_constraints(const ContactLawT<T>& law, const SolveBounds& bounds, unsigned lanes,
                              const NewtonT<T>& newton, ConstraintsT<T>& set, T* dz, T& steps, T& residual) {
  SweepsT<T> at;
  at.moving = mask_from_bits<T>(lanes);
  const int first = bounds.newton_after < bounds.most_sweeps ? bounds.newton_after : bounds.most_sweeps;
  T newton_steps(0.0);
  if (bounds.tree_after < first) {
    sweep<T>(law, bounds.tree_after, bounds.most_sweeps, bounds.tolerance, set, dz, at);
    at.moving = at.moving & !mask_from_bits<T>(solve_by_tree<T>(law, newton, bounds, bits(at.moving), set, dz,
                                                                newton_steps, at.residual));
  }
  sweep<T>(law, first, bounds.most_sweeps, bounds.tolerance, set, dz, at);
  if (at.done == 0) at.residual = T(1e300);
  if (bounds.newton_after < bounds.most_sweeps && any(at.moving)) {
    unsigned converged = 0;
    for (unsigned rest = bits(at.moving); rest != 0; rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      T taken(0.0);
      if (solve_by_newton<T>(law, newton, bounds, lane, set, dz, taken, at.residual)) converged |= 1u << lane;
      newton_steps += taken;
    }
    at.moving = at.moving & (!mask_from_bits<T>(converged));
    at.from = at.done - kPlainSweeps;
  }
  sweep<T>(law, bounds.most_sweeps, bounds.most_sweeps, bounds.tolerance, set, dz, at);
  steps = at.count + newton_steps;
  residual = at.residual;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
