#include "sampling/elementary.h"

#include <array>
#include <cmath>

#include "sampling/constants.h"

namespace graze::pinned {
namespace {

// ln 2 in two parts: the first has 20 zeros at its end, so that k times it is exact for every exponent k.
constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;

/// 1 / n!, n = 0 … 15; every factorial is exact.
constexpr std::array<double, 16> kInverseFactorial = [] {
  std::array<double, 16> out{};
  double factorial = 1.0;
  for (int n = 0; n < 16; ++n) {
    if (n > 0) factorial *= n;
    out[static_cast<std::size_t>(n)] = 1.0 / factorial;
  }
  return out;
}();

/// (e^r - 1 - r) / r^2 for |r| <= ln(2)/2, by the series: the first term left out is below 2^-60 of e^r.
double exponential_rest(double r) {
  double sum = 0;
  for (std::size_t n = kInverseFactorial.size() - 1; n >= 2; --n) sum = sum * r + kInverseFactorial[n];
  return sum;
}

/// Chebyshev coefficients of (1 + 2 x) e^(x^2) erfc(x) in t = (x - 3.75) / (x + 3.75), x >= 0: the form of Shepherd and
/// Laframboise, Mathematics of Computation 36 (1981) 249-253; computed here with 40 digits. The next is 2e-18.
constexpr std::array<double, 26> kErfc = {
    1.1775789345674018,     -0.0045900545806464773,  -0.084249133366517916,   0.05920993999819189,
    -0.026658668435305752,  0.0090749976707052651,   -0.0024131635404176082,  0.00049077583652580863,
    -6.9169733025012064e-5, 4.1390279860730102e-6,   7.7403830661984907e-7,   -2.1886401049234396e-7,
    1.076499946567091e-8,   4.5219598112182869e-9,   -7.7544002088313511e-10, -6.3180883408866845e-11,
    2.8687950109306699e-11, 1.9455868545777347e-13,  -9.6546967484334389e-13, 3.2525481481487398e-14,
    3.3478119482868054e-14, -1.8645628804193131e-15, -1.2507950530688647e-15, 7.4182352566240435e-17,
    5.0681489047961113e-17, -2.2370566594359996e-18};

/// e^(x^2) erfc(x) for x >= 0.
double scaled_erfc(double x) {
  const double t = (x - 3.75) / (x + 3.75);
  double last = 0, sum = 0;  // Clenshaw's recurrence
  for (std::size_t k = kErfc.size() - 1; k > 0; --k) {
    const double next = 2.0 * t * sum - last + kErfc[k];
    last = sum;
    sum = next;
  }
  return (t * sum - last + kErfc[0]) / (1.0 + 2.0 * x);
}

}  // namespace

double exp(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.79) return kInfinity;
  if (x < -745.14) return 0.0;
  // x = k ln 2 + r, with what r lost to rounding kept.
  const double k = std::round(x * 1.4426950408889634);
  const double high = x - k * kLn2High, low = k * kLn2Low;
  const double r = high - low;
  const double lost = (high - r) - low;
  const double y = 1.0 + (r + (r * r * exponential_rest(r) + lost));
  return std::ldexp(y, static_cast<int>(k));
}

double log(double x) {
  if (std::isnan(x)) return x;
  if (x <= 0) return x == 0 ? -kInfinity : kNaN;
  if (std::isinf(x)) return x;
  // As engine/lanes/log.h: x = 2^k (1 + f) with sqrt(1/2) < 1 + f <= sqrt(2), and log(1 + f) from s = f / (2 + f).
  int k = 0;
  double m = std::frexp(x, &k);  // in [1/2, 1)
  if (m <= 0.70710678118654757) {
    m *= 2.0;
    --k;
  }
  const double f = m - 1.0;  // exact
  const double half_square = 0.5 * f * f, s = f / (2.0 + f), z = s * s;
  double p = 1.479819860511658591e-01;
  for (const double c : {1.531383769920937332e-01, 1.818357216161805012e-01, 2.222219843214978396e-01,
                         2.857142874366239149e-01, 3.999999999940941908e-01, 6.666666666666735130e-01}) {
    p = z * p + c;
  }
  return k * kLn2High + (f - (half_square - (s * (z * p + half_square) + k * kLn2Low)));
}

double log1p(double x) {
  // The logarithm of what 1 + x rounds to, scaled to x by the secant, whose errors cancel (Kahan).
  const double u = 1.0 + x;
  if (u == 1.0 || std::isinf(u)) return x;
  return log(u) * (x / (u - 1.0));
}

double sinh(double x) {
  const double a = std::abs(x);
  if (a < 1.0) {
    const double z = a * a;
    double sum = 1.0;  // a (1 + z/(2 3) (1 + z/(4 5) (…)))
    for (int n = 18; n >= 2; n -= 2) sum = 1.0 + z * sum / (n * (n + 1.0));
    return x * sum;
  }
  const double e = exp(a);
  return std::copysign(0.5 * (e - 1.0 / e), x);
}

double erfc(double x) {
  if (std::isnan(x)) return x;
  const double a = std::abs(x);
  if (a > 28.0) return x > 0 ? 0.0 : 2.0;
  const double square = a * a, lost = std::fma(a, a, -square);
  const double upper = exp(-square) * (1.0 - lost) * scaled_erfc(a);
  return x < 0 ? 2.0 - upper : upper;
}

}  // namespace graze::pinned
