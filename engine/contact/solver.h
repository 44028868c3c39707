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

/// lambda(alpha) = (A + alpha K)^-1 rhs with K = diag(0, 1, 1), by elimination of the normal.
template <class T>
struct SlipSystemT {
  T inverse_nn, ks, kt, Sss, Sst, Stt, inverse_det;

  SlipSystemT(const ContactT<T>& c, const T& alpha) : inverse_nn(c.inverse_ann) {
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

/// A lambda for the contact's own A.
template <class T>
inline Vec3T<T> times_A(const ContactT<T>& c, const Vec3T<T>& v) {
  return {fma(c.ant, v.z, fma(c.ans, v.y, c.ann * v.x)), fma(c.ast, v.z, fma(c.ass, v.y, c.ans * v.x)),
          fma(c.att, v.z, fma(c.ast, v.y, c.ant * v.x))};
}

/// lambda(alpha) and the Newton step from it towards mu lambda_n / |lambda_t| = 1, which is nearly linear in alpha (as
/// the radius equation of trust-region methods: Conn, Gould, Toint 2000, section 7.3).
template <class T>
struct SlipStepT {
  Vec3T<T> at;
  T excess;  // |lambda_t| - mu lambda_n: positive where alpha is too small
  T next;    // alpha of the Newton step
  mask_of<T> sound;

  SlipStepT(const ContactT<T>& c, const Vec3T<T>& rhs, const T& alpha) {
    const SlipSystemT<T> system(c, alpha);
    at = system.solve(rhs);
    const Vec3T<T> rate = -system.solve({T(0.0), at.y, at.z});  // d lambda / d alpha
    const T length2 = fma(at.y, at.y, at.z * at.z), length = sqrt(length2);
    const T slope = c.friction * fnma(at.x, fma(at.y, rate.y, at.z * rate.z), rate.x * length2);
    excess = fnma(c.friction, at.x, length);
    next = fma(excess, length2 * recip(slope), alpha);
    sound = (slope > T(0.0)) & (next < T(1e12));
  }
};

/// alpha by bisection and Newton where one step has not got there: excess is positive at alpha = 0, where the contact
/// would stick beyond its cone, and negative for large alpha, where friction vanishes; so there is a root.
template <class T>
GRAZE_OUT_OF_LINE T find_slip_rate(const ContactT<T>& c, mask_of<T> searching, const Vec3T<T>& rhs, T alpha) {
  T low(0.0), high(1e300);
  const T scale = T(0.1) * (c.ass + c.att);
  for (int i = 0; i < 60 && any(searching); ++i) {
    const SlipStepT<T> step(c, rhs, alpha);
    searching = searching & !(abs(step.excess) <= T(1e-9) * c.friction * step.at.x);
    const auto below = step.excess > T(0.0);
    low = select(searching & below, alpha, low);
    high = select(searching & !below, alpha, high);
    const auto good = step.sound & (step.next > low) & (step.next < high);
    const T middle = select(high < T(1e299), T(0.5) * (low + high), fma(T(4.0), low, scale));
    alpha = select(searching, select(good, step.next, middle), alpha);
  }
  return alpha;
}

/// How near a Newton step must have come: |lambda_t| / (mu lambda_n) - 1. Our choice.
inline constexpr double kNear = 0.1;

/// The impulse of a sliding contact: u_n = 0, u_t = -alpha lambda_t with alpha > 0, and |lambda_t| = mu lambda_n, which
/// leaves one equation for alpha. One Newton step per visit, because later sweeps go on from where it stopped, and more
/// where that has not come near.
template <class T>
inline Vec3T<T> slip_impulse(ContactT<T>& c, const mask_of<T>& slides, const Vec3T<T>& free) {
  const Vec3T<T> rhs = -free;
  const SlipStepT<T> step(c, rhs, c.slip_rate);
  T alpha = select(step.sound, max(step.next, T(0.0)), c.slip_rate);
  Vec3T<T> x = SlipSystemT<T>(c, alpha).solve(rhs);
  T length = sqrt(fma(x.y, x.y, x.z * x.z));
  const T reach = c.friction * x.x;
  const auto far = slides & !(abs(length - reach) <= T(kNear) * reach);
  if (any(far)) {
    alpha = select(far, find_slip_rate<T>(c, far, rhs, alpha), alpha);
    const Vec3T<T> found = SlipSystemT<T>(c, alpha).solve(rhs);
    x = select(far, found, x);
    length = select(far, sqrt(fma(found.y, found.y, found.z * found.z)), length);
  }
  c.slip_rate = select(slides, alpha, c.slip_rate);
  // On the cone exactly.
  const T normal = max(x.x, T(0.0)), scale = c.friction * normal * recip(max(length, T(1e-300)));
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

/// The point of the cone |t| <= mu n that is nearest to x.
template <class T>
inline Vec3T<T> onto_cone(const Vec3T<T>& x, const T& mu) {
  const T length = sqrt(fma(x.y, x.y, x.z * x.z));
  const T normal = fma(mu, length, x.x) * recip(fma(mu, mu, T(1.0)));
  const T scale = mu * normal * recip(max(length, T(1e-300)));
  const Vec3T<T> side{normal, scale * x.y, scale * x.z}, zero{T(0.0), T(0.0), T(0.0)};
  return select(length <= mu * x.x, x, select(normal <= T(0.0), zero, side));
}

/// The impulse of a contact of the convex model that slides: the least of E = 1/2 x^T A x + x^T free on the cone's
/// side. There x = rho w with w = (1, mu e), rho = -w^T free / w^T A w, which leaves the direction e: two Newton steps
/// from the gradient projection of the impulse that is there. The better of projection and Newton is taken, so that
/// every visit lowers the energy of all contacts (Beck & Tetruashvili 2013: block descent then converges).
template <class T>
GRAZE_OUT_OF_LINE Vec3T<T> convex_slip(const ContactT<T>& c, const Vec3T<T>& u, const Vec3T<T>& free) {
  const T mu = c.friction;
  const Vec3T<T> projected = onto_cone(c.lambda - recip(c.ann + c.ass + c.att) * u, mu);
  const auto energy = [&](const Vec3T<T>& x) { return dot(x, T(0.5) * times_A(c, x) + free); };
  const T length = sqrt(fma(projected.y, projected.y, projected.z * projected.z));
  const auto some = length > T(1e-150);
  const T scale = recip(select(some, length, T(1.0)));
  T y = select(some, scale * projected.y, T(1.0)), z = select(some, scale * projected.z, T(0.0));
  for (int i = 0; i < 2; ++i) {
    const Vec3T<T> w{T(1.0), mu * y, mu * z}, g = times_A(c, w);
    const T q = dot(w, g), b = dot(w, free);
    // d E / d angle is proportional to G = e' . (free_t q - b g_t), with e' = (-z, y).
    const T fy = fnma(b, g.y, free.y * q), fz = fnma(b, g.z, free.z * q);
    const T G = fma(y, fz, -(z * fy));
    const T across = fma(y, g.z, -(z * g.y)), pull = fma(y, free.z, -(z * free.y));
    const T stiff = fma(y, fma(c.att, y, -(c.ast * z)), -(z * fma(c.ast, y, -(c.ass * z))));
    const T bend = fma(mu, fma(pull, across, -(b * stiff)), -fma(y, fy, z * fz));
    const T turn = select(bend > T(0.0), max(min(-(G * recip(bend)), T(1.0)), T(-1.0)), T(0.0));
    const T shorter = recip(sqrt(fma(turn, turn, T(1.0))));
    const T next = shorter * fnma(turn, z, y);
    z = shorter * fma(turn, y, z);
    y = next;
  }
  const Vec3T<T> w{T(1.0), mu * y, mu * z};
  const Vec3T<T> newton = max(T(0.0), -(dot(w, free) * recip(dot(w, times_A(c, w))))) * w;
  return select(energy(newton) < energy(projected), newton, projected);
}

/// What approaches slower than that without a contact's impulse is left alone, m/s: of many feet some carry nothing but
/// rounding, and their slip rates are beyond all bounds (our choice, a millionth of the tolerance).
inline constexpr double kNothing = -1e-12;

/// One contact's turn: the impulse that solves its own problem, given all others', or a share of the
/// way there. Returns how much its velocity changed, m/s.
template <class T>
inline T relax_contact(const ContactLawT<T>& law, const PathView& path, bool some_convex, const mask_of<T>& moving,
                       double share, ContactT<T>& c, ChangeT<T>& dz) {
  const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
  const Vec3T<T> u = contact_velocity(path, c, dz);
  const Vec3T<T> still = c.lambda - times_inverse_A(c, u);
  const T radius = c.friction * still.x;
  const auto sticks = (still.x >= T(0.0)) & (fma(still.y, still.y, still.z * still.z) <= radius * radius);
  const auto turn = moving & mask_from_bits<T>(c.lanes);
  Vec3T<T> next = select(sticks, still, zero);
  auto slides = turn & !sticks;
  if (any(slides)) {
    const Vec3T<T> free = u - times_A(c, c.lambda);
    if (some_convex) {
      const auto convex = law.convex > T(0.0);
      const T opening = c.friction * sqrt(fma(free.y, free.y, free.z * free.z));
      slides = slides & !(free.x >= select(convex, opening, T(kNothing)));  // the dual cone
      const auto cone = slides & convex, disc = slides & !convex;
      if (any(disc)) next = select(disc, slip_impulse(c, disc, free), next);
      if (any(cone)) next = select(cone, convex_slip(c, u, free), next);
    } else {
      slides = slides & !(free.x >= T(kNothing));
      if (any(slides)) next = select(slides, slip_impulse(c, slides, free), next);
    }
  }
  next = select(turn, next, c.lambda);
  const Vec3T<T> change = T(share) * (next - c.lambda);
  c.lambda += change;
  c.slips = select(turn, select(slides, T(1.0), T(0.0)), c.slips);
  apply_impulse(path, c, change, dz);
  const T most = max(max(abs(change.x) * c.ann, abs(change.y) * c.ass), abs(change.z) * c.att);
  return T(1.0 / share) * most;
}

/// What a contact's impulses were in the sweeps before, for accelerate().
template <class T>
struct SweepMemoryT {
  Vec3T<T> start;          // lambda before the sweep, N s
  Vec3T<T> change, swept;  // change of its own velocity in the sweep before, m/s, and lambda after that
  Vec3T<T> step;           // lambda after this sweep less `swept`
};

/// The constraints of a block in one step.
template <class T>
struct ConstraintsT {
  ContactT<T>* contacts;
  int contact_count;
  JointRowT<T>* joints;
  int joint_count;
  int servo_count = 0;  // rows of bounded drives, the last of the joints
  const PathView* paths;
  SweepMemoryT<T>* memory;  // per contact
};

/// Bound of gamma: beyond it the two changes are nearly equal, and their difference is noise (our choice).
inline constexpr double kFarthest = 4.0;

/// Anderson's acceleration of depth one (J. ACM 12, 1965; Walker & Ni 2011): with f = change of the impulses in a sweep
/// that ends at g, the next one starts from g - gamma (g - g_before), gamma = the least squares of f - gamma (f -
/// f_before). Contacts that wedge a body share one slow mode, which this removes. `first`: there is no f_before yet.
/// `worst`, `before`: residuals of this sweep and the last; where they grow, the step is not taken.
template <class T>
GRAZE_OUT_OF_LINE void accelerate(ConstraintsT<T>& set, const mask_of<T>& moving, bool first, const T& worst,
                                  const T& before, T* change_of_Lv) {
  ChangeT<T> dz(change_of_Lv);
  const unsigned lanes = bits(moving);  // what others touch adds nothing
  T along(0.0), length(0.0);
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    if ((c.lanes & lanes) == 0) continue;
    SweepMemoryT<T>& memory = set.memory[i];
    const Vec3T<T> f = c.lambda - memory.start;
    const Vec3T<T> change{c.ann * f.x, c.ass * f.y, c.att * f.z};
    const Vec3T<T> more = change - memory.change;
    memory.step = c.lambda - memory.swept;
    memory.change = change;
    memory.swept = c.lambda;
    along = dot_add(more, change, along);
    length = dot_add(more, more, length);
  }
  const auto sound = moving & (length > T(0.0)) & (worst < T(2.0) * before);
  const T gamma = select(sound, max(min(along * recip(max(length, T(1e-300))), T(kFarthest)), T(-kFarthest)), T(0.0));
  for (int i = 0; i < set.contact_count; ++i) {
    ContactT<T>& c = set.contacts[i];
    if ((c.lanes & lanes) == 0) continue;
    if (!first) {
      const Vec3T<T> change = -gamma * set.memory[i].step;
      c.lambda += change;
      dz.turn_to(set.paths[c.path]);
      apply_impulse(set.paths[c.path], c, change, dz);
    }
    set.memory[i].start = c.lambda;
  }
  dz.in_memory();
}

/// Sweeps are plain at first, which is all that most steps need; then accelerated; and where that has not converged
/// either, impulses go half the way only: full steps can cycle. (Cones are convex, so that half steps stay on them.)
inline constexpr int kPlainSweeps = 4, kAcceleratedSweeps = 40;

/// How far the sweeps of a step are.
template <class T>
struct SweepsT {
  mask_of<T> moving;  // lanes that have not converged
  int done = 0;       // sweeps
  int from = 0;       // sweep from which they count as plain
  T count{0.0};       // sweeps per lane
  T residual{0.0};    // per lane, m/s: the largest change of a velocity in its last sweep
};

/// Sweeps on until all lanes have converged or `until` sweeps are done; `most`: when the solve ends.
template <class T>
inline void sweep(const ContactLawT<T>& law, int until, int most, double tolerance, ConstraintsT<T>& set, T* dz,
                  SweepsT<T>& at) {
  const bool some_convex = any(law.convex > T(0.0));
  ChangeT<T> change(dz);
  for (; at.done < until && any(at.moving); ++at.done) {
    const int since = at.done - at.from;
    if (since == kPlainSweeps) {
      for (int i = 0; i < set.contact_count; ++i) set.memory[i].start = set.contacts[i].lambda;
    }
    const bool damped = at.done >= kPlainSweeps + kAcceleratedSweeps;
    const double share = damped ? 0.5 : 1.0;
    const unsigned going_on = bits(at.moving);
    T worst(0.0);
    for (int i = 0; i < set.joint_count; ++i) {
      if ((set.joints[i].lanes & going_on) == 0) continue;
      worst = max(worst, relax_joint<T>(at.moving, set.joints[i], change.in_memory()));
    }
    for (int i = 0; i < set.contact_count; ++i) {
      ContactT<T>& c = set.contacts[i];
      if ((c.lanes & going_on) == 0) continue;
      change.turn_to(set.paths[c.path]);
      worst = max(worst, relax_contact<T>(law, set.paths[c.path], some_convex, at.moving, share, c, change));
    }
    at.count = select(at.moving, T(at.done + 1.0), at.count);
    const auto going = at.moving & (worst > T(tolerance));
    const bool last = at.done + 1 == most || at.done + 1 == kPlainSweeps + kAcceleratedSweeps;
    if (since >= kPlainSweeps && !damped && !last) {
      accelerate<T>(set, going, since == kPlainSweeps, worst, at.residual, change.in_memory());
    }
    at.residual = select(at.moving, worst, at.residual);
    at.moving = going;
  }
  change.in_memory();
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
