#pragma once
// Whether a sample has one mode or several: the dip test (Hartigan and Hartigan, Annals of Statistics 13 (1985) 70-84).

#include <cstddef>
#include <map>
#include <span>
#include <vector>

namespace graze {

/// The dip: how far the empirical distribution function is from the nearest function that is convex up to some point
/// and concave from there on, at the most. In 1 / (2 n) .. 1 / 4. `sorted`: rising, not empty. Takes linear time as a
/// rule.
double dip(std::span<const double> sorted);

/// p-values of the dip by simulation: 4999 uniform samples, fixed seed, so p >= 2e-4. Of all distributions with one
/// mode the uniform one is (asymptotically) the least favourable: with a single clear peak the test errs far less often
/// than it says. Beyond 1000 values the samples have 1000 and sqrt(n) dip is compared, whose distribution no longer
/// moves.
class DipTest {
 public:
  double p_value(double dip, std::size_t n);

 private:
  std::map<std::size_t, std::vector<double>> null_;  // by n: sorted dips
};

}  // namespace graze
