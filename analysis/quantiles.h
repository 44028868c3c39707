#pragma once
// Quantiles of samples, by the one definition that all tables and pages share.

#include <span>
#include <vector>

namespace graze {

/// The p-quantile (0 <= p <= 1) of values in rising order: linear between the order statistics at p (n - 1), Hyndman
/// and Fan's type 7 (The American Statistician 50 (1996) 361-365), as NumPy, pandas and R have it by default. Infinite
/// values are taken as they are. NaN of no values.
double quantile(std::span<const double> sorted, double p);

/// The 0.5-quantile of values in any order, none of them NaN. NaN of no values.
double median(std::vector<double> x);

/// Of a number over traces: 5 %, 50 % and 95 % quantiles; NaN: no trace has it.
struct Quantiles {
  double low, median, high;
};
Quantiles quantiles(std::vector<double> x);

}  // namespace graze
