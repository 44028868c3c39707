#pragma once
// Exponentials and what is made of them on lanes, without branches: x = k ln 2 + r with |r| <= ln 2 / 2, and e^r - 1 by
// its series. NaN stays NaN. tests/engine/network/exponential_test.cpp holds the error bounds.

#include "engine/lanes/bits.h"
#include "engine/lanes/log.h"
#include "engine/lanes/trig.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// 2^k for whole k in [-1022, 1023].
template <class T>
inline T power_of_two(const T& k) {
  using B = bits_of<T>;
  constexpr double kShift = 4503599627370496.0 + 1023.0;  // 2^52: the sum's last bits are the exponent
  return as_double(shift_left<52>(as_bits(k + T(kShift)) & B(0x7ffu)));
}

/// e^x = scale (1 + rest).
template <class T>
struct ScaledExponential {
  T scale, rest;
};

/// For x in [-708, 709].
template <class T>
inline ScaledExponential<T> scaled_exponential(const T& x) {
  const T k = round_to_integer(x * T(1.44269504088896338700e+00));  // 1 / ln 2
  const T r = fnma(k, T(1.90821492927058770002e-10), fnma(k, T(6.93147180369123816490e-01), x));
  T p = T(1.0 / 6227020800.0);  // 1/13!: what is left out is below 1e-17 of r
  p = fma(r, p, T(1.0 / 479001600.0));
  p = fma(r, p, T(1.0 / 39916800.0));
  p = fma(r, p, T(1.0 / 3628800.0));
  p = fma(r, p, T(1.0 / 362880.0));
  p = fma(r, p, T(1.0 / 40320.0));
  p = fma(r, p, T(1.0 / 5040.0));
  p = fma(r, p, T(1.0 / 720.0));
  p = fma(r, p, T(1.0 / 120.0));
  p = fma(r, p, T(1.0 / 24.0));
  p = fma(r, p, T(1.0 / 6.0));
  p = fma(r, p, T(0.5));
  return {power_of_two(k), fma(r * r, p, r)};
}

template <class T>
inline T keep_nan(const T& x, const T& result) {
  return select(x == x, result, x);
}

/// e^x; below e^-708 it is that, above e^709 infinity.
template <class T>
inline T exponential(const T& x) {
  const ScaledExponential<T> e = scaled_exponential(max(min(x, T(709.0)), T(-708.0)));
  return keep_nan(x, select(x > T(709.0), T(__builtin_inf()), fma(e.scale, e.rest, e.scale)));
}

/// e^x - 1, also where x is small; infinity above 709.
template <class T>
inline T exponential_less_one(const T& x) {
  const ScaledExponential<T> e = scaled_exponential(max(min(x, T(709.0)), T(-708.0)));
  return keep_nan(x, select(x > T(709.0), T(__builtin_inf()), fma(e.scale, e.rest, e.scale - T(1.0))));
}

template <class T>
inline T hyperbolic_tangent(const T& x) {
  const T e = exponential_less_one(min(T(2.0) * abs(x), T(60.0)));  // beyond, the quotient is 1
  return keep_nan(x, copy_sign(e / (e + T(2.0)), x));
}

/// 1 / (1 + e^-x).
template <class T>
inline T sigmoid(const T& x) {
  const T e = exponential(-abs(x));
  return keep_nan(x, select(x < T(0.0), e, T(1.0)) / (T(1.0) + e));
}

/// ln(1 + e^x).
template <class T>
inline T softplus(const T& x) {
  const T e = exponential(-abs(x)), u = T(1.0) + e;
  return keep_nan(x, max(x, T(0.0)) + (log_positive(u) + (e - (u - T(1.0))) / u));  // what u lost is added back
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
