#pragma once
// Contact impulses by block Gauss-Seidel: one 3 x 3 problem per contact, exactly on Coulomb's cone (no pyramid), swept
// until every lane's largest change of a contact velocity is below a tolerance. A lane that has got there is frozen by
// mask, so that its bits do not depend on how long its neighbours need.
//
// Fixed points of a sweep are the solutions of the model:
//   complementarity (Stewart & Trinkle 1996, Anitescu & Potra 1997):
//     0 <= lambda_n  _|_  u_n + gap term >= 0,   lambda_t = argmax of dissipation in the disc |lambda_t| <= mu lambda_n
//   complementarity_free (Anitescu 2006; Drumwright & Shell 2010): the convex programme
//     min 1/2 lambda^T A lambda + lambda^T b  over the cone  |lambda_t| <= mu lambda_n
//   compliant: the first with a regularised normal row (see gap_term).

#include "engine/contact/constraint.h"
#include "engine/contact/joint_row.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// lambda(alpha) = (A + alpha K)^-1 rhs with K = diag(kappa mu^2, 1, 1), kappa = 1 for the convex model and 0 for the
/// others, by elimination of the normal. `flow`: kappa mu^2 alpha.
template <class T>
struct SlipSystemT {
  T inverse_nn, ks, kt, Sss, Sst, Stt, inverse_det;

  SlipSystemT(const ContactT<T>& c, const T& alpha, const T& flow, bool some_flow) {
    inverse_nn = some_flow ? recip(c.ann + flow) : c.inverse_ann;
    ks = c.ans * inverse_nn, kt = c.ant * inverse_nn;
    Sss = fnma(c.ans, ks, c.ass + alpha);
    Sst = fnma(c.ans, kt, c.ast);
    Stt = fnma(c.ant, kt, c.att + alpha);
    inverse_det = recip(fnma(Sst, Sst, Sss * Stt));
  }

  Vec3T<T> solve(const Vec3T<T>& rhs) const {
    const T cs = fnma(ks, rhs.x, rhs.y), ct = fnma(kt, rhs.x, rhs.z);
    const T s = fnma(Sst, ct, Stt * cs) * inverse_det, t = fnma(Sst, cs, Sss * ct) * inverse_det;
    return {fnma(kt, t, fnma(ks, s, inverse_nn * rhs.x)), s, t};
  }
};

/// The impulse of a sliding contact: u_n = 0 (convex: mu |u_t|), u_t = -alpha lambda_t with alpha > 0, and
/// |lambda_t| = mu lambda_n, which leaves one equation for alpha. Newton on mu lambda_n / |lambda_t| = 1, which is
/// nearly linear (as the radius equation of trust-region methods: Conn, Gould, Toint 2000, §7.3), one step per visit:
/// later sweeps go on from where it stopped.
template <class T>
inline Vec3T<T> slip_impulse(ContactT<T>& c, const mask_of<T>& slides, const Vec3T<T>& free, const T& kappa_mu2,
                             bool some_flow) {
  const Vec3T<T> rhs = -free;
  const T alpha = c.slip_rate;
  const SlipSystemT<T> system(c, alpha, kappa_mu2 * alpha, some_flow);
  const Vec3T<T> at = system.solve(rhs);
  const Vec3T<T> rate = -system.solve({kappa_mu2 * at.x, at.y, at.z});  // d lambda / d alpha
  const T length2 = fma(at.y, at.y, at.z * at.z), length = sqrt(length2);
  const T slope = c.friction * fnma(at.x, fma(at.y, rate.y, at.z * rate.z), rate.x * length2);
  const T next = fma(length - c.friction * at.x, length2 * recip(slope), alpha);
  const T better = select((slope > T(0.0)) & (next < T(1e12)), max(next, T(0.0)), alpha);
  c.slip_rate = select(slides, better, c.slip_rate);
  const Vec3T<T> x = SlipSystemT<T>(c, better, kappa_mu2 * better, some_flow).solve(rhs);
  const T tangent2 = fma(x.y, x.y, x.z * x.z);
  const auto regular = (x.x > T(0.0)) & (tangent2 > T(0.0));
  // On the cone exactly. Where friction jams the normal (Painleve) the tangent is given up.
  const T normal = select(regular, x.x, max(T(0.0), rhs.x * c.inverse_ann));
  const T scale = select(regular, c.friction * normal * recip(sqrt(select(regular, tangent2, T(1.0)))), T(0.0));
  return {normal, scale * x.y, scale * x.z};
}

