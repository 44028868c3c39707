#pragma once
// p-values of the common tests, and their correction for how many of them there are.

#include <cstdint>
#include <span>
#include <vector>

namespace graze {

/// P(|Z| >= |z|), Z standard normal.
double two_sided_normal(double z);
/// P(|T| >= |t|), T Student's with `freedom` > 0 degrees of freedom.
double two_sided_student(double t, double freedom);
/// P(X >= x), X chi-square with `freedom` > 0 degrees of freedom.
double upper_chi_square(double x, double freedom);

/// How two yes-or-no answers go together.
struct FourfoldTable {
  std::uint64_t both = 0, only_a = 0, only_b = 0, neither = 0;
};
/// Fisher's exact test of independence. two_sided: all tables with these margins that are no more likely than this one;
/// upper: those with at least as many `both`. Sums up to a million terms.
double fisher_two_sided(const FourfoldTable& table);
double fisher_upper(const FourfoldTable& table);

/// P(sum of weights[k] Z_k^2 >= x), Z_k independent standard normals, weights > 0: Lugannani and Rice's saddle-point
/// approximation, whose *relative* error stays small in the far tail (Kuonen, Biometrika 86 (1999) 929-935). No
/// weights: 1.
double upper_weighted_chi_square(double x, std::span<const double> weights);

/// Holm's adjusted p-values (Scandinavian Journal of Statistics 6 (1979) 65-70): with every null hypothesis true, any
/// of them falls below a with a probability of at most a, however the tests depend on each other. NaN: no test was
/// made; stays NaN and is not counted.
std::vector<double> holm(std::span<const double> p_values);

}  // namespace graze
