#include "analysis/rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "analysis/proportions.h"
#include "analysis/quantiles.h"
#include "analysis/sequential.h"
#include "analysis/significance.h"
#include "sampling/constants.h"

namespace graze {
namespace {

constexpr std::uint64_t kMost = 1'000'000'000;

/// The least n at which it is enough and stays so at the sizes looked at: doubled until it is, then halved. Rounding of
/// the successes makes "enough" waver by a few particles; the answer is an expectation, no promise.
std::uint64_t least_size(const std::function<bool(std::uint64_t)>& enough) {
  std::uint64_t high = 1;
  while (!enough(high)) {
    if (high > kMost) return 0;
    high *= 2;
  }
  std::uint64_t low = high / 2;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (enough(middle) ? high : low) = middle;
  }
  return high;
}

std::uint64_t successes(double rate, std::uint64_t n) {
  return std::min(n, static_cast<std::uint64_t>(std::llround(rate * static_cast<double>(n))));
}

}  // namespace

std::vector<std::size_t> pairs_to_show(const std::vector<double>& p_values) {
  constexpr std::size_t kMost = 10;
  std::vector<std::size_t> out(p_values.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  if (out.size() <= kMost) return out;
  const auto key = [&](std::size_t i) { return std::isnan(p_values[i]) ? 2.0 : p_values[i]; };
  std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  out.resize(kMost);
  return out;
}

std::string pairs_left_out(std::size_t all, std::size_t shown) {
  return all == shown ? "" : fmt::format("… and {} pairs that differ less (--json has all)\n", all - shown);
}

RateStatistics rate_statistics(const Score& score) {
  RateStatistics out;
  const double each = 1 - 0.05 / static_cast<double>(std::max<std::size_t>(1, score.policies.size()));
  for (const PolicyScore& policy : score.policies) {
    RateBounds& one = out.policies.emplace_back();
    one.policy = policy.policy;
    one.n = policy.n;
    one.success = policy.success;
    one.unknown = policy.unknown;
    const auto n = static_cast<double>(policy.n);
    one.worst = policy.n > 0 ? static_cast<double>(policy.success) / n : kNaN;
    one.best = policy.n > 0 ? static_cast<double>(policy.success + policy.unknown) / n : kNaN;
    one.worst_interval = score.interval(policy.success, policy.n);
    one.best_interval = score.interval(policy.success + policy.unknown, policy.n);
    one.simultaneous = score.interval(policy.success, policy.n, each);
  }
  std::vector<double> p_values;
  for (const PairedComparison& pair : score.pairs) p_values.push_back(pair.n > 0 ? pair.p_value : kNaN);
  const std::vector<double> adjusted = holm(p_values);
  for (std::size_t i = 0; i < score.pairs.size(); ++i) {
    const PairedComparison& pair = score.pairs[i];
    out.pairs.push_back({pair.a, pair.b, pair.difference, pair.p_value, adjusted[i]});
  }
  return out;
}

MarginSummary summarise_margins(const std::vector<double>& margins, const std::vector<std::uint32_t>& particles) {
  MarginSummary out;
  out.worst = kNaN;
  std::vector<double> sorted;
  for (std::size_t i = 0; i < margins.size(); ++i) {
    const double margin = margins[i];
    if (std::isnan(margin)) continue;
    sorted.push_back(margin);
    out.below += margin < 0;
    const bool worse = !(margin >= out.worst);  // or the first
    if (!worse && !(margin == out.worst && particles[i] < out.worst_particle)) continue;
    out.worst = margin;
    out.worst_particle = particles[i];
  }
  std::sort(sorted.begin(), sorted.end());
  out.n = sorted.size();
  out.interval = clopper_pearson(out.below, out.n);
  for (const double p : kMarginQuantiles) out.quantiles.push_back(quantile(sorted, p));
  return out;
}

double spread_of(const MarginSummary& margins) { return margins.quantiles[5] - margins.quantiles[1]; }

std::string mean_text(double mean, const MarginSummary& margins) {
  constexpr double kLeast = 3, kMost = 12, kOfTheSpread = 2;  // significant digits
  const double spread = spread_of(margins);
  double digits = kLeast;
  if (spread > 0 && std::isfinite(spread) && mean != 0) {
    digits = std::clamp(std::ceil(std::log10(std::abs(mean) / spread)) + kOfTheSpread, kLeast, kMost);
  }
  const bool plain = margins.unit.empty() || margins.unit == "1";
  return fmt::format("{:.{}g}{}", mean, static_cast<int>(digits), plain ? "" : " " + margins.unit);
}

std::uint64_t particles_for_width(double rate, double half_width, double confidence) {
  return least_size([&](std::uint64_t n) {
    const Interval interval = clopper_pearson(successes(rate, n), n, confidence);
    return interval.high - interval.low <= 2 * half_width;
  });
}

DecisionSize particles_to_decide(double rate, double bound, double confidence) {
  const Question question{"", "*", Question::Kind::rate_above, bound};
  DecisionSize out;
  out.bound = bound;
  out.fixed = least_size([&](std::uint64_t n) {
    return judge(question, clopper_pearson(successes(rate, n), n, confidence)) != Verdict::open;
  });
  out.sequence = least_size([&](std::uint64_t n) {
    return judge(question, confidence_sequence(successes(rate, n), n, confidence)) != Verdict::open;
  });
  return out;
}

}  // namespace graze