/// Change of L v during a sweep. The six numbers of the floating tree that was asked for last stay in registers: every
/// contact on it waits for them.
template <class T>
class ChangeT {
 public:
  explicit ChangeT(T* dz) : dz_(dz) {
    for (int d = 0; d < 6; ++d) base_[d] = T(0.0);
  }

  /// All numbers in memory, until the next turn_to().
  T* in_memory() {
    leave();
    return dz_;
  }
  /// Puts the base of the path in place; -1: its dofs are all in memory.
  void turn_to(const PathView& path) {
    if (path.base == at_) return;
    leave();
    at_ = path.base;
    if (at_ < 0) return;
    GRAZE_UNROLL
    for (int d = 0; d < 6; ++d) base_[d] = dz_[at_ + d];
  }
  T& base(int d) { return base_[d]; }
  T& operator[](int dof) { return dz_[dof]; }

 private:
  void leave() {
    if (at_ < 0) return;
    GRAZE_UNROLL
    for (int d = 0; d < 6; ++d) dz_[at_ + d] = base_[d];
    at_ = -1;
  }

  T* dz_;
  int at_ = -1;
  T base_[6];
};

/// Adds what impulse `change` (local) at the contact does to dz.
template <class T>
inline void apply_impulse(const PathView& path, const ContactT<T>& c, const Vec3T<T>& change, ChangeT<T>& dz) {
  const Vec3T<T>* scaled = c.y + path.count;
  const int loose = path.base < 0 ? path.count : path.count - 6;
  for (int i = 0; i < loose; ++i) dz[path.dofs[i]] = dot_add(scaled[i], change, dz[path.dofs[i]]);
  if (path.base < 0) return;
  GRAZE_UNROLL
  for (int d = 0; d < 6; ++d) dz.base(d) = dot_add(scaled[loose + 5 - d], change, dz.base(d));
}

/// A lambda for the contact's own A.
template <class T>
inline Vec3T<T> times_A(const ContactT<T>& c, const Vec3T<T>& v) {
  return {fma(c.ant, v.z, fma(c.ans, v.y, c.ann * v.x)), fma(c.ast, v.z, fma(c.ass, v.y, c.ans * v.x)),
          fma(c.att, v.z, fma(c.ast, v.y, c.ant * v.x))};
}

template <class T>
inline Vec3T<T> times_inverse_A(const ContactT<T>& c, const Vec3T<T>& v) {
  return {fma(c.bnt, v.z, fma(c.bns, v.y, c.bnn * v.x)), fma(c.bst, v.z, fma(c.bss, v.y, c.bns * v.x)),
          fma(c.btt, v.z, fma(c.bst, v.y, c.bnt * v.x))};
}

/// Velocity of the contact, local, without and with its own impulse's compliance.
template <class T>
inline Vec3T<T> contact_velocity(const PathView& path, const ContactT<T>& c, ChangeT<T>& dz) {
  // Two chains of sums, because a sum waits for the one before it.
  Vec3T<T> even = c.b, odd{c.compliance * c.lambda.x, c.guard * c.lambda.y, c.guard * c.lambda.z};
  const int loose = path.base < 0 ? path.count : path.count - 6;
  for (int i = 0; i < loose; ++i) even = axpy(dz[path.dofs[i]], c.y[i], even);
  if (path.base >= 0) {
    const Vec3T<T>* y = c.y + loose;
    odd = axpy(dz.base(5), y[0], odd), odd = axpy(dz.base(4), y[1], odd), odd = axpy(dz.base(3), y[2], odd);
    odd = axpy(dz.base(2), y[3], odd), odd = axpy(dz.base(1), y[4], odd), even = axpy(dz.base(0), y[5], even);
  }
  return even + odd;
}

