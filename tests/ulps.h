#pragma once
// Errors of functions against the C library's in 64 bits of mantissa.

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>

namespace graze::test {

/// |got - want| in units of the last place of `want`.
inline double ulps(double got, long double want) {
  const double near = std::fabs(static_cast<double>(want));
  const double ulp = std::nextafter(near, INFINITY) - near;
  return static_cast<double>(std::fabs(static_cast<long double>(got) - want) / ulp);
}

/// The largest error over 100 000 arguments, x = map(u) with u uniform in [low, high).
inline double worst_ulps(double (*function)(double), long double (*reference)(long double), double low, double high,
                         double (*map)(double) = nullptr) {
  std::mt19937_64 random(1);
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const double u = low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
    const double x = map != nullptr ? map(u) : u;
    worst = std::fmax(worst, ulps(function(x), reference(static_cast<long double>(x))));
  }
  return worst;
}

}  // namespace graze::test
