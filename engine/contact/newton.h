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
// Newton's matrix, I + D^-1 Y G Y^T with G = -d lambda / d u, is unsymmetric where contacts slide, because friction
// follows the normal force. It is eliminated from the leaves to the roots, like M, and has M's zeros but for contacts
// between branches.

#include "engine/contact/solver.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A contact in Newton's method.
template <class T>
struct NewtonContactT {
  Vec3T<T> kept, lambda;  // impulses, N s
  Vec3T<T> n, s, t;       // rows of G, kg
};

/// A joint's row likewise: lower, upper, dry.
template <class T>
struct NewtonRowT {
  T kept[3], lambda[3];
  T g;
};

/// Working memory of Newton's method: nv numbers and lists of nv indices.
template <class T>
struct NewtonMemoryT {
  int nv = 0;
  T *H = nullptr, *f = nullptr, *step = nullptr, *trial = nullptr, *start = nullptr, *before = nullptr;
  NewtonContactT<T>* contacts = nullptr;
  NewtonRowT<T>* rows = nullptr;
  unsigned char* filled = nullptr;  // nv x nv: where H may be other than zero
  int* ancestors = nullptr;         // per degree of freedom k: how many j < k have H_kj, and these
};

/// Our choices, found on 350 steps of a dozen robots that 60 sweeps had not finished: eps at first, its least and
/// largest, its factors after a success and a failure; Newton steps within a proximal step; halvings of a step.
inline constexpr double kFirstEps = 1e-2, kLeastEps = 1e-5, kLargestEps = 1.0, kShrink = 0.3, kGrow = 10.0;
inline constexpr int kNewtonSteps = 15, kHalvings = 4;
/// Compliance of jammed contacts, as a share of their own A: with the mass that they feel, a spring whose time constant
/// is a tenth of the step, R = A (tau / h)^2 (our choice).
inline constexpr double kJammedCompliance = 1e-2;
/// How exactly velocities and impulses must fit, as a share of the tolerance (our choice).
inline constexpr double kNewtonError = 0.03;

/// Marks the degrees of freedom that a row moves, all with all.
inline void mark_row(int nv, int count, const int* dofs, unsigned char* filled) {
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) filled[dofs[i] * nv + dofs[j]] = 1;
  }
}

/// Where H may be other than zero, and what elimination fills.
template <class T>
GRAZE_OUT_OF_LINE void find_pattern(const ConstraintsT<T>& set, NewtonMemoryT<T>& memory) {
  const int nv = memory.nv;
  for (int i = 0; i < nv * nv; ++i) memory.filled[i] = 0;
  for (int i = 0; i < set.contact_count; ++i) {
    const int path = set.contacts[i].path;
    if (i > 0 && path == set.contacts[i - 1].path) continue;
    mark_row(nv, set.paths[path].count, set.paths[path].dofs, memory.filled);
  }
  for (int i = 0; i < set.joint_count; ++i) mark_row(nv, set.joints[i].count, set.joints[i].dofs, memory.filled);
  for (int k = nv - 1; k >= 0; --k) {
    int* list = memory.ancestors + (nv + 1) * k;
    int count = 0;
    for (int j = 0; j < k; ++j) {
      if (memory.filled[k * nv + j]) list[++count] = j;
    }
    list[0] = count;
    mark_row(nv, count, list + 1, memory.filled);
  }
}

/// R of a contact for eps = 1, along n and across. The convex model projects on a cone and has one for both.
template <class T>
struct ProximalT {
  T n, t;

  ProximalT(const ContactLawT<T>& law, const ContactT<T>& c) {
    const T all = T(1.0 / 3.0) * (c.ann + c.ass + c.att);
    const auto convex = law.convex > T(0.0);
    n = select(convex, all, c.ann);
    t = select(convex, all, max(c.ass, c.att));
  }
};

