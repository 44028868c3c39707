#pragma once
// Scattering or bifurcation (§3.6.1, Eq. 18, 19): whether final states spread about one mode or part into several.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analysis/dip.h"

namespace graze {

struct Mode {
  std::size_t traces = 0;
  double mean = 0, deviation = 0;
};

/// Where one degree of freedom ends up.
struct FreedomSpread {
  std::string name, unit;
  double mean = 0, median = 0;
  double deviation = 0;                     // standard, the sigma of Eq. 19
  double iqr = 0;                           // between the quartiles
  double skew_drift = 0;                    // mean - median: what few far traces add to the drift
  double dip = 0, p_value = 1, p_holm = 1;  // p_holm: over the degrees of freedom; NaN: it does not vary
  /// One: it scatters. Several: in rising order, with the values between them.
  std::vector<Mode> modes;
  std::vector<double> cuts;
  double separation = 0;  // of the first two modes: distance over their root mean square deviation
};

struct Scatter {
  std::size_t traces = 0;
  std::vector<FreedomSpread> freedoms;
  int clearest = -1;               // of those with several modes the one with the largest separation; -1: none has
  std::vector<int> side;           // of each trace, by the clearest: 0 … modes - 1; empty: there is one mode
  std::vector<std::string> notes;  // what was left out, and why
  bool bifurcates() const { return clearest >= 0; }
};

/// Standard deviation; 0 of fewer than two values.
double deviation_of(std::span<const double> values);

/// Several modes where the dip test says so at 5 % after Holm's correction over the degrees of freedom: so often at
/// most a policy that only scatters is said to bifurcate. Where they part is taken from a mixture of two normal
/// distributions; each side is asked again, up to four modes. columns: [freedom][trace]. `test`: keeps what it has
/// simulated.
Scatter judge_scatter(const std::vector<std::string>& names, const std::vector<std::string>& units,
                      const std::vector<std::vector<double>>& columns, DipTest& test);

/// "bifurcates: base.x has 2 modes, 85 traces at 0.21 +- 0.02 m and 15 at 0.55 +- 0.03 m (dip 0.081, p = 0.004)".
std::string scatter_text(const Scatter& scatter);

}  // namespace graze
