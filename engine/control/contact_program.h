#pragma once
// The convex program of inverse dynamics with contact (dissertation §7.5, Eqs. 103-108 and 136-137). Joints move as
// they are told, so that only six velocities of the base, and of each object that is held, are free: with x these, A
// their blocks of M, and impulses lambda on Coulomb's cones K (no pyramid),
//   stage I    least  1/2 lambda^T J_b A^-1 J_b^T lambda + lambda^T (J_b x_free + J_q v_q + gap terms)
//   stage II   of its solutions the one of least  1/2 |t|^2,  t = t_free - J_q^T lambda   (joint impulses).
// Both are one program with the weight eps on the second. It is that of a robot whose joints give way a little: mass
// diag(A, 1/eps), free velocities z_free = (x_free, v_q - eps t_free). In velocities z = (x, y) it has one unknown per
// degree of freedom however many contacts there are:
//   least  1/2 |z - z_free|^2   with  J z + gap terms  in the dual cones of K.
// Where the joints' velocities contradict the contacts, y tells the nearest ones that do not (Eqs. 78-82).
//
// The method of multipliers (Hestenes 1969; Rockafellar 1976): lambda(z) = P_K(kept - u / R), Newton on the convex
// function that results, then kept := lambda. R falls below eps, so that stage II converges as well.

#include "engine/contact/newton.h"
#include "engine/control/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A point of the robot, or of an object, on what it touches. All numbers are T: memory is counted in doubles.
template <class T>
struct ProgramContactT : ContactFrameT<T> {
  T friction;
  T gap;                   // gap term, m/s
  T a;                     // about the contact's own A, 1/kg
  NewtonContactT<T> cone;  // kept, lambda (N s) and d lambda / d u
  T w;                     // 1/R in this minimisation, kg
  Vec3T<T> u, along;       // velocity with its gap term where the cone was evaluated, m/s, and its change by the step
};

/// R as a share of the contact's A: at first, its factors after a success and a failure, and at last (a share of eps).
/// The first two are our choice, of those that take LINKS the fewest steps, standing on four feet and on ten.
inline constexpr double kFirstR = 1e-2, kShrinkR = 0.03, kGrowR = 30, kLastR = 0.1;
inline constexpr int kMultiplierSteps = 40, kProgramNewtonSteps = 20;
/// Where the wrench on the base and the impulses count as found, as shares of weight times time and of the largest
/// impulse (our choice: the first is far below what an engine resolves, the second below what a motor does); and how
/// many times the first is left as long as R is not the last.
inline constexpr double kWrenchError = 1e-10, kImpulseError = 1e-5, kEarlyError = 1e6;

/// What the sums of gradients round: as shares of the largest impulse, of the joints' momenta and of velocities.
inline constexpr double kRounding = 1e-12, kRoundingOfSums = 2e-15, kRoundingOfVelocities = 1e-16;

/// As project_cone(), on the impulses that press: friction without bound.
template <class T>
inline void project_half_space(const Vec3T<T>& x, const T& w, NewtonContactT<T>& out) {
  const T zero(0.0);
  const auto presses = x.x > zero;
  out.lambda = {select(presses, x.x, zero), x.y, x.z};
  out.n = {select(presses, w, zero), zero, zero};
  out.s = {zero, w, zero};
  out.t = {zero, zero, w};
}

template <class T>
struct ContactProgramT {
  TreeT<T> tree;  // M is H, the Hessian; of the topology's, degrees of freedom alone (InverseDynamicsView::program)
  const T* A;     // M
  int count;
  ProgramContactT<T>* contacts;
  Vec3T<T>* jacobian;  // `room` per contact: local columns of the dofs above it, from the base
  int room;
  const int* last_dof;     // per contact
  const unsigned* lanes;   // per contact
  const T *free, *weight;  // nv; weight of joints, 1/eps
  T *z, *step, *trial, *gradient;
  bool slips;  // Coulomb's cones; else forces along the ground have no bound, and stop what slides
  int free_count;
  const FreeBodyView* bodies;  // that are free; in H above all joints
  int joint_begin, joint_end;  // degrees of freedom that are joints'

  int dofs_above(int i) const { return tree.topology.dof_depth[last_dof[i]] + 1; }
  const int* path(int i) const { return tree.topology.chain + tree.topology.row[last_dof[i]]; }

  /// J of contact i times `rates`, added to u, m/s.
  Vec3T<T> add_velocity(int i, const T* rates, Vec3T<T> u) const {
    const Vec3T<T>* J = jacobian + room * i;
    const int* dofs = path(i);
    for (int d = 0; d < dofs_above(i); ++d) u = axpy(rates[dofs[d]], J[d], u);
    return u;
  }

