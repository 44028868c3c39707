#pragma once
// How far the impulses of a step are from Coulomb's model and from their own, measured after the solve. By projection,
// as contact_residuals() of reference_contact.h measures it: "x minimises over a set" holds if and only if x = P(x - r
// u), and the residual is |x - P(x - r u)| / r, in m/s, with 1 / r the contact's own entries of A.

#include "engine/contact/solver.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Of the lanes' worst contacts, m/s.
template <class T>
struct ContactResidualsT {
  T signorini{0.0};    // 0 <= lambda_n  _|_  u_n + gap term >= 0 (compliant: with the spring's compliance)
  T coulomb{0.0};      // |lambda_t| <= mu lambda_n
  T dissipation{0.0};  // lambda_t = argmax of dissipation in that disc
  T own{0.0};          // of the model's law: the above, or (convex model) the projection on the cone
};

template <class T>
inline ContactResidualsT<T> contact_residuals(const ContactLawT<T>& law, const ConstraintsT<T>& set, T* dz) {
  ChangeT<T> change(dz);
  ContactResidualsT<T> out;
  for (int i = 0; i < set.contact_count; ++i) {
    const ContactT<T>& c = set.contacts[i];
    const auto valid = mask_from_bits<T>(c.lanes);
    const auto worse = [&](T& most, const T& value) { most = max(most, select(valid, value, T(0.0))); };
    change.turn_to(set.paths[c.path]);
    const Vec3T<T> u = contact_velocity(set.paths[c.path], c, change), &lambda = c.lambda;
    const T at = T(0.5) * (c.ass + c.att), radius = c.friction * max(lambda.x, T(0.0));
    const T signorini = c.ann * abs(lambda.x - max(fnma(u.x, c.inverse_ann, lambda.x), T(0.0)));
    const T coulomb = at * max(sqrt(fma(lambda.y, lambda.y, lambda.z * lambda.z)) - radius, T(0.0));
    const T y = fnma(u.y, recip(at), lambda.y), z = fnma(u.z, recip(at), lambda.z);
    const T length = sqrt(fma(y, y, z * z));
    const T shrink = select(length > radius, radius * recip(max(length, T(1e-300))), T(1.0));
    const T dy = fnma(shrink, y, lambda.y), dz_ = fnma(shrink, z, lambda.z);
    const T dissipation = at * sqrt(fma(dy, dy, dz_ * dz_));
    const T a = T(1.0 / 3.0) * (c.ann + c.ass + c.att);
    const Vec3T<T> off = lambda - onto_cone(lambda - recip(a) * u, c.friction);
    const T convex = a * sqrt(norm2(off));
    worse(out.signorini, signorini);
    worse(out.coulomb, coulomb);
    worse(out.dissipation, dissipation);
    worse(out.own, select(law.convex > T(0.0), convex, max(signorini, max(coulomb, dissipation))));
  }
  change.in_memory();
  return out;
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
