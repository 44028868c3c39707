#include "analysis/scatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "analysis/number_words.h"
#include "analysis/quantiles.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

constexpr double kDipLevel = 0.05;
constexpr std::size_t kLeastTraces = 10, kMostModes = 4, kLeastOfMode = 2;

Mode mode_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double x : values) squares += (x - mean) * (x - mean);
  return {values.size(), mean, values.size() > 1 ? std::sqrt(squares / (n - 1)) : 0.0};
}

/// How many of the sorted values lie below the cut with the least sum of squares on both sides.
std::size_t least_squares_cut(std::span<const double> sorted) {
  const auto n = static_cast<double>(sorted.size());
  const double all = std::accumulate(sorted.begin(), sorted.end(), 0.0);
  double below = 0, most = -1;
  std::size_t best = 1;
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    below += sorted[k - 1];
    if (sorted[k] == sorted[k - 1]) continue;
    const auto a = static_cast<double>(k), b = n - a;
    const double distance = below / a - (all - below) / b, between = a * b * distance * distance;
    if (between > most) {
      most = between;
      best = k;
    }
  }
  return best;
}

struct Normal {
  double share = 0, mean = 0, deviation = 0;
  double density(double x) const {
    const double z = (x - mean) / deviation;
    return share / deviation * std::exp(-0.5 * z * z);
  }
};

Normal normal_of(const Mode& mode, std::size_t all, double least) {
  return {static_cast<double>(mode.traces) / static_cast<double>(all), mode.mean, std::max(mode.deviation, least)};
}

/// Where two modes part: expectation and maximisation of a mixture of two normal distributions, from the least squares
/// cut on, then the point between their means at which both are as likely. A part of the values may be used.
double mixture_cut(std::span<const double> sorted) {
  const std::size_t at = least_squares_cut(sorted), n = sorted.size();
  const double start = sorted[at - 1] + 0.5 * (sorted[at] - sorted[at - 1]);
  const double least = 1e-3 * (sorted.back() - sorted.front());
  Normal a = normal_of(mode_of(sorted.first(at)), n, least), b = normal_of(mode_of(sorted.subspan(at)), n, least);
  const std::size_t stride = n / 5000 + 1;
  for (int iteration = 0; iteration < 100; ++iteration) {
    double count = 0, weight = 0, sum_a = 0, sum_b = 0, square_a = 0, square_b = 0;
    for (std::size_t i = 0; i < n; i += stride) {
      const double x = sorted[i] - start, in_a = a.density(sorted[i]), in_b = b.density(sorted[i]);
      const double p = in_a + in_b > 0 ? in_a / (in_a + in_b) : (x < 0 ? 1 : 0);
      ++count;
      weight += p;
      sum_a += p * x;
      square_a += p * x * x;
      sum_b += (1 - p) * x;
      square_b += (1 - p) * x * x;
    }
    if (weight < 1 || count - weight < 1) return start;
    const double mean_a = sum_a / weight, mean_b = sum_b / (count - weight);
    a = {weight / count, start + mean_a,
         std::max(least, std::sqrt(std::max(0.0, square_a / weight - mean_a * mean_a)))};
    b = {1 - a.share, start + mean_b,
         std::max(least, std::sqrt(std::max(0.0, square_b / (count - weight) - mean_b * mean_b)))};
  }
  double low = a.mean, high = b.mean;
  if (!(low < high) || a.density(low) < b.density(low) || b.density(high) < a.density(high)) return start;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (a.density(middle) > b.density(middle) ? low : high) = middle;
  }
  return low;
}

/// Values between modes, rising.
void part(std::span<const double> sorted, double level, DipTest& test, std::vector<double>& cuts) {
  if (cuts.size() + 1 >= kMostModes) return;
  const double cut = mixture_cut(sorted);
  const auto at = static_cast<std::size_t>(std::upper_bound(sorted.begin(), sorted.end(), cut) - sorted.begin());
  if (at < kLeastOfMode || sorted.size() - at < kLeastOfMode) return;
  cuts.push_back(cut);
  for (const std::span<const double> side : {sorted.first(at), sorted.subspan(at)}) {
    if (side.size() < kLeastTraces || side.front() == side.back()) continue;
    if (test.below(dip(side), side.size(), level)) part(side, level, test, cuts);
  }
}

void find_modes(std::span<const double> sorted, bool several, double level, DipTest& test, FreedomSpread& out) {
  if (several) part(sorted, level, test, out.cuts);
  std::sort(out.cuts.begin(), out.cuts.end());
  auto from = sorted.begin();
  for (std::size_t k = 0; k <= out.cuts.size(); ++k) {
    const auto to = k < out.cuts.size() ? std::upper_bound(from, sorted.end(), out.cuts[k]) : sorted.end();
    out.modes.push_back(mode_of({from, to}));
    from = to;
  }
  if (out.modes.size() < 2) return;
  const Mode &a = out.modes[0], &b = out.modes[1];
  const double spread = std::sqrt(0.5 * (a.deviation * a.deviation + b.deviation * b.deviation));
  out.separation = (b.mean - a.mean) / std::max(spread, 1e-6 * (b.mean - a.mean));
}

