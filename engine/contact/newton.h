#pragma once
// Contact impulses by Newton's method, for what sweeps (solver.h) cannot finish. Proximal point steps (Rockafellar
// 1976) make each law a function of velocity: with impulses k kept from the step before and R = eps times the contact's
// own A,
//   lambda(u) = law's projection of (R k - u) / (compliance + R),
// of which the velocities that go with them, D (z - free) = sum of Y lambda(b + Y^T z), are sought by a semi-smooth
// Newton (Qi & Sun 1993; of frictional contact Alart & Curnier 1991): z has one number per degree of freedom however
// many contacts there are, and redundant ones do no harm. Where it gets there, k becomes lambda and eps shrinks; R
// (lambda - k) is then what is left of the law, m/s. Where it does not, eps grows: large eps are easy, small ones
// exact.
//
// Newton's matrix, D + Y G Y^T with G = -d lambda / d u, is unsymmetric where contacts slide, because friction follows
// the normal force. It is eliminated from the leaves to the roots, like M, and has M's zeros but for contacts between
// branches.
//
// Few lanes need it at a time, and each its own number of steps. So each is solved by itself, with eight contacts or
// eight degrees of freedom in a register where elsewhere there are eight lanes.

#include <cstdint>

#include "engine/contact/newton_laws.h"
#include "engine/contact/newton_memory.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

using Eight = Pack<8>;

/// What Newton's method works on beside the constraints.
template <class T>
struct NewtonT {
  int nv;
  const T *inverse_D, *start, *free;  // L v at the beginning; its change by all but the constraints
  NewtonMemory memory;
  const TreeT<T>* tree = nullptr;  // for newton_tree.h
  const T* diagonal = nullptr;     // likewise, per degree of freedom: what M has beside the inertias of bodies
};

/// Our choices, found on 350 steps of a dozen robots that 60 sweeps had not finished: eps at first, its least and
/// largest, its factors after a success and a failure; Newton steps within a proximal step; halvings of a step.
inline constexpr double kFirstEps = 1e-2, kLeastEps = 1e-5, kLargestEps = 1.0, kShrink = 0.3, kGrow = 10.0;
inline constexpr int kNewtonSteps = 15, kHalvings = 4;
/// Compliance of jammed contacts, as a share of their own A: with the mass that they feel, a spring whose time constant
/// is a tenth of the step, R = A (tau / h)^2 (our choice).
inline constexpr double kJammedCompliance = 1e-2;
/// Overlap of jammed contacts, m, from which on it is told that they give way (our choice: far beyond what recovery
/// leaves of a step).
inline constexpr double kSunk = 1e-3;
/// How exactly velocities and impulses must fit at the end, as a share of the tolerance (our choice).
inline constexpr double kNewtonError = 0.03;
/// At the least eps proximal steps go on as long as each leaves less than this share of the step before: who ended
/// sooner would take for jammed what only converges slowly (our choice).
inline constexpr double kFalls = 0.9;
/// Least eps of all, for what is not solved at kLeastEps though Newton's method gets there: where a load is many times
/// as heavy as what the contact feels (R is a share of A), proximal steps take 1 / (1 + eps ratio) of what is left (our
/// choice).
inline constexpr double kLastEps = 1e-8;
/// The largest impulse that is believed there, and where Coulomb's law is solved by corrections, in units of the
/// momentum that the lane's motion has (our choice; a wedge of 1 in 3): what squeezes more is a jam that hardly gives
/// way.
inline constexpr double kMostSqueeze = 3.0;
/// Slope along a step that counts as none, as a share of that where it begins (0.01 to 0.8 are as good), and how often
/// it is looked at: our choice.
inline constexpr double kSlopeError = 0.1;
inline constexpr int kSlopes = 8;

/// Rows of Newton's matrix that are worked on side by side, so that what they have in common is loaded once: as many as
/// stay in registers. Each number sees the same sums in the same order, whatever it is.
#ifdef __AVX512F__
inline constexpr int kTile = 4;
#else
inline constexpr int kTile = 1;
#endif

/// Y of one contact or joint: a row per direction, in blocks of eight degrees of freedom of which at least one moves
/// it.
struct NewtonRow {
  int count;        // degrees of freedom that move it
  const int* dofs;  // descending or ascending
  int blocks;
  const int *block, *place;  // the blocks, ascending; which of them a block is
  double* y;                 // 8 blocks per direction

