#pragma once
// Inverse trigonometric functions on lanes, without branches. The ratio of the shorter leg to the longer is brought to
// |z| <= tan(pi/8) by atan(t) = pi/4 + atan((t - 1) / (t + 1)); there the polynomial of FreeBSD's s_atan.c (Sun
// Microsystems, 1993; made for |z| < 7/16). Errors below 4 ulp.

#include "engine/lanes/bits.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// atan(z) for |z| <= 7/16.
template <class T>
inline T arctangent_polynomial(const T& z) {
  const T w = z * z;
  T p = fma(w, T(1.62858201153657823623e-02), T(-3.65315727442169155270e-02));
  p = fma(w, p, T(4.97687799461593236017e-02));
  p = fma(w, p, T(-5.83357013379057348645e-02));
  p = fma(w, p, T(6.66107313738753120669e-02));
  p = fma(w, p, T(-7.69187620504482999495e-02));
  p = fma(w, p, T(9.09088713343650656196e-02));
  p = fma(w, p, T(-1.11111104054623557880e-01));
  p = fma(w, p, T(1.42857142725034663711e-01));
  p = fma(w, p, T(-1.99999999998764832476e-01));
  p = fma(w, p, T(3.33333333333329318027e-01));
  return fnma(z * w, p, z);
}

/// The angle of (x, y), in [-pi, pi], signs of zeros as std::atan2. Both finite and below 1e300 in size.
template <class T>
inline T atan2(const T& y, const T& x) {
  const T ax = abs(x), ay = abs(y);
  const auto steep = ay > ax;
  const T low = select(steep, ax, ay), high = select(steep, ay, ax);  // a NaN stays one

  const auto reduced = low > T(0.41421356237309503) * high;
  const T top = select(reduced, low - high, low);
  const T bottom = select(reduced, low + high, select(high == T(0.0), T(1.0), high));
  const T a = arctangent_polynomial(top / bottom);
  // The angle is eighth pi/4 + side a, where eighth = 0 … 4.
  T eighth = select(reduced, T(1.0), T(0.0)), side = T(1.0);
  eighth = select(steep, T(2.0) - eighth, eighth);
  side = select(steep, -side, side);
  const auto behind = copy_sign(T(1.0), x) < T(0.0);
  eighth = select(behind, T(4.0) - eighth, eighth);
  side = select(behind, -side, side);
  // pi/4 in two parts.
  const T angle = fma(eighth, T(0.78539816339744828), fma(eighth, T(3.061616997868383e-17), side * a));
  return copy_sign(angle, y);
}

/// |x| <= 1; NaN outside.
template <class T>
inline T asin(const T& x) {
  return atan2(x, sqrt((T(1.0) - x) * (T(1.0) + x)));
}

/// |x| <= 1; NaN outside.
template <class T>
inline T acos(const T& x) {
  return atan2(sqrt((T(1.0) - x) * (T(1.0) + x)), x);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