/// lambda and G of Coulomb's law from x = (R kept - u) / W, wn and wt = 1 / W.
template <class T>
inline void project_coulomb(const T& mu, const Vec3T<T>& x, const T& wn, const T& wt, NewtonContactT<T>& out) {
  const T zero(0.0);
  const auto open = !(x.x > zero);
  const T normal = select(open, zero, x.x), radius = mu * normal;
  const T length = sqrt(fma(x.y, x.y, x.z * x.z));
  const auto slips = (!open) & (length > radius);
  const T inverse = recip(select(slips, length, T(1.0)));
  const T share = select(slips, radius * inverse, select(open, zero, T(1.0)));
  const T y = x.y * inverse, z = x.z * inverse;
  out.lambda = {normal, share * x.y, share * x.z};
  const T gn = select(open, zero, wn), gt = share * wt;
  const T pull = select(slips, mu * gn, zero), bend = select(slips, gt, zero);
  const T across = -(bend * (y * z));
  out.n = {gn, zero, zero};
  out.s = {pull * y, fnma(bend * y, y, gt), across};
  out.t = {pull * z, across, fnma(bend * z, z, gt)};
}

/// Likewise of the convex law: the nearest point of the cone, and its derivative.
template <class T>
GRAZE_OUT_OF_LINE void project_cone(const T& mu, const Vec3T<T>& x, const T& w, NewtonContactT<T>& out) {
  const T zero(0.0), one(1.0);
  const T length = sqrt(fma(x.y, x.y, x.z * x.z));
  const auto inside = length <= mu * x.x;
  const T part = recip(fma(mu, mu, one));
  const T normal = fma(mu, length, x.x) * part;
  const auto open = (!inside) & (!(normal > zero));
  const auto side = (!inside) & (!open);
  const T inverse = recip(select(side, length, one));
  const T y = x.y * inverse, z = x.z * inverse, across = mu * normal * inverse;
  const T share = select(inside, one, select(open, zero, across));
  out.lambda = {select(inside, x.x, select(open, zero, normal)), share * x.y, share * x.z};
  const T gn = select(inside, w, select(open, zero, part * w)), gt = share * w;
  const T tilt = select(side, mu, zero), pull = gn * tilt, bend = select(side, fnma(tilt, pull, gt), zero);
  out.n = {gn, pull * y, pull * z};
  out.s = {pull * y, fnma(bend * y, y, gt), -(bend * (y * z))};
  out.t = {pull * z, -(bend * (y * z)), fnma(bend * z, z, gt)};
}

/// What Newton's method works on in a step.
template <class T>
struct NewtonT {
  const ContactLawT<T>& law;
  ConstraintsT<T>& set;
  const T *inverse_D, *free;
  NewtonMemoryT<T>& memory;
  bool some_convex;

  /// lambda and G of a contact at z; takes D^-1 Y lambda from f.
  void visit(const ContactT<T>& c, const T& eps, const T* z, NewtonContactT<T>& out) const {
    const PathView& path = set.paths[c.path];
    const Vec3T<T> zero{T(0.0), T(0.0), T(0.0)};
    Vec3T<T> u = c.b;
    for (int i = 0; i < path.count; ++i) u = axpy(z[path.dofs[i]], c.y[i], u);
    const ProximalT<T> R(law, c);
    const T rn = eps * R.n, rt = eps * R.t, wn = recip(c.compliance + rn), wt = recip(c.guard + rt);
    const Vec3T<T> x{fma(rn, out.kept.x, -u.x) * wn, fma(rt, out.kept.y, -u.y) * wt, fma(rt, out.kept.z, -u.z) * wt};
    project_coulomb<T>(c.friction, x, wn, wt, out);
    if (some_convex) {
      NewtonContactT<T> cone;
      project_cone<T>(c.friction, x, wn, cone);
      const auto convex = law.convex > T(0.0);
      out.lambda = select(convex, cone.lambda, out.lambda);
      out.n = select(convex, cone.n, out.n);
      out.s = select(convex, cone.s, out.s);
      out.t = select(convex, cone.t, out.t);
    }
    const auto valid = mask_from_bits<T>(c.lanes);
    out.lambda = select(valid, out.lambda, zero);
    out.n = select(valid, out.n, zero), out.s = select(valid, out.s, zero), out.t = select(valid, out.t, zero);
    const Vec3T<T>* scaled = c.y + path.count;
    for (int i = 0; i < path.count; ++i) {
      T& f = memory.f[path.dofs[i]];
      f -= dot(scaled[i], out.lambda);
    }
  }