  /// lambda and its derivative where contact i has the velocity u, m/s.
  void project(int i, const Vec3T<T>& u, NewtonContactT<T>& out) const {
    const ProgramContactT<T>& c = contacts[i];
    const Vec3T<T> x = c.cone.kept - c.w * u;
    if (slips) {
      project_cone<T>(c.friction, x, c.w, out);
    } else {
      project_half_space<T>(x, c.w, out);
    }
    const auto valid = mask_from_bits<T>(lanes[i]);
    const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
    out.lambda = select(valid, out.lambda, none);
    out.n = select(valid, out.n, none);
    out.s = select(valid, out.s, none), out.t = select(valid, out.t, none);
  }

  /// out = mass times rates.
  void times_mass(const T* rates, T* out) const {
    for (int k = joint_begin; k < joint_end; ++k) out[k] = weight[k] * rates[k];
    for (int i = 0; i < free_count; ++i) {
      const int first = bodies[i].dof;
      const T* M = A + bodies[i].mass;
      for (int k = 0; k < 6; ++k) {
        T sum(0.0);
        for (int d = 0; d < 6; ++d) {
          sum = fma(M[k > d ? base_entry(k, d) : base_entry(d, k)], rates[first + d], sum);
        }
        out[first + k] = sum;
      }
    }
  }

  /// All lambda at `at`; gradient = mass (at - free) - J^T lambda.
  GRAZE_OUT_OF_LINE void evaluate(const T* at) const {
    for (int k = 0; k < tree.topology.nv; ++k) trial[k] = at[k] - free[k];
    times_mass(trial, gradient);
    for (int i = 0; i < count; ++i) {
      ProgramContactT<T>& c = contacts[i];
      c.u = add_velocity(i, at, {c.gap, T(0.0), T(0.0)});
      project(i, c.u, c.cone);
      const Vec3T<T>* J = jacobian + room * i;
      const int* dofs = path(i);
      for (int d = 0; d < dofs_above(i); ++d) gradient[dofs[d]] -= dot(J[d], c.cone.lambda);
    }
  }

  /// step = -H^-1 gradient with H = mass + J^T G J.
  GRAZE_OUT_OF_LINE void find_step() const {
    const TopologyView& t = tree.topology;
    for (int k = 0; k < t.nv; ++k) {
      for (int d = 0; d < t.dof_depth[k]; ++d) tree.M[t.row[k] + d] = T(0.0);
      tree.M[t.row[k] + t.dof_depth[k]] = weight[k];
      step[k] = -gradient[k];
    }
    for (int i = 0; i < free_count; ++i) {
      for (int k = 0; k < 6; ++k) {
        T* row = tree.M + t.row[bodies[i].dof + k] + t.dof_depth[bodies[i].dof];
        for (int d = 0; d <= k; ++d) row[d] = A[bodies[i].mass + base_entry(k, d)];
      }
    }
    for (int i = 0; i < count; ++i) {
      const NewtonContactT<T>& c = contacts[i].cone;
      const Vec3T<T>* J = jacobian + room * i;
      const int* dofs = path(i);
      for (int a = 0; a < dofs_above(i); ++a) {
        const Vec3T<T> left = J[a].x * c.n + J[a].y * c.s + J[a].z * c.t;
        T* row = tree.M + t.row[dofs[a]];
        for (int b = 0; b <= a; ++b) row[b] = dot_add(left, J[b], row[b]);
      }
    }
    factor_and_solve<T>(tree, step);
    solve_L<T>(tree, step);
  }

  /// step^T a.
  T along_step(const T* a) const {
    T sum(0.0);
    for (int k = 0; k < tree.topology.nv; ++k) sum = fma(a[k], step[k], sum);
    return sum;
  }

  /// What is left of the balance of impulses beyond what rounds: sums of impulses and momenta, and velocities, which
  /// 1/R makes impulses of.
  T unbalanced() const {
    T most(0.0), impulse(0.0), stiffest(0.0), speed(0.0);
    for (int k = 0; k < tree.topology.nv; ++k) {
      most = max(most, fnma(T(kRoundingOfSums) * weight[k], abs(z[k]) + abs(free[k]), abs(gradient[k])));
      speed = max(speed, abs(z[k]));
    }
    for (int i = 0; i < count; ++i) {
      impulse = max(impulse, norm2(contacts[i].cone.lambda));
      stiffest = max(stiffest, select(mask_from_bits<T>(lanes[i]), contacts[i].w, T(0.0)));
    }
    return most - fma(T(kRounding), sqrt(impulse), T(kRoundingOfVelocities) * speed * stiffest);
  }