/// One contact's turn: the impulse that solves its own problem, given all others', or a share of the
/// way there. Returns how much its velocity changed, m/s.
template <class T>
inline T relax_contact(const ContactLawT<T>& law, const PathView& path, bool some_convex, const mask_of<T>& moving,
                       double share, ContactT<T>& c, ChangeT<T>& dz) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  const Vec3T<T> u = contact_velocity(path, c, dz), free = u - times_A(c, c.lambda);
  const Vec3T<T> still = c.lambda - times_inverse_A(c, u);
  const T radius = c.friction * still.x;
  const auto sticks = (still.x >= T(0.0)) & (fma(still.y, still.y, still.z * still.z) <= radius * radius);
  auto parts = free.x >= T(0.0);
  T kappa_mu2(0.0);
  if (some_convex) {
    const auto convex = law.convex > T(0.0);
    const T opening = c.friction * sqrt(fma(free.y, free.y, free.z * free.z));
    parts = free.x >= select(convex, opening, T(0.0));  // the dual cone
    kappa_mu2 = select(convex, c.friction * c.friction, T(0.0));
  }
  const auto turn = moving & mask_from_bits<T>(c.lanes);
  const auto slides = !(sticks | parts);
  Vec3T<T> next = select(sticks, still, zero);
  if (any(turn & slides)) next = select(slides, slip_impulse(c, turn & slides, free, kappa_mu2, some_convex), next);
  next = select(turn, next, c.lambda);
  const Vec3T<T> change = T(share) * (next - c.lambda);
  c.lambda += change;
  c.slips = select(turn, select(slides, T(1.0), T(0.0)), c.slips);
  apply_impulse(path, c, change, dz);
  const T most = max(max(abs(change.x) * c.ann, abs(change.y) * c.ass), abs(change.z) * c.att);
  return T(1.0 / share) * most;
}

/// The constraints of a block in one step.
template <class T>
struct ConstraintsT {
  ContactT<T>* contacts;
  int contact_count;
  JointRowT<T>* joints;
  int joint_count;
  int servo_count = 0;  // rows of bounded drives, the last of the joints
  const PathView* paths;
};

/// Sweeps after which impulses go half the way only: a foot wedged between two surfaces can make full steps cycle, and
/// a cone is convex, so that half steps stay on it.
inline constexpr int kFullSweeps = 10;

/// Sweeps until all lanes of `lanes` are done. `sweeps` and `residual` (m/s) are per lane.
template <class T>
inline void solve_constraints(const TopologyView& t, const ContactLawT<T>& law, int most_sweeps, double tolerance,
                              unsigned lanes, ConstraintsT<T>& set, T* dz, T& sweeps, T& residual) {
  auto moving = mask_from_bits<T>(lanes);
  const bool some_convex = any(law.convex > T(0.0));
  sweeps = T(0.0);
  residual = T(0.0);
  ChangeT<T> change(dz);
  for (int sweep = 0; sweep < most_sweeps && any(moving); ++sweep) {
    const double share = sweep < kFullSweeps ? 1.0 : 0.5;
    T worst(0.0);
    for (int i = 0; i < set.joint_count; ++i)
      worst = max(worst, relax_joint<T>(t, moving, set.joints[i], change.in_memory()));
    for (int i = 0; i < set.contact_count; ++i) {
      ContactT<T>& c = set.contacts[i];
      change.turn_to(set.paths[c.path]);
      worst = max(worst, relax_contact<T>(law, set.paths[c.path], some_convex, moving, share, c, change));
    }
    residual = select(moving, worst, residual);
    sweeps = select(moving, T(sweep + 1.0), sweeps);
    moving = moving & (worst > T(tolerance));
  }
  change.in_memory();
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
