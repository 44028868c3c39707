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

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