  /// The slope a share `length` along the step, and its derivative by it. stiff: step^T mass step; downhill: the slope
  /// at 0. From differences of impulses, because those of energies round.
  void find_slope(const T& length, const T& stiff, const T& downhill, T& slope, T& rate) const {
    slope = fma(length, stiff, downhill), rate = stiff;
    for (int i = 0; i < count; ++i) {
      const ProgramContactT<T>& c = contacts[i];
      NewtonContactT<T> there;
      project(i, axpy(length, c.along, c.u), there);
      slope -= dot(c.along, there.lambda - c.cone.lambda);
      rate += dot(c.along, Vec3T<T>{dot(there.n, c.along), dot(there.s, c.along), dot(there.t, c.along)});
    }
  }

  /// Along the step to where the function ends to fall, or to its end. The slope grows all the way, but hardly to the
  /// edge of a cone and steeply behind it: a step that is shortened by the slope at its end alone would stop before the
  /// edge again and again. So its root is looked for, by Newton's method within bisection (of the contacts' velocities
  /// alone). Evaluates there.
  GRAZE_OUT_OF_LINE void move(const mask_of<T>& open) const {
    const int nv = tree.topology.nv;
    const T downhill = along_step(gradient);
    times_mass(step, trial);
    const T stiff = along_step(trial);
    for (int i = 0; i < count; ++i) contacts[i].along = add_velocity(i, step, {T(0.0), T(0.0), T(0.0)});
    T length(1.0), low(0.0), high(1.0), slope, rate;
    mask_of<T> searching = open;
    for (int n = 0; n < kSlopes && any(searching); ++n) {
      find_slope(length, stiff, downhill, slope, rate);
      const auto uphill = slope > T(0.0);
      searching = searching & (abs(slope) > T(-kSlopeError) * downhill) & (uphill | (length < high));
      high = select(uphill, length, high), low = select(uphill, low, length);
      const T newton = fnma(slope, recip(rate), length);
      const auto between = (newton > low) & (newton < high);
      length = select(searching, select(between, newton, T(0.5) * (low + high)), length);
    }
    for (int k = 0; k < nv; ++k) z[k] = select(open, fma(length, step[k], z[k]), z[k]);
    evaluate(z);
  }

  /// Newton's method for one R, in the lanes of `open`. wrench: N s, error that counts as none. Returns where it has
  /// not got there.
  mask_of<T> minimise(const T& share, mask_of<T> open, const T& wrench) const {
    for (int i = 0; i < count; ++i) contacts[i].w = recip(share * contacts[i].a);
    evaluate(z);
    open = open & (unbalanced() > wrench);
    for (int n = 0; n < kProgramNewtonSteps && any(open); ++n) {
      find_step();
      move(open);
      open = open & (unbalanced() > wrench);
    }
    return open;
  }

  /// kept := lambda in `open`. Returns where they differ by more than this share of the largest.
  mask_of<T> keep(const mask_of<T>& open, double error) const {
    T most(0.0), change(0.0);
    for (int i = 0; i < count; ++i) {
      NewtonContactT<T>& c = contacts[i].cone;
      const Vec3T<T> off = c.lambda - c.kept;
      most = max(most, norm2(c.lambda));
      change = max(change, norm2(off));
      c.kept = select(open, c.lambda, c.kept);
    }
    return open & (change > T(error * error) * most);
  }

  /// Solves in the lanes of `open`, from z and the impulses that are kept. share: R at first. eps: as the weights have
  /// it, without its unit. wrench: as minimise(). `final`: until stage II has settled, to `error`; else the wrench on
  /// the base does.
  void solve(mask_of<T> open, T share, double eps, const T& wrench, bool final, double error = kImpulseError) const {
    const T last(kLastR * eps);
    for (int n = 0; n < kMultiplierSteps && any(open); ++n) {
      const mask_of<T> failed = minimise(share, open, select(share > last, T(kEarlyError) * wrench, wrench));
      const mask_of<T> changes = keep(open & !failed, error);
      const mask_of<T> early = failed | (share > last);  // no R but the last tells
      open = open & (final ? early | changes : early);
      share = select(failed, min(T(kGrowR) * share, T(1.0)), max(T(kShrinkR) * share, last));
    }
  }
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
