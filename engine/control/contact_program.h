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
    if (lanes[i] == (1u << kWidth<T>)-1) return;
    const auto valid = mask_from_bits<T>(lanes[i]);
    const Vec3T<T> none{T(0.0), T(0.0), T(0.0)};
    out.lambda = select(valid, out.lambda, none);
    out.n = select(valid, out.n, none);
    out.s = select(valid, out.s, none), out.t = select(valid, out.t, none);
  }

  /// out = mass times rates.
  void times_mass(const T* rates, T* out) const {
    const T* const own = weight;
    for (int k = joint_begin, end = joint_end; k < end; ++k) out[k] = own[k] * rates[k];
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
    T *const off = trial, *const out = gradient;
    const T* const from = free;
    for (int k = 0, nv = tree.topology.nv; k < nv; ++k) off[k] = at[k] - from[k];
    times_mass(off, out);
    for (int i = 0; i < count; ++i) {
      ProgramContactT<T>& c = contacts[i];
      c.u = add_velocity(i, at, {c.gap, T(0.0), T(0.0)});
      project(i, c.u, c.cone);
      const Vec3T<T>*J = jacobian + room * i, lambda = c.cone.lambda;
      const int* dofs = path(i);
      for (int d = 0, n = dofs_above(i); d < n; ++d) out[dofs[d]] -= dot(J[d], lambda);
    }
  }

  /// Adds J^T G J of contact i to H's rows of the N degrees of freedom from `a` on its way: side by side, so that what
  /// they have in common is loaded once.
  template <int N>
  void add_rows(int i, int a) const {
    const NewtonContactT<T>& c = contacts[i].cone;
    const Vec3T<T>* J = jacobian + room * i;
    const int* dofs = path(i);
    Vec3T<T> left[N];
    T* row[N];
    GRAZE_UNROLL
    for (int k = 0; k < N; ++k) {
      left[k] = J[a + k].x * c.n + J[a + k].y * c.s + J[a + k].z * c.t;
      row[k] = tree.M + tree.topology.row[dofs[a + k]];
    }
    for (int b = 0; b <= a; ++b) {
      const Vec3T<T> right = J[b];
      GRAZE_UNROLL
      for (int k = 0; k < N; ++k) row[k][b] = dot_add(left[k], right, row[k][b]);
    }
    GRAZE_UNROLL
    for (int k = 1; k < N; ++k) {
      for (int b = a + 1; b <= a + k; ++b) row[k][b] = dot_add(left[k], J[b], row[k][b]);
    }
  }

  /// step = -H^-1 gradient with H = mass + J^T G J.
  GRAZE_OUT_OF_LINE void find_step() const {
    const TopologyView t = tree.topology;  // a copy: what is written could be a part of it, for all that is known
    T *const H = tree.M, *const x = step;
    const T *const own = weight, *const downhill = gradient;
    for (int k = 0; k < t.nv; ++k) {
      T* const row = H + t.row[k];
      const int depth = t.dof_depth[k];
      for (int d = 0; d < depth; ++d) row[d] = T(0.0);
      row[depth] = own[k];
      x[k] = -downhill[k];
    }
    for (int i = 0; i < free_count; ++i) {
      for (int k = 0; k < 6; ++k) {
        T* const row = H + t.row[bodies[i].dof + k] + t.dof_depth[bodies[i].dof];
        const T* const mass = A + bodies[i].mass;
        for (int d = 0; d <= k; ++d) row[d] = mass[base_entry(k, d)];
      }
    }
    for (int i = 0; i < count; ++i) {
      int a = 0;
      const int n = dofs_above(i);
      for (; a + 3 <= n; a += 3) add_rows<3>(i, a);
      for (; a < n; ++a) add_rows<1>(i, a);
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
    T* const at = z;
    const T* const way = step;
    for (int k = 0; k < nv; ++k) at[k] = select(open, fma(length, way[k], at[k]), at[k]);
    evaluate(at);
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