  double* of(int direction, int i) const { return y + 8 * (direction * blocks + i); }
  double& at(int direction, int dof) const { return y[8 * (direction * blocks + place[dof / 8]) + dof % 8]; }
};

/// Eight contacts, or fewer: what is behind them is open.
struct ContactsOfEight : ProximalContactT<Eight> {
  Vec3T<Eight> b, u, along;  // u: velocity where lambda was found; along: its change by the step
  Eight friction, compliance, guard;
  Eight felt;  // the guard, or 0 where overlap is deep
  Eight lift;  // of b.x, m/s: correct()
  int first, count;
  int dof_count;
  const int* dofs;  // that move some of them
  Vec3T<Eight>* columns;
};

/// Eight joints' rows likewise.
struct JointsOfEight : NewtonJointT<Eight> {
  Eight b, u, along, lower_gap, upper_gap, dry_gap, dry_compliance, dry_low, dry_high;
  int first, count;
  int dof_count;
  const int* dofs;
  Eight* columns;
};

static_assert(sizeof(ContactsOfEight) <= kNewtonEight * sizeof(double));
static_assert(sizeof(JointsOfEight) <= kNewtonEight * sizeof(double));
static_assert(sizeof(NewtonRow) <= kNewtonRow * sizeof(double));

/// Sum of the eight, always in the same order.
inline double sum(const Eight& a) {
  double x[8];
  store(x, a);
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}
inline double largest(const Eight& a) {
  double x[8];
  store(x, a);
  return max(max(max(x[0], x[4]), max(x[2], x[6])), max(max(x[1], x[5]), max(x[3], x[7])));
}

inline const double& number(const Eight& a, int i) { return reinterpret_cast<const double*>(&a)[i]; }

/// The contacts and joints of one lane.
struct NewtonProblem {
  bool convex;
  double momentum;                 // N s: sqrt of twice the energy before the impulses times all D
  int nv, width;                   // width: nv and what fills the last eight
  double *D, *inverse_D, *free;    // D: 1 where nothing moves; inverse_D: 0 there
  double *gradient, *step;         // D (z - free) - Y lambda; what Newton's method takes z on by
  double *z, *trial, *start;       // L v's change: now; tried; where the proximal step began
  double* H;                       // nv rows
  int contact_count, joint_count;  // rows
  NewtonRow *contacts, *joints;
  ContactsOfEight* contact_packs;
  JointsOfEight* joint_packs;
  std::uint64_t* filled;  // per degree of freedom: a set of those that share a row, or come to share one
  int* ancestors;         // per degree of freedom k: how many j < k H_kj is not zero of, these, how many blocks, these
  int* active;            // how many degrees of freedom rows move, these, descending

  const int* ancestors_of(int k) const { return ancestors + (nv + width / 8 + 2) * k; }

  /// All lambda and G at z; the gradient. Returns f^T D f with f = D^-1 gradient, J.
  GRAZE_OUT_OF_LINE double evaluate(double eps, const double* at) const {
    for (int k = 0; k < width; k += 8) {
      store(gradient + k, load<Eight>(D + k) * (load<Eight>(at + k) - load<Eight>(free + k)));
    }
    for (int i = 0; i < (contact_count + 7) / 8; ++i) visit(contact_packs[i], eps, at);
    for (int i = 0; i < (joint_count + 7) / 8; ++i) visit(joint_packs[i], eps, at);
    Eight merit(0.0);
    for (int k = 0; k < width; k += 8) {
      const Eight g = load<Eight>(gradient + k);
      merit = fma(g * load<Eight>(inverse_D + k), g, merit);
    }
    return sum(merit);
  }

  /// H = D + Y G Y^T.
  GRAZE_OUT_OF_LINE void assemble() const {
    for (int i = 1; i <= active[0]; ++i) {
      double* row = H + width * active[i];
      for (int k = 0; k < width; k += 8) store(row + k, Eight(0.0));
      row[active[i]] = D[active[i]];
    }
    for (int i = 0; i < contact_count; ++i) add(contacts[i], contact_packs[i / 8], i % 8);
    for (int i = 0; i < joint_count; ++i) {
      const double g = number(joint_packs[i / 8].g, i % 8);
      if (!(g > 0.0)) continue;
      const NewtonRow& row = joints[i];
      for (int a = 0; a < row.count; ++a) {
        const Eight left(row.at(0, row.dofs[a]) * g);
        double* out = H + width * row.dofs[a];
        for (int b = 0; b < row.blocks; ++b) {
          double* place = out + 8 * row.block[b];
          store(place, fma(left, load<Eight>(row.of(0, b)), load<Eight>(place)));
        }
      }
    }
  }

