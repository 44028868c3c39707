#pragma once
// The laws of contacts and joints as Newton's method (newton.h) sees them: impulses as functions of velocity, and their
// derivatives.

#include "engine/contact/solver.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// A contact in Newton's method.
template <class T>
struct NewtonContactT {
  Vec3T<T> kept, lambda;  // impulses, N s
  Vec3T<T> n, s, t;       // rows of G = -d lambda / d u, kg
};

/// Likewise in proximal steps.
template <class T>
struct ProximalContactT : NewtonContactT<T> {
  T rn, rt;  // R for eps = 1, along n and across, 1/kg
};

/// A joint's row in Newton's method. kept, lambda: lower, upper, dry.
template <class T>
struct NewtonJointT {
  T kept[3], lambda[3], g, r;
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
inline void project_cone(const T& mu, const Vec3T<T>& x, const T& w, NewtonContactT<T>& out) {
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

/// lambda and G of a contact at velocity u (m/s), with its friction, compliance and guard.
template <class T, class Contact>
inline void find_impulses(bool convex, const T& eps, const Vec3T<T>& u, const Contact& c, ProximalContactT<T>& out) {
  const Vec3T<T>& kept = out.kept;
  const T rn = eps * out.rn, rt = eps * out.rt;
  const T wn = recip(c.compliance + rn), wt = recip(c.guard + rt);
  const Vec3T<T> x{fma(rn, kept.x, -u.x) * wn, fma(rt, kept.y, -u.y) * wt, fma(rt, kept.z, -u.z) * wt};
  if (convex) {
    project_cone<T>(c.friction, x, wn, out);
  } else {
    project_coulomb<T>(c.friction, x, wn, wt, out);
  }
}

/// Likewise of a joint at velocity u (m/s or rad/s), with the gaps, dry friction and compliance of its row.
template <class T, class Row>
inline void find_impulses(const T& eps, const T& u, const Row& row, NewtonJointT<T>& out) {
  const T zero(0.0);
  const T r = eps * out.r, w = recip(r), dry_w = recip(row.dry_compliance + r);
  const T lower = fma(r, out.kept[0], -(u + row.lower_gap)) * w;
  const T upper = fma(r, out.kept[1], u - row.upper_gap) * w;
  const T dry = fma(r, out.kept[2], -(u + row.dry_gap)) * dry_w;
  const auto gives = (dry > row.dry_low) & (dry < row.dry_high);
  out.lambda[0] = max(lower, zero);
  out.lambda[1] = max(upper, zero);
  out.lambda[2] = min(max(dry, row.dry_low), row.dry_high);
  out.g = select(lower > zero, w, zero) + select(upper > zero, w, zero) + select(gives, dry_w, zero);
}

/// Whether a contact slips, and at what rate: the multiplier of its friction's law, m/s per N s.
template <class T>
struct SlipT {
  mask_of<T> slips;
  T rate;
};

/// Of a contact at velocity u (m/s), by the impulse that it keeps.
template <class T>
inline SlipT<T> slip_of(const T& friction, const T& guard, const Vec3T<T>& kept, const Vec3T<T>& u) {
  const T s = fma(guard, kept.y, u.y), t = fma(guard, kept.z, u.z);
  const T length = sqrt(fma(kept.y, kept.y, kept.z * kept.z)), radius = friction * kept.x;
  const mask_of<T> slips = (radius > T(0.0)) & (length >= T(1.0 - 1e-12) * radius);
  return {slips, sqrt(fma(s, s, t * t)) * recip(select(slips, length, T(1.0)))};
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
