#pragma once
// Natural logarithm on lanes, without branches, after FreeBSD's e_log.c (Sun Microsystems, 1993): x = 2^k (1 + f) with
// sqrt(1/2) < 1 + f <= sqrt(2), and log(1 + f) from s = f / (2 + f). Error below 1 ulp for normal positive x.

#include "engine/lanes/bits.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// ln x. x must be positive, finite and no less than the smallest normal double (2.2e-308).
template <class T>
inline T log_positive(const T& x) {
  using B = bits_of<T>;
  const B word = as_bits(x);
  T m = as_double((word & B(0x000fffffffffffffu)) | B(0x3ff0000000000000u));  // in [1, 2)
  T k = number(shift_right<52>(word)) - T(1023.0);
  const auto large = m > T(1.4142135623730951);
  m = select(large, m * T(0.5), m);
  k = select(large, k + T(1.0), k);
  const T f = m - T(1.0);  // exact
  const T half_square = T(0.5) * f * f;
  const T s = f / (T(2.0) + f);
  const T z = s * s;
  T p = fma(z, T(1.479819860511658591e-01), T(1.531383769920937332e-01));
  p = fma(z, p, T(1.818357216161805012e-01));
  p = fma(z, p, T(2.222219843214978396e-01));
  p = fma(z, p, T(2.857142874366239149e-01));
  p = fma(z, p, T(3.999999999940941908e-01));
  p = fma(z, p, T(6.666666666666735130e-01));
  const T rest = fma(k, T(1.90821492927058770002e-10), s * fma(z, p, half_square));  // the low part of ln 2
  return fma(k, T(6.93147180369123816490e-01), f - (half_square - rest));
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
