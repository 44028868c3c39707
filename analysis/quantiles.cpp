#include "analysis/quantiles.h"

#include <algorithm>
#include <limits>

namespace graze {

double quantile(std::span<const double> sorted, double p) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double place = p * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  const double share = place - static_cast<double>(low);
  // Infinite values have no difference, and nothing times infinity is no number.
  if (share == 0 || sorted[low] == sorted[high]) return sorted[low];
  return sorted[low] + share * (sorted[high] - sorted[low]);
}

double median(std::vector<double> x) {
  if (x.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>((x.size() - 1) / 2);
  std::nth_element(x.begin(), middle, x.end());
  if (x.size() % 2 == 1) return *middle;
  const double both[] = {*middle, *std::min_element(middle + 1, x.end())};
  return quantile(both, 0.5);
}

Quantiles quantiles(std::vector<double> x) {
  std::sort(x.begin(), x.end());
  return {quantile(x, 0.05), quantile(x, 0.5), quantile(x, 0.95)};
}

}  // namespace graze