FreedomSpread describe(const std::string& name, const std::string& unit, std::span<const double> sorted,
                       DipTest& test) {
  FreedomSpread out;
  out.name = name;
  out.unit = unit;
  const Mode all = mode_of(sorted);
  out.mean = all.mean;
  out.deviation = all.deviation;
  out.median = quantile(sorted, 0.5);
  out.iqr = quantile(sorted, 0.75) - quantile(sorted, 0.25);
  out.skew_drift = out.mean - out.median;
  // What is the same to nine digits does not part, whatever its last digits do.
  const bool varies = sorted.back() - sorted.front() > 1e-9 * std::max(1.0, std::abs(out.median));
  out.dip = dip(sorted);
  out.p_value = varies ? test.p_value(out.dip, sorted.size()) : kNaN;
  return out;
}

std::string mode_text(const Mode& mode, const std::string& unit) {
  return fmt::format("{} at {:.3g} ± {:.2g}{}{}", mode.traces, mode.mean, mode.deviation, unit.empty() ? "" : " ",
                     unit);
}

}  // namespace

double deviation_of(std::span<const double> values) { return values.empty() ? 0 : mode_of(values).deviation; }

Scatter judge_scatter(const std::vector<std::string>& names, const std::vector<std::string>& units,
                      const std::vector<std::vector<double>>& columns, DipTest& test) {
  Scatter out;
  out.traces = columns.empty() ? 0 : columns[0].size();
  if (out.traces < kLeastTraces) {
    out.notes.push_back(
        fmt::format("not tested: {}, and it takes {}", counted(out.traces, "trace", "traces"), kLeastTraces));
    return out;
  }
  std::vector<std::vector<double>> sorted = columns;
  std::vector<double> p_values;
  std::vector<std::size_t> kept;  // columns, by freedom
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!std::all_of(sorted[k].begin(), sorted[k].end(), [](double x) { return std::isfinite(x); })) {
      out.notes.push_back(fmt::format("left out {}: not all of its values are finite", names[k]));
      continue;
    }
    std::sort(sorted[k].begin(), sorted[k].end());
    kept.push_back(k);
    out.freedoms.push_back(describe(names[k], units[k], sorted[k], test));
    p_values.push_back(out.freedoms.back().p_value);
  }
  const std::vector<double> adjusted = holm(p_values);
  for (std::size_t k = 0; k < out.freedoms.size(); ++k) {
    FreedomSpread& one = out.freedoms[k];
    one.p_holm = adjusted[k];
    find_modes(sorted[kept[k]], one.p_holm < kDipLevel, kDipLevel / static_cast<double>(kept.size()), test, one);
    if (one.modes.size() < 2) continue;
    const auto before = static_cast<std::size_t>(std::max(out.clearest, 0));
    if (out.clearest < 0 || one.separation > out.freedoms[before].separation) out.clearest = static_cast<int>(k);
  }
  if (!out.bifurcates()) return out;
  const auto k = static_cast<std::size_t>(out.clearest);
  const std::vector<double>& cuts = out.freedoms[k].cuts;
  for (const double x : columns[kept[k]]) {
    out.side.push_back(static_cast<int>(std::lower_bound(cuts.begin(), cuts.end(), x) - cuts.begin()));
  }
  return out;
}

std::string scatter_text(const Scatter& scatter) {
  if (scatter.freedoms.empty()) return scatter.notes.empty() ? "not tested: no states" : scatter.notes[0];
  if (!scatter.bifurcates()) return "scatters: one mode in every degree of freedom";
  const FreedomSpread& one = scatter.freedoms[static_cast<std::size_t>(scatter.clearest)];
  std::string modes;
  for (const Mode& mode : one.modes) modes += (modes.empty() ? "" : ", ") + mode_text(mode, one.unit);
  const auto several = std::count_if(scatter.freedoms.begin(), scatter.freedoms.end(),
                                     [](const FreedomSpread& f) { return f.modes.size() > 1; });
  std::string out = fmt::format("bifurcates: {} has {} modes, {} (dip {:.3f}, {})", one.name, one.modes.size(), modes,
                                one.dip, p_equation(one.p_holm, 1));
  if (several == 2) out += "; so does 1 other degree of freedom";
  if (several > 2) out += fmt::format("; so do {} other degrees of freedom", several - 1);
  return out;
}

}  // namespace graze
