#pragma once
// Sine, cosine, arctangents and lengths of one number at a time, by the formulas of the lanes (trig.h, arc.h): the C
// library's may differ between its versions in the last bit, and results would with them. Whatever reaches a trace
// calls these (or those of sampling/elementary.h); tests/house/elementary.py refuses the C library's. Not for kernels,
// which call the formulas themselves. tests/engine/lanes/scalar_test.cpp holds the error bounds, in units of the last
// place.

#include <cmath>
#include <numbers>

#include "engine/lanes/arc.h"
#include "engine/lanes/trig.h"

#if defined(GRAZE_ISA_AVX2) || defined(GRAZE_ISA_AVX512)
#error "kernels call the lanes' formulas: trig.h, arc.h"
#endif

namespace graze::pinned {

struct SineCosine {
  double sine, cosine;
};

/// Of an angle, rad. Below 2 ulp for |x| <= 1e5 and within 4e-16 for |x| <= 1e9; beyond, of x less the nearest multiple
/// of the double next to 2 pi: in [-1, 1], but no longer the sine of x.
inline SineCosine sin_cos(double x) {
  if (!(std::abs(x) <= 1e9)) x = std::remainder(x, 2 * std::numbers::pi);  // exact; NaN of infinities
  SineCosine out;
  graze::sin_cos(x, out.sine, out.cosine);
  return out;
}

inline double sin(double x) { return sin_cos(x).sine; }
inline double cos(double x) { return sin_cos(x).cosine; }

/// The angle of (x, y) in [-pi, pi], signs of zeros as std::atan2. Below 4 ulp for both below 1e300 in size.
inline double atan2(double y, double x) { return graze::atan2(y, x); }

/// Below 4 ulp; NaN for |x| > 1.
inline double acos(double x) { return graze::acos(x); }

/// Length of (x, y), below 2 ulp, also where squares would leave the range of a double.
inline double hypot(double x, double y) {
  const double most = std::abs(x) > std::abs(y) ? std::abs(x) : std::abs(y);
  if (most > 1e-140 && most < 1e140) return std::sqrt(std::fma(x, x, y * y));
  if (!(most > 0) || std::isinf(most)) return most + std::abs(x) + std::abs(y);  // 0, infinity or NaN
  const double scale = std::ldexp(1.0, std::ilogb(most));
  return scale * std::sqrt(std::fma(x / scale, x / scale, y / scale * (y / scale)));
}

}  // namespace graze::pinned
