// A C library whose functions round otherwise in the last bit, for LD_PRELOAD: what a trace is computed by must not
// notice (golden_digest_test.cpp).
#include <dlfcn.h>

#include <cmath>

namespace {

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

/// The neighbour toward zero, of everything but zeros, infinities and NaN.
double other(double x) { return std::isfinite(x) && x != 0 ? std::nextafter(x, 0.0) : x; }

}  // namespace

#define OTHER_OF_ONE(name)                                                 \
  extern "C" double name(double x) noexcept {                              \
    static double (*const function)(double) = real<double(double)>(#name); \
    return other(function(x));                                             \
  }
#define OTHER_OF_TWO(name)                                                                 \
  extern "C" double name(double x, double y) noexcept {                                    \
    static double (*const function)(double, double) = real<double(double, double)>(#name); \
    return other(function(x, y));                                                          \
  }

OTHER_OF_ONE(sin)
OTHER_OF_ONE(cos)
OTHER_OF_ONE(tan)
OTHER_OF_ONE(asin)
OTHER_OF_ONE(acos)
OTHER_OF_ONE(atan)
OTHER_OF_ONE(sinh)
OTHER_OF_ONE(cosh)
OTHER_OF_ONE(tanh)
OTHER_OF_ONE(exp)
OTHER_OF_ONE(exp2)
OTHER_OF_ONE(expm1)
OTHER_OF_ONE(log)
OTHER_OF_ONE(log2)
OTHER_OF_ONE(log10)
OTHER_OF_ONE(log1p)
OTHER_OF_ONE(cbrt)
OTHER_OF_ONE(erf)
OTHER_OF_ONE(erfc)
OTHER_OF_TWO(atan2)
OTHER_OF_TWO(pow)
OTHER_OF_TWO(hypot)

extern "C" void sincos(double x, double* s, double* c) noexcept {
  *s = sin(x);
  *c = cos(x);
}