  /// The same of a joint's row.
  void visit(const JointRowT<T>& row, const T& eps, const T* z, NewtonRowT<T>& out) const {
    const T zero(0.0), u = speed_of(row, z), r = eps * recip(row.inverse_a), w = recip(r);
    const T dry_w = recip(row.dry_compliance + r);
    const T lower = fma(r, out.kept[0], -(u + row.lower_gap)) * w, upper = fma(r, out.kept[1], u - row.upper_gap) * w;
    const T dry = fma(r, out.kept[2], -(u + row.dry_gap)) * dry_w;
    const auto valid = mask_from_bits<T>(row.lanes);
    const auto gives = (dry > row.dry_low) & (dry < row.dry_high);
    out.lambda[0] = select(valid, max(lower, zero), zero);
    out.lambda[1] = select(valid, max(upper, zero), zero);
    out.lambda[2] = select(valid, min(max(dry, row.dry_low), row.dry_high), zero);
    const T g = select(lower > zero, w, zero) + select(upper > zero, w, zero) + select(gives, dry_w, zero);
    out.g = select(valid, g, zero);
    const T impulse = out.lambda[0] - out.lambda[1] + out.lambda[2];
    for (int d = 0; d < row.count; ++d) {
      T& f = memory.f[row.dofs[d]];
      f = fnma(row.y[row.count + d], impulse, f);
    }
  }

  /// All lambda and G at z, f = z - free - D^-1 Y lambda, in `lanes`: rows that none of them has are left out, here and
  /// below. Returns f^T D f, J.
  GRAZE_OUT_OF_LINE T evaluate(unsigned lanes, const T& eps, const T* z) const {
    for (int k = 0; k < memory.nv; ++k) memory.f[k] = z[k] - free[k];
    for (int i = 0; i < set.contact_count; ++i) {
      if (set.contacts[i].lanes & lanes) visit(set.contacts[i], eps, z, memory.contacts[i]);
    }
    for (int i = 0; i < set.joint_count; ++i) {
      if (set.joints[i].lanes & lanes) visit(set.joints[i], eps, z, memory.rows[i]);
    }
    T merit(0.0);
    for (int k = 0; k < memory.nv; ++k) {
      const auto moves = inverse_D[k] > T(0.0);
      const T f = select(moves, memory.f[k], T(0.0));
      merit = fma(f * recip(select(moves, inverse_D[k], T(1.0))), f, merit);
    }
    return merit;
  }

  /// H = I + D^-1 Y G Y^T.
  GRAZE_OUT_OF_LINE void assemble(unsigned lanes) const {
    const int nv = memory.nv;
    T* H = memory.H;
    for (int k = 0; k < nv; ++k) {
      const int* list = memory.ancestors + (nv + 1) * k;
      H[k * nv + k] = T(1.0);
      for (int j = 1; j <= list[0]; ++j) H[k * nv + list[j]] = H[list[j] * nv + k] = T(0.0);
    }
    for (int i = 0; i < set.contact_count; ++i) {
      const ContactT<T>& c = set.contacts[i];
      const NewtonContactT<T>& own = memory.contacts[i];
      if ((c.lanes & lanes & bits(own.n.x > T(0.0))) == 0) continue;  // open: G = 0
      const PathView& path = set.paths[c.path];
      for (int a = 0; a < path.count; ++a) {
        const Vec3T<T>& y = c.y[path.count + a];
        const Vec3T<T> left = y.x * own.n + y.y * own.s + y.z * own.t;
        T* row = H + path.dofs[a] * nv;
        for (int b = 0; b < path.count; ++b) row[path.dofs[b]] = dot_add(left, c.y[b], row[path.dofs[b]]);
      }
    }
    for (int i = 0; i < set.joint_count; ++i) {
      const JointRowT<T>& joint = set.joints[i];
      if ((joint.lanes & lanes & bits(memory.rows[i].g > T(0.0))) == 0) continue;
      for (int a = 0; a < joint.count; ++a) {
        const T left = joint.y[joint.count + a] * memory.rows[i].g;
        T* row = H + joint.dofs[a] * nv;
        for (int b = 0; b < joint.count; ++b) row[joint.dofs[b]] = fma(left, joint.y[b], row[joint.dofs[b]]);
      }
    }
  }

