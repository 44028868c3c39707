#include "analysis/survival.h"

#include <algorithm>
#include <cmath>

#include "analysis/significance.h"
#include "sampling/constants.h"
#include "sampling/distribution.h"

namespace graze {
namespace {

/// In order of time; of equal times failures first.
void sort_by_time(std::vector<Lifetime>& lifetimes) {
  std::sort(lifetimes.begin(), lifetimes.end(), [](const Lifetime& a, const Lifetime& b) {
    return a.time != b.time ? a.time < b.time : a.failed && !b.failed;
  });
}

/// share^exp(+-z se), se^2 = variance / log(share)^2.
Interval interval_of(double share, double variance, double z, double before) {
  if (share <= 0) return {0, before};
  const double log_share = std::log(share), error = z * std::sqrt(variance) / std::abs(log_share);
  return {std::exp(log_share * std::exp(error)), std::exp(log_share * std::exp(-error))};
}

template <class Share>
double first_time(const std::vector<SurvivalStep>& steps, const Share& share) {
  const auto at = std::find_if(steps.begin(), steps.end(), [&](const SurvivalStep& s) { return share(s) <= 0.5; });
  return at == steps.end() ? kNaN : at->time;
}

/// The area under the shares and its interval. Variance: the sum of A(t)^2 d / (n (n - d)) over the steps, A(t) being
/// the area from there on (Kaplan and Meier 1958, eq. 7).
void add_mean(Survival& survival, double z) {
  double area = 0, end = survival.seen_until, variance = 0;
  for (auto step = survival.steps.rbegin(); step != survival.steps.rend(); ++step) {
    area += step->share * (end - step->time);
    end = step->time;
    const auto n = static_cast<double>(step->at_risk), d = static_cast<double>(step->failed);
    if (d < n) variance += area * area * d / (n * (n - d));
  }
  survival.mean = area + end;
  const double error = survival.steps.empty() ? kNaN : z * std::sqrt(variance);
  survival.mean_interval = {survival.mean - error, survival.mean + error};
  if (survival.mean_interval.low < 0) survival.mean_interval.low = 0;
  if (survival.mean_interval.high > survival.seen_until) survival.mean_interval.high = survival.seen_until;
}

/// A lifetime in one of the groups.
struct Member {
  Lifetime life;
  std::size_t group;
};

std::vector<Member> pooled(const std::vector<std::span<const Lifetime>>& groups) {
  std::vector<Member> out;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const Lifetime& life : groups[g]) out.push_back({life, g});
  }
  std::stable_sort(out.begin(), out.end(), [](const Member& a, const Member& b) { return a.life.time < b.life.time; });
  return out;
}

