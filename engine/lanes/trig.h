#pragma once
// Sine and cosine on lanes, without branches: reduction to |r| <= pi/4 by three parts of pi/2 (Cody and Waite, 1980;
// products enter exactly, by fma), then the minimax polynomials of FreeBSD's k_sin.c and k_cos.c (Sun Microsystems,
// 1993). Error below 2 ulp for |x| <= 1e5, far beyond any joint angle.

#include "engine/lanes/pack.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Nearest integer, halves to even, |x| < 2^51.
template <class T>
inline T round_to_integer(const T& x) {
  constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52: the sum has no bits left for fractions
  return (x + kShift) - kShift;
}

/// sin(r) for |r| <= pi/4.
template <class T>
inline T sine_polynomial(const T& r) {
  const T z = r * r;
  T p = fma(z, T(1.58969099521155010221e-10), T(-2.50507602534068634195e-08));
  p = fma(z, p, T(2.75573137070700676789e-06));
  p = fma(z, p, T(-1.98412698298579493134e-04));
  p = fma(z, p, T(8.33333333332248946124e-03));
  p = fma(z, p, T(-1.66666666666666324348e-01));
  return fma(z * r, p, r);
}

/// cos(r) for |r| <= pi/4.
template <class T>
inline T cosine_polynomial(const T& r) {
  const T z = r * r;
  T p = fma(z, T(-1.13596475577881948265e-11), T(2.08757232129817482790e-09));
  p = fma(z, p, T(-2.75573143513906633035e-07));
  p = fma(z, p, T(2.48015872894767294178e-05));
  p = fma(z, p, T(-1.38888888888741095749e-03));
  p = fma(z, p, T(4.16666666666666019037e-02));
  const T w = fnma(T(0.5), z, T(1.0));
  return w + fma(z * z, p, fnma(T(0.5), z, T(1.0) - w));  // what w lost to rounding is added back
}

template <class T>
inline void sin_cos(const T& x, T& s, T& c) {
  const T k = round_to_integer(x * T(6.36619772367581382433e-01));  // 2/pi
  const T r1 = fnma(k, T(6.123233995736766e-17), fnma(k, T(1.5707963267948966), x));
  const T r = fnma(k, T(-1.4973849048591833e-33), r1);
  const T sine = sine_polynomial(r);
  const T cosine = cosine_polynomial(r);
  const T quadrant = fnma(T(4.0), round_to_integer(k * T(0.25)), k);  // k mod 4 as -2 … 2
  const auto odd = abs(quadrant) == T(1.0);
  const auto half_turn = abs(quadrant) == T(2.0);
  s = select(odd, cosine, sine);
  c = select(odd, sine, cosine);
  s = select(half_turn | (quadrant == T(-1.0)), -s, s);
  c = select(half_turn | (quadrant == T(1.0)), -c, c);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