  /// step = -H^-1 f, by elimination from the leaves to the roots.
  GRAZE_OUT_OF_LINE void eliminate() const {
    const int nv = memory.nv;
    T *H = memory.H, *x = memory.step;
    for (int k = 0; k < nv; ++k) x[k] = -memory.f[k];
    for (int k = nv - 1; k >= 0; --k) {
      const int* list = memory.ancestors + (nv + 1) * k;
      const T* pivot = H + k * nv;
      const T inverse = recip(pivot[k]);
      for (int i = 1; i <= list[0]; ++i) {
        T* row = H + list[i] * nv;
        const T share = row[k] * inverse;
        x[list[i]] = fnma(share, x[k], x[list[i]]);
        for (int j = 1; j <= list[0]; ++j) row[list[j]] = fnma(share, pivot[list[j]], row[list[j]]);
      }
    }
    for (int k = 0; k < nv; ++k) {
      const int* list = memory.ancestors + (nv + 1) * k;
      T sum = x[k];
      for (int j = 1; j <= list[0]; ++j) sum = fnma(H[k * nv + list[j]], x[list[j]], sum);
      x[k] = sum * recip(H[k * nv + k]);
    }
  }

  /// The largest R |lambda - kept|: what is left of the laws where Newton has got there, m/s.
  T left(unsigned lanes, const T& eps) const {
    T most(0.0);
    for (int i = 0; i < set.contact_count; ++i) {
      if ((set.contacts[i].lanes & lanes) == 0) continue;
      const ProximalT<T> R(law, set.contacts[i]);
      const Vec3T<T> off = memory.contacts[i].lambda - memory.contacts[i].kept;
      most = max(most, max(R.n * abs(off.x), R.t * sqrt(fma(off.y, off.y, off.z * off.z))));
    }
    for (int i = 0; i < set.joint_count; ++i) {
      if ((set.joints[i].lanes & lanes) == 0) continue;
      const NewtonRowT<T>& row = memory.rows[i];
      const T off = max(abs(row.lambda[0] - row.kept[0]), abs(row.lambda[1] - row.kept[1]));
      most = max(most, max(off, abs(row.lambda[2] - row.kept[2])) * recip(set.joints[i].inverse_a));
    }
    return eps * most;
  }

  /// The largest velocity that contacts keep because of the compliance that only holds A regular (guard_of), m/s. Where
  /// it shows, impulses squeeze a jammed body without end.
  T squeezed(unsigned lanes) const {
    T most(0.0);
    for (int i = 0; i < set.contact_count; ++i) {
      const ContactT<T>& c = set.contacts[i];
      if ((c.lanes & lanes) == 0) continue;
      const Vec3T<T>& x = memory.contacts[i].lambda;
      const T held = c.guard * max(x.x, max(abs(x.y), abs(x.z)));
      most = max(most, select(c.phi < -c.deep, T(0.0), held));
    }
    return most;
  }

  /// In `lanes`: the impulses become those that are kept.
  void keep(const mask_of<T>& lanes) const {
    for (int i = 0; i < set.contact_count; ++i) {
      if ((set.contacts[i].lanes & bits(lanes)) == 0) continue;
      NewtonContactT<T>& own = memory.contacts[i];
      own.kept = select(lanes, own.lambda, own.kept);
    }
    for (int i = 0; i < set.joint_count; ++i) {
      if ((set.joints[i].lanes & bits(lanes)) == 0) continue;
      NewtonRowT<T>& own = memory.rows[i];
      for (int k = 0; k < 3; ++k) own.kept[k] = select(lanes, own.lambda[k], own.kept[k]);
    }
  }
};

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