/// Solves a x = b for a symmetric matrix, row by row [size][size], that may be singular: what has no pivot is left out.
std::vector<double> solved(std::vector<double> a, std::vector<double> b, std::size_t size, double& rank) {
  rank = 0;
  std::vector<bool> used(size);
  for (std::size_t k = 0; k < size; ++k) {
    const double pivot = a[k * size + k];
    if (!(pivot > 1e-9)) continue;
    used[k] = true;
    ++rank;
    for (std::size_t i = 0; i < size; ++i) {
      if (i == k) continue;
      const double factor = a[i * size + k] / pivot;
      for (std::size_t j = 0; j < size; ++j) a[i * size + j] -= factor * a[k * size + j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = 0; k < size; ++k) b[k] = used[k] ? b[k] / a[k * size + k] : 0;
  return b;
}

}  // namespace

Survival survival_of(std::vector<Lifetime> lifetimes, double confidence) {
  sort_by_time(lifetimes);
  const double z = normal_quantile(1 - (1 - confidence) / 2);
  Survival out;
  out.traces = lifetimes.size();
  if (!lifetimes.empty()) out.seen_until = lifetimes.back().time;
  double share = 1, variance = 0, before = 1;
  for (std::size_t i = 0; i < lifetimes.size();) {
    std::size_t failed = 0, end = i;
    for (; end < lifetimes.size() && lifetimes[end].time == lifetimes[i].time; ++end) failed += lifetimes[end].failed;
    if (failed > 0) {
      const auto n = static_cast<double>(lifetimes.size() - i), d = static_cast<double>(failed);
      share *= (n - d) / n;
      variance += d / (n * (n - d));
      const Interval interval = interval_of(share, variance, z, before);
      out.steps.push_back({lifetimes[i].time, lifetimes.size() - i, failed, share, interval});
      out.failed += failed;
      before = interval.high;
    }
    i = end;
  }
  out.median = first_time(out.steps, [](const SurvivalStep& s) { return s.share; });
  out.median_interval.low = first_time(out.steps, [](const SurvivalStep& s) { return s.interval.low; });
  out.median_interval.high = first_time(out.steps, [](const SurvivalStep& s) { return s.interval.high; });
  add_mean(out, z);
  return out;
}

LogRank log_rank(const std::vector<std::vector<Lifetime>>& groups) {
  const std::size_t count = groups.size(), size = count > 0 ? count - 1 : 0;  // the last follows from the others
  const std::vector<Member> all = pooled({groups.begin(), groups.end()});
  std::vector<double> at_risk(count), excess(size), covariance(size * size);
  for (std::size_t g = 0; g < count; ++g) at_risk[g] = static_cast<double>(groups[g].size());
  for (std::size_t i = 0; i < all.size();) {
    const auto n = static_cast<double>(all.size() - i);
    std::vector<double> failed(count), left(count);
    double d = 0;
    const double time = all[i].life.time;
    for (; i < all.size() && all[i].life.time == time; ++i) {
      ++left[all[i].group];
      failed[all[i].group] += all[i].life.failed;
      d += all[i].life.failed;
    }
    const double spread = n > 1 ? d * (n - d) / (n - 1) : 0;
    for (std::size_t g = 0; g < size; ++g) {
      excess[g] += failed[g] - d * at_risk[g] / n;
      for (std::size_t h = 0; h < size; ++h) {
        covariance[g * size + h] += spread * at_risk[g] / n * ((g == h) - at_risk[h] / n);
      }
    }
    for (std::size_t g = 0; g < count; ++g) at_risk[g] -= left[g];
  }
  LogRank out;
  const std::vector<double> x = solved(covariance, excess, size, out.freedom);
  for (std::size_t g = 0; g < size; ++g) out.chi_square += excess[g] * x[g];
  out.p_value = out.freedom > 0 ? upper_chi_square(out.chi_square, out.freedom) : kNaN;
  return out;
}

LogRank paired_log_rank(std::span<const Lifetime> a, std::span<const Lifetime> b) {
  // Scores: 1 if it failed, less the cumulative hazard of both groups together (Nelson and Aalen) until then.
  const std::vector<Member> all = pooled({a, b});
  std::vector<std::pair<double, double>> hazard;  // time, cumulative
  double sum = 0;
  for (std::size_t i = 0; i < all.size();) {
    const auto n = static_cast<double>(all.size() - i);
    const double time = all[i].life.time;
    double d = 0;
    for (; i < all.size() && all[i].life.time == time; ++i) d += all[i].life.failed;
    sum += d / n;
    hazard.emplace_back(time, sum);
  }
  const auto score = [&](const Lifetime& life) {
    const auto at = std::lower_bound(hazard.begin(), hazard.end(), std::pair(life.time, -1.0));
    return (life.failed ? 1 : 0) - at->second;
  };
  double difference = 0, squares = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    const double d = score(a[i]) - score(b[i]);
    difference += d;
    squares += d * d;
  }
  LogRank out;
  out.freedom = squares > 0 ? 1 : 0;
  out.chi_square = squares > 0 ? difference * difference / squares : 0;
  out.p_value = squares > 0 ? upper_chi_square(out.chi_square, 1) : kNaN;
  return out;
}

}  // namespace graze