  /// step = -H^-1 gradient, by elimination from the leaves to the roots.
  GRAZE_OUT_OF_LINE void eliminate() const {
    double* x = step;
    for (int k = 0; k < width; k += 8) store(x + k, -(load<Eight>(gradient + k) * load<Eight>(inverse_D + k)));
    for (int i = 1; i <= active[0]; ++i) x[active[i]] = -gradient[active[i]];
    for (int i = 1; i <= active[0]; ++i) {
      const int k = active[i];
      const int *list = ancestors_of(k), *blocks = list + list[0] + 1;
      double* pivot = H + width * k;
      const double inverse = pivot[k] = 1.0 / pivot[k];
      // The nearest ancestor first: it is the next pivot in most cases, and all that follows waits for its inverse.
      int j = list[0];
      for (; j >= kTile; j -= kTile) take_pivot<kTile>(k, inverse, list + j - kTile + 1, blocks);
      for (; j >= 1; --j) take_pivot<1>(k, inverse, list + j, blocks);
    }
    for (int i = active[0]; i >= 1; --i) substitute(active[i]);
  }

  /// Where along the step the energy whose gradient this is, of the convex law, ends to fall, as a share of the step;
  /// at most 1. Its slope grows all the way, steeply behind the edges of cones: its root is looked for by Newton's
  /// method within bisection, of velocities of contacts and joints alone.
  GRAZE_OUT_OF_LINE double find_length(double eps) const {
    Eight slope_sum(0.0), stiff_sum(0.0);
    for (int k = 0; k < width; k += 8) {
      const Eight along = load<Eight>(step + k);
      slope_sum = fma(load<Eight>(gradient + k), along, slope_sum);
      stiff_sum = fma(load<Eight>(D + k) * along, along, stiff_sum);
    }
    const double downhill = sum(slope_sum), stiff = sum(stiff_sum);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      ContactsOfEight& c = contact_packs[i];
      c.along = {Eight(0.0), Eight(0.0), Eight(0.0)};
      for (int k = 0; k < c.dof_count; ++k) c.along = axpy(Eight(step[c.dofs[k]]), c.columns[k], c.along);
    }
    for (int i = 0; i < (joint_count + 7) / 8; ++i) {
      JointsOfEight& c = joint_packs[i];
      c.along = Eight(0.0);
      for (int k = 0; k < c.dof_count; ++k) c.along = fma(Eight(step[c.dofs[k]]), c.columns[k], c.along);
    }
    double length = 1.0, low = 0.0, high = 1.0;
    for (int n = 0; n < kSlopes; ++n) {
      const auto [slope, rate] = find_slope(eps, length, stiff, downhill);
      if (!(abs(slope) > -kSlopeError * downhill) || (slope <= 0.0 && length >= high)) break;
      (slope > 0.0 ? high : low) = length;
      const double newton = length - slope / rate;
      length = newton > low && newton < high ? newton : 0.5 * (low + high);
    }
    return length;
  }

  /// The largest R |lambda - kept|: what is left of the laws where Newton has got there, m/s.
  double left(double eps) const {
    Eight most(0.0);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      const ContactsOfEight& c = contact_packs[i];
      const Vec3T<Eight> off = c.lambda - c.kept;
      most = max(most, max(c.rn * abs(off.x), c.rt * sqrt(fma(off.y, off.y, off.z * off.z))));
    }
    for (int i = 0; i < (joint_count + 7) / 8; ++i) {
      const JointsOfEight& c = joint_packs[i];
      const Eight off = max(abs(c.lambda[0] - c.kept[0]), abs(c.lambda[1] - c.kept[1]));
      most = max(most, c.r * max(off, abs(c.lambda[2] - c.kept[2])));
    }
    return eps * largest(most);
  }

  /// The largest impulse that contacts keep along n, N s.
  double pressed() const {
    Eight most(0.0);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) most = max(most, contact_packs[i].kept.x);
    return largest(most);
  }

  /// The largest velocity that contacts keep because of the compliance that only holds A regular (guard_of), m/s. Where
  /// it shows, impulses squeeze a jammed body without end.
  double squeezed() const {
    Eight most(0.0);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      const ContactsOfEight& c = contact_packs[i];
      most = max(most, c.felt * max(c.lambda.x, max(abs(c.lambda.y), abs(c.lambda.z))));
    }
    return largest(most);
  }

  /// Contacts' normal velocities shall be mu |u_t| more than the convex law sees: where they are, its solution is that
  /// of Coulomb's law (de Saxce & Feng 1998). Returns by how much that has changed, m/s.
  double correct() const {
    Eight most(0.0);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      ContactsOfEight& c = contact_packs[i];
      const Vec3T<Eight> u = velocity(c, z);
      const Eight s = fma(c.guard, c.kept.y, u.y), t = fma(c.guard, c.kept.z, u.z);
      const Eight lift = c.friction * sqrt(fma(s, s, t * t));
      most = max(most, abs(lift - c.lift));
      c.b.x += lift - c.lift;
      c.lift = lift;
    }
    return largest(most);
  }

  /// From where corrections have led, on by Coulomb's law itself.
  void leave_uncorrected() {
    convex = false;
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      ContactsOfEight& c = contact_packs[i];
      c.b.x -= c.lift;
      c.lift = Eight(0.0);
    }
  }

  /// The impulses become those that are kept.
  void keep() const {
    for (int i = 0; i < (contact_count + 7) / 8; ++i) contact_packs[i].kept = contact_packs[i].lambda;
    for (int i = 0; i < (joint_count + 7) / 8; ++i) {
      for (int k = 0; k < 3; ++k) joint_packs[i].kept[k] = joint_packs[i].lambda[k];
    }
  }

  /// Contacts' velocities at z without their own compliance.
  Vec3T<Eight> velocity(const ContactsOfEight& c, const double* at) const {
    Vec3T<Eight> u = c.b;
    for (int i = 0; i < c.dof_count; ++i) u = axpy(Eight(at[c.dofs[i]]), c.columns[i], u);
    return u;
  }

  /// Takes Y times impulses from the gradient.
  void take(const NewtonRow& row, double n, double s, double t) const {
    for (int b = 0; b < row.blocks; ++b) {
      double* g = gradient + 8 * row.block[b];
      const Eight rest =
          fnma(Eight(s), load<Eight>(row.of(1, b)), fnma(Eight(n), load<Eight>(row.of(0, b)), load<Eight>(g)));
      store(g, fnma(Eight(t), load<Eight>(row.of(2, b)), rest));
    }
  }
  void take(const NewtonRow& row, double impulse) const {
    for (int b = 0; b < row.blocks; ++b) {
      double* g = gradient + 8 * row.block[b];
      store(g, fnma(Eight(impulse), load<Eight>(row.of(0, b)), load<Eight>(g)));
    }
  }

 private:
  struct Slope {
    double value, rate;
  };

  /// The slope a share `length` along the step, and its derivative. stiff: step^T D step; downhill: the slope at 0.
  /// From differences of impulses, because those of energies round.
  Slope find_slope(double eps, double length, double stiff, double downhill) const {
    Eight value(0.0), rate(0.0);
    for (int i = 0; i < (contact_count + 7) / 8; ++i) {
      ContactsOfEight c = contact_packs[i];
      const Vec3T<Eight> before = c.lambda;
      find_impulses<Eight>(convex, Eight(eps), axpy(Eight(length), c.along, c.u), c, c);
      value -= dot(c.along, c.lambda - before);
      rate += dot(c.along, Vec3T<Eight>{dot(c.n, c.along), dot(c.s, c.along), dot(c.t, c.along)});
    }
    for (int i = 0; i < (joint_count + 7) / 8; ++i) {
      JointsOfEight c = joint_packs[i];
      const Eight before = c.lambda[0] - c.lambda[1] + c.lambda[2];
      find_impulses<Eight>(Eight(eps), fma(Eight(length), c.along, c.u), c, c);
      value -= c.along * (c.lambda[0] - c.lambda[1] + c.lambda[2] - before);
      rate += c.g * c.along * c.along;
    }
    return {fma(length, stiff, downhill) + sum(value), stiff + sum(rate)};
  }

  void visit(ContactsOfEight& c, double eps, const double* at) const {
    c.u = velocity(c, at);
    find_impulses<Eight>(convex, Eight(eps), c.u, c, c);
    for (int i = 0; i < c.count; ++i) {
      const double n = number(c.lambda.x, i);
      if (n > 0.0) take(contacts[c.first + i], n, number(c.lambda.y, i), number(c.lambda.z, i));
    }
  }

  void visit(JointsOfEight& c, double eps, const double* at) const {
    c.u = c.b;
    for (int i = 0; i < c.dof_count; ++i) c.u = fma(Eight(at[c.dofs[i]]), c.columns[i], c.u);
    find_impulses<Eight>(Eight(eps), c.u, c, c);
    const Eight impulse = c.lambda[0] - c.lambda[1] + c.lambda[2];
    for (int i = 0; i < c.count; ++i) take(joints[c.first + i], number(impulse, i));
  }

  /// Adds Y G Y^T of a contact.
  void add(const NewtonRow& row, const ContactsOfEight& pack, int i) const {
    if (!(number(pack.n.x, i) > 0.0)) return;  // open: G = 0
    Vec3T<Eight> GY[eights(kMostNewtonDofs)];
    const Eight nn(number(pack.n.x, i)), ns(number(pack.n.y, i)), nt(number(pack.n.z, i));
    const Eight sn(number(pack.s.x, i)), ss(number(pack.s.y, i)), st(number(pack.s.z, i));
    const Eight tn(number(pack.t.x, i)), ts(number(pack.t.y, i)), tt(number(pack.t.z, i));
    for (int b = 0; b < row.blocks; ++b) {
      const Eight n = load<Eight>(row.of(0, b)), s = load<Eight>(row.of(1, b)), t = load<Eight>(row.of(2, b));
      GY[b] = {fma(nt, t, fma(ns, s, nn * n)), fma(st, t, fma(ss, s, sn * n)), fma(tt, t, fma(ts, s, tn * n))};
    }
    int a = 0;
    for (; a + kTile <= row.count; a += kTile) add_to_rows<kTile>(row, row.dofs + a, GY);
    for (; a < row.count; ++a) add_to_rows<1>(row, row.dofs + a, GY);
  }

  /// Likewise, to H's rows of N degrees of freedom.
  template <int N>
  void add_to_rows(const NewtonRow& row, const int* dofs, const Vec3T<Eight>* GY) const {
    Vec3T<Eight> y[N];
    double* out[N];
    GRAZE_UNROLL
    for (int r = 0; r < N; ++r) {
      const int dof = dofs[r];
      const double* at = row.y + 8 * row.place[dof / 8] + dof % 8;
      y[r] = {Eight(at[0]), Eight(at[8 * row.blocks]), Eight(at[16 * row.blocks])};
      out[r] = H + width * dof;
    }
    for (int b = 0; b < row.blocks; ++b) {
      const int first = 8 * row.block[b];
      const Vec3T<Eight> right = GY[b];
      GRAZE_UNROLL
      for (int r = 0; r < N; ++r) store(out[r] + first, dot_add(y[r], right, load<Eight>(out[r] + first)));
    }
  }

  /// Takes the pivot's row k from those of N of its ancestors.
  template <int N>
  void take_pivot(int k, double inverse, const int* rows, const int* blocks) const {
    const double* pivot = H + width * k;
    double* row[N];
    Eight share[N];
    GRAZE_UNROLL
    for (int r = 0; r < N; ++r) {
      row[r] = H + width * rows[r];
      const double s = row[r][k] * inverse;
      step[rows[r]] = fnma(s, step[k], step[rows[r]]);
      share[r] = Eight(s);
    }
    // From k on, the rows keep what is of no further use.
    for (int b = 1; b <= blocks[0]; ++b) {
      const int first = 8 * blocks[b];
      const Eight right = load<Eight>(pivot + first);
      GRAZE_UNROLL
      for (int r = 0; r < N; ++r) store(row[r] + first, fnma(share[r], right, load<Eight>(row[r] + first)));
    }
  }

  /// x_k when those of its ancestors are known.
  void substitute(int k) const {
    const int* list = ancestors_of(k);
    const double* row = H + width * k;
    const auto take = [&](int j, double& part) { part = fnma(row[list[j]], step[list[j]], part); };
    double a = 0.0, b = 0.0, c = 0.0, d = step[k];
    int j = 1;
    for (; j + 3 <= list[0]; j += 4) take(j, a), take(j + 1, b), take(j + 2, c), take(j + 3, d);
    if (j <= list[0]) take(j, a);
    if (j + 1 <= list[0]) take(j + 1, b);
    if (j + 2 <= list[0]) take(j + 2, c);
    step[k] = ((d + a) + (b + c)) * row[k];
  }
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
