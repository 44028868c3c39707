#pragma once
// The standard normal quantile function on lanes: Wichura's AS 241 (PPND16), Applied Statistics 37 (1988) 477-484, as
// sampling/normal.cpp has it, with fma and the lanes' own logarithm, so that the two may differ by a few ulp.
//
// One value in seven lies in the tails, hence some lane of eight nearly always. So the centre's formula is evaluated
// for whole rows and the tails are collected, evaluated side by side and put back: an element's bits depend on it
// alone.

#include "engine/lanes/log.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

/// Coefficients in descending powers.
template <class T>
inline T as241_polynomial(const double (&c)[8], const T& x) {
  T p = fma(x, T(c[0]), T(c[1]));
  GRAZE_UNROLL
  for (int i = 2; i < 8; ++i) p = fma(x, p, T(c[i]));
  return p;
}

/// For |q| = |u - 1/2| <= 0.425.
template <class T>
inline T normal_quantile_centre(const T& q) {
  constexpr double kA[8] = {2.5090809287301226727e+3, 3.3430575583588128105e+4, 6.7265770927008700853e+4,
                            4.5921953931549871457e+4, 1.3731693765509461125e+4, 1.9715909503065514427e+3,
                            1.3314166789178437745e+2, 3.3871328727963666080e0};
  constexpr double kB[8] = {
      5.2264952788528545610e+3, 2.8729085735721942674e+4, 3.9307895800092710610e+4, 2.1213794301586595867e+4,
      5.3941960214247511077e+3, 6.8718700749205790830e+2, 4.2313330701600911252e+1, 1.0};
  const T x = fnma(q, q, T(0.180625));
  return q * as241_polynomial(kA, x) / as241_polynomial(kB, x);
}

/// For u beyond that.
template <class T>
inline T normal_quantile_tail(const T& u) {
  constexpr double kC[8] = {7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1,
                            1.27045825245236838258e0,  3.64784832476320460504e0,  5.76949722146069140550e0,
                            4.63033784615654529590e0,  1.42343711074968357734e0};
  constexpr double kD[8] = {
      1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2, 1.48103976427480074590e-1,
      6.89767334985100004550e-1, 1.67638483018380384940e0,  2.05319162663775882187e0,  1.0};
  constexpr double kE[8] = {2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3,
                            2.65321895265761230930e-2, 2.96560571828504891230e-1, 1.78482653991729133580e0,
                            5.46378491116411436990e0,  6.65790464350110377720e0};
  constexpr double kF[8] = {
      2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5, 7.86869131145613259100e-4,
      1.48753612908506148525e-2,  1.36929880922735805310e-1, 5.99832206555887937690e-1, 1.0};
  const T q = u - T(0.5);
  const auto lower = q < T(0.0);
  const T r = sqrt(-log_positive(select(lower, u, T(1.0) - u)));
  T z = as241_polynomial(kC, r - T(1.6)) / as241_polynomial(kD, r - T(1.6));
  const auto far = r > T(5.0);
  if (any(far)) {
    z = select(far, as241_polynomial(kE, r - T(5.0)) / as241_polynomial(kF, r - T(5.0)), z);
  }
  return select(lower, -z, z);
}

/// Rows that are worked on at once, within the first-level cache.
inline constexpr int kChunk = 64;

/// z = quantiles of `rows` <= kChunk rows of u, each in (0, 1) and either at least 2.3e-308 or above 1/2.
template <class T>
inline void normal_quantiles(const double* u, int rows, double* z) {
  constexpr int W = kWidth<T>;
  alignas(64) double tail[(kChunk + 1) * W];
  int where[(kChunk + 1) * W];
  int count = 0;
  for (int row = 0; row < rows; ++row) {
    const T value = load<T>(u + row * W);
    const T q = value - T(0.5);
    store(z + row * W, normal_quantile_centre(q));
    const auto outside = abs(q) > T(0.425);
    compress_indices<T>(outside, row * W, where + count);
    count += compress(outside, value, tail + count);
  }
  for (int i = count; i < count + W; ++i) tail[i] = 0.05;  // fills the last pack
  for (int first = 0; first < count; first += W) {
    double value[W];
    store(value, normal_quantile_tail(load<T>(tail + first)));
    const int n = count - first < W ? count - first : W;
    for (int i = 0; i < n; ++i) z[where[first + i]] = value[i];
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
