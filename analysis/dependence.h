#pragma once
// Dependence of any shape between two numbers, beyond rising and falling: the Hilbert-Schmidt independence criterion.

#include <cstddef>
#include <span>
#include <vector>

namespace graze {

/// HSIC (Gretton and others, ALT 2005) of one target with many predictors, on ranks scaled to (0, 1), with sums of
/// Gaussian kernels of widths 0.2 and 0.05: it sees a target that is high in the middle of a predictor's range and low
/// at both ends, and one that rises and falls twice. p-values are asymptotic: n HSIC is distributed as a weighted sum
/// of chi-squares whose weights are the products of both kernels' eigenvalues (Zhang and others, UAI 2011); good from
/// about 30 values. Needs n^2 floats; one object may be used for any number of predictors.
class RankDependence {
 public:
  /// `ranks`: of the target (midranks).
  explicit RankDependence(std::span<const double> ranks);

  struct Result {
    double share = 0;  // HSIC over the largest it can be: 0 independent, 1 each a function of the other
    double p_value = 1;
  };
  /// `ranks`: of a predictor; NaN if one of both does not vary.
  Result test(std::span<const double> ranks) const;

 private:
  std::size_t n_;
  std::vector<float> centred_;       // [n][n], the target's kernel without its row and column means
  std::vector<double> eigenvalues_;  // of the target's kernel, falling
  std::vector<double> untied_;       // of a predictor's without ties
  double norm_;                      // Frobenius, of centred_
};

}  // namespace graze
