#include "analysis/dip.h"

#include <algorithm>
#include <cmath>

#include "sampling/stream.h"

namespace graze {
namespace {

constexpr std::size_t kMostSimulated = 1000, kSamples = 4999;

/// The interval that the mode may lie in is narrowed until the fit outside of it is no better than within. Indices from
/// 0; counts of the empirical distribution function (times n) jump from i to i + 1 at point i.
class DipSearch {
 public:
  explicit DipSearch(std::span<const double> x) : x_(x) {}
  double run();

 private:
  /// below_[j]: the vertex before j of the greatest convex minorant of points 0 … j; above_[k]: the one behind k of the
  /// least concave majorant of points k … n - 1.
  void find_hulls();
  /// Vertices of both hulls over [low, high], from the mode's far end on: minorant falling, majorant rising.
  void list_vertices();
  /// Largest distance of the hulls within [low, high]; where it lies becomes the next interval.
  double widest();
  double chord_excess(std::size_t from, std::size_t to, bool minorant) const;

  std::span<const double> x_;
  std::vector<std::size_t> below_, above_, minorant_, majorant_;
  std::size_t low_ = 0, high_ = 0;
  std::size_t at_minorant_ = 0, at_majorant_ = 0;  // places of the next interval's ends in the lists
};

double count(std::size_t i) { return static_cast<double>(i); }

void DipSearch::find_hulls() {
  const std::size_t n = x_.size();
  below_.assign(n, 0);
  above_.assign(n, n - 1);
  for (std::size_t j = 1; j < n; ++j) {
    std::size_t at = j - 1;
    while (at != 0) {
      const std::size_t next = below_[at];
      const bool convex = (x_[j] - x_[at]) * count(at - next) < (x_[at] - x_[next]) * count(j - at);
      if (convex) break;
      at = next;
    }
    below_[j] = at;
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    std::size_t at = k + 1;
    while (at != n - 1) {
      const std::size_t next = above_[at];
      const bool concave = (x_[at] - x_[k]) * count(next - at) < (x_[next] - x_[at]) * count(at - k);
      if (concave) break;
      at = next;
    }
    above_[k] = at;
  }
}

void DipSearch::list_vertices() {
  minorant_ = {high_};
  while (minorant_.back() > low_) minorant_.push_back(below_[minorant_.back()]);
  majorant_ = {low_};
  while (majorant_.back() < high_) majorant_.push_back(above_[majorant_.back()]);
}

double DipSearch::widest() {
  if (minorant_.size() == 2 && majorant_.size() == 2) return 1;
  double most = 0;
  std::size_t i = minorant_.size() - 2, k = 1;  // both lists are walked upwards in x
  while (true) {
    const std::size_t low = minorant_[i], high = majorant_[k];
    if (low > high) {  // the next vertex is one of the majorant, above a chord of the minorant
      const std::size_t before = minorant_[i + 1];
      const double along = (x_[high] - x_[before]) * count(low - before) / (x_[low] - x_[before]);
      const double distance = count(high) + 1 - count(before) - along;
      ++k;
      if (distance >= most) {
        most = distance;
        at_minorant_ = i + 1;
        at_majorant_ = k - 1;
      }
    } else {
      const std::size_t before = majorant_[k - 1];
      const double along = (x_[low] - x_[before]) * count(high - before) / (x_[high] - x_[before]);
      const double distance = along - (count(low) - count(before) - 1);
      if (distance >= most) {
        most = distance;
        at_minorant_ = i;
        at_majorant_ = k;
      }
      if (i > 0) --i;
    }
    k = std::min(k, majorant_.size() - 1);
    if (minorant_[i] == majorant_[k]) return most;
  }
}

/// How far the empirical function is above a chord of the minorant, or below one of the majorant, at the most.
double DipSearch::chord_excess(std::size_t from, std::size_t to, bool minorant) const {
  double most = 1;
  if (to - from <= 1 || x_[from] == x_[to]) return most;
  const double slope = count(to - from) / (x_[to] - x_[from]);
  for (std::size_t j = from; j <= to; ++j) {
    const double chord = (x_[j] - x_[from]) * slope, steps = count(j) - count(from);
    most = std::max(most, minorant ? steps + 1 - chord : chord - (steps - 1));
  }
  return most;
}

double DipSearch::run() {
  const std::size_t n = x_.size();
  if (n < 2 || x_.front() == x_.back()) return 0.5 / count(n);
  find_hulls();
  high_ = n - 1;
  double most = 1;
  while (true) {
    list_vertices();
    at_minorant_ = minorant_.size() - 1;
    at_majorant_ = majorant_.size() - 1;
    if (widest() < most) break;
    double outside = 0;
    for (std::size_t i = at_minorant_; i + 1 < minorant_.size(); ++i) {
      outside = std::max(outside, chord_excess(minorant_[i + 1], minorant_[i], true));
    }
    for (std::size_t k = at_majorant_; k + 1 < majorant_.size(); ++k) {
      outside = std::max(outside, chord_excess(majorant_[k], majorant_[k + 1], false));
    }
    most = std::max(most, outside);
    const std::size_t low = minorant_[at_minorant_], high = majorant_[at_majorant_];
    if (low == low_ && high == high_) break;
    low_ = low;
    high_ = high;
  }
  return most / (2 * count(n));
}

/// The dip of a uniform sample. A sorted sample comes from sums of exponential spacings.
double simulated(std::mt19937_64& random, std::size_t n) {
  std::vector<double> sample(n);
  double sum = 0;
  for (double& x : sample) x = sum -= std::log(to_uniform(random()));
  return dip(sample);
}

/// p of a dip that so many of the simulated ones reach.
double p_of(std::size_t reached) { return count(reached + 1) / count(kSamples + 1); }

/// What a simulated dip must have to count as reaching it: the last digits do not decide.
double reached_from(double dip, std::size_t n, std::size_t simulated_n) {
  return dip * std::sqrt(count(n) / count(simulated_n)) * (1 - 1e-12);
}

}  // namespace

double dip(std::span<const double> sorted) { return DipSearch(sorted).run(); }

double DipTest::p_value(double dip, std::size_t n) {
  const std::size_t simulated_n = std::min(n, kMostSimulated);
  Null& null = null_[simulated_n];
  while (null.dips.size() < kSamples) null.dips.push_back(simulated(null.random, simulated_n));
  if (null.sorted.empty()) {
    null.sorted = null.dips;
    std::sort(null.sorted.begin(), null.sorted.end());
  }
  const auto from = std::lower_bound(null.sorted.begin(), null.sorted.end(), reached_from(dip, n, simulated_n));
  return p_of(static_cast<std::size_t>(null.sorted.end() - from));
}

bool DipTest::below(double dip, std::size_t n, double level) {
  const std::size_t simulated_n = std::min(n, kMostSimulated);
  Null& null = null_[simulated_n];
  const double least = reached_from(dip, n, simulated_n);
  std::size_t reached = 0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (k == null.dips.size()) null.dips.push_back(simulated(null.random, simulated_n));
    reached += null.dips[k] >= least;
    if (p_of(reached) >= level) return false;  // p only rises with more samples that reach it
  }
  return true;
}

}  // namespace graze
