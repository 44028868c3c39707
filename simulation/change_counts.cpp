#include "simulation/change_counts.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

namespace graze {
namespace {

// A bin is a value's exponent and the first three bits behind its point: no logarithm, whose bits a library may change.
constexpr int kBitsBelow = 52 - 3;
// From below a solver's tolerance (1e-6 m/s) to beyond what any body reaches: 2^-21 and 2^21 m/s.
constexpr std::uint64_t kFirst = std::bit_cast<std::uint64_t>(0x1p-21) >> kBitsBelow;
constexpr std::uint64_t kLast = (std::bit_cast<std::uint64_t>(0x1p+21) >> kBitsBelow) - 1;

std::size_t bin_of(double change) {
  const std::uint64_t bin = std::bit_cast<std::uint64_t>(std::max(change, 0.0)) >> kBitsBelow;
  return std::clamp(bin, kFirst, kLast) - kFirst;
}

double middle_of(std::size_t bin) {
  return std::bit_cast<double>((kFirst + bin) << kBitsBelow | std::uint64_t{1} << (kBitsBelow - 1));
}

}  // namespace

void ChangeCounts::add(double change, std::uint64_t times) {
  if (counts_.empty()) counts_.resize(kLast - kFirst + 1);
  counts_[bin_of(change)] += times;
}

double ChangeCounts::median() const {
  const std::uint64_t all = std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    below += counts_[bin];
    if (below > 0 && below >= all - all / 2) return middle_of(bin);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace graze
