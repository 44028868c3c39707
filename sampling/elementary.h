#pragma once
// Exponentials, logarithms and the error function whose bits are this project's own. The C library's may differ between
// its versions in the last bit, and results would with them; these use nothing but what IEEE 754 rounds in one way: + -
// * /, fma, and the exact ldexp and frexp. Whatever reaches a trace calls these; sines and arctangents stand in
// engine/lanes/scalar.h. tests/house/elementary.py refuses the C library's.
//
// Error bounds, which tests/sampling/elementary.cpp holds against 64 bits of mantissa, are in units of the last place.

namespace graze::pinned {

/// e^x. Below 1 ulp where the result is a normal number; 0 below -745.14, infinity above 709.78.
double exp(double x);

/// ln x. Below 1 ulp; -infinity at 0, NaN below.
double log(double x);

/// ln(1 + x). Below 3 ulp; -infinity at -1, NaN below.
double log1p(double x);

/// Hyperbolic sine. Below 3 ulp where e^|x| is finite.
double sinh(double x);

/// Complementary error function, 1 - erf(x). Below 8 ulp where the result is a normal number.
double erfc(double x);

}  // namespace graze::pinned
