#pragma once
// Whether a sample has one mode or several: the dip test (Hartigan and Hartigan, Annals of Statistics 13 (1985) 70-84).

#include <cstddef>
#include <map>
#include <random>
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
  /// p_value(dip, n) < level, from as many samples as tell it: where nothing parts, from a few dozen.
  bool below(double dip, std::size_t n, double level);

 private:
  /// Dips of uniform samples of one size: so many as were asked for, always the same ones.
  struct Null {
    std::mt19937_64 random{3};
    std::vector<double> dips;    // in the order of the samples
    std::vector<double> sorted;  // once there are all
  };
  std::map<std::size_t, Null> null_;  // by n
};

}  // namespace graze
