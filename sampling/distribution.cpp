#include "sampling/distribution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string_view>

#include "sampling/elementary.h"
#include "sampling/refuse.h"
#include "sampling/stream.h"
#include "sampling/tail.h"

namespace graze {
namespace {

void require_finite(std::string_view name, double value) {
  if (!std::isfinite(value)) refuse("{} {} is not a finite number; write one", name, value);
}

void require_spread(std::string_view name, double value) {
  require_finite(name, value);
  if (value < 0) refuse("{} {} is negative; a standard deviation must be >= 0", name, value);
}

void require_ordered(double min, double max) {
  require_finite("min", min);
  require_finite("max", max);
  if (min > max) refuse("min {} is above max {}; write the smaller number first", min, max);
  if (!std::isfinite(max - min)) refuse("the range from {} to {} is too wide for a double", min, max);
}

/// Standard deviations that a normal number can be from its mean: the quantile of kLargestUniform.
double farthest_normal() { return normal_quantile(kLargestUniform); }

constexpr double kLargest = std::numeric_limits<double>::max();

/// The distribution, unless a draw could overflow; `right` says what would be right then.
Distribution with_finite_draws(Distribution d, const std::string& right) {
  for (const double extreme : {d.lowest(), d.highest()}) {
    if (!std::isfinite(extreme))
      refuse("{} can be as {} as {}; every draw must be a finite number: {}", d.describe(),
             extreme < 0 ? "low" : "high", extreme, right);
  }
  return d;
}

}  // namespace

Distribution Distribution::constant(double value) {
  require_finite("value", value);
  Distribution d;
  d.a_ = value;
  return d;
}

Distribution Distribution::normal(double mean, double std) {
  require_finite("mean", mean);
  require_spread("std", std);
  Distribution d;
  d.kind_ = Kind::normal;
  d.a_ = mean, d.b_ = std;
  return with_finite_draws(
      d, fmt::format("give a std of at most {:.3g}", 0.999 * (kLargest - std::abs(mean)) / farthest_normal()));
}

Distribution Distribution::truncated_normal(double mean, double std, double min, double max) {
  require_finite("mean", mean);
  require_spread("std", std);
  if (!(min < max)) refuse("min {} is not below max {}; a truncated normal needs min < max", min, max);
  if (std::isinf(min) && min > 0) refuse("min {} leaves no values; min must be below +inf", min);
  if (std::isinf(max) && max < 0) refuse("max {} leaves no values; max must be above -inf", max);
  if (std == 0 && (mean < min || mean > max))
    refuse("mean {} with std 0 lies outside [{}, {}]; move the mean inside or give a std > 0", mean, min, max);
  Distribution d;
  d.kind_ = Kind::truncated_normal;
  d.a_ = mean, d.b_ = std, d.c_ = min, d.d_ = max;
  if (std == 0) return d;
  const double low = (min - mean) / std, high = (max - mean) / std;
  if (low >= kFarTail || -high >= kFarTail) {
    d.far_ = low > 0 ? 1 : -1;
    d.low_ = low > 0 ? low : -high;
    d.high_ = tail_ratio(d.low_, (max - min) / std);
    d.span_ = 1.0 - d.high_;
  } else {
    d.low_ = normal_cdf(low);
    d.high_ = normal_cdf(-high);
    // Taken on the side where both terms are small, so that nothing is lost against 1.
    d.span_ = low > 0 ? normal_cdf(-low) - d.high_ : normal_cdf(high) - d.low_;
  }
  return with_finite_draws(d, "cut it with both min and max");
}

Distribution Distribution::uniform(double min, double max) {
  require_ordered(min, max);
  Distribution d;
  d.kind_ = Kind::uniform;
  d.a_ = min, d.b_ = max;
  return d;
}

Distribution Distribution::log_normal(double log_mean, double log_std) {
  require_finite("log mean", log_mean);
  require_spread("log std", log_std);
  Distribution d;
  d.kind_ = Kind::log_normal;
  d.a_ = log_mean, d.b_ = log_std;
  const double most = 0.999 * (pinned::log(kLargest) - log_mean) / farthest_normal();
  return with_finite_draws(d, fmt::format("give a log_std of at most {:.3g}", most));
}

Distribution Distribution::log_uniform(double min, double max) {
  require_ordered(min, max);
  if (min <= 0) refuse("min {} is not positive; a log-uniform range must lie above 0", min);
  Distribution d;
  d.kind_ = Kind::log_uniform;
  d.a_ = min, d.b_ = max;
  d.low_ = pinned::log(min);
  d.span_ = pinned::log(max) - d.low_;
  return d;
}

Distribution Distribution::triangular(double min, double mode, double max) {
  require_ordered(min, max);
  if (!(min <= mode && mode <= max))
    refuse("mode {} is outside [{}, {}]; the mode must lie between min and max", mode, min, max);
  Distribution d;
  // Its quantiles are square roots of products of its widths.
  if (!std::isfinite((max - min) * (max - min)))
    refuse("the range from {} to {} is too wide for a triangular distribution in doubles; give one of at most {:.3g}",
           min, max, 0.999 * std::sqrt(kLargest));
  d.kind_ = Kind::triangular;
  d.a_ = min, d.b_ = mode, d.c_ = max;
  return d;
}

Distribution Distribution::choice(int n, std::vector<double> weights) {
  if (n < 1) refuse("{} choices; there must be at least one", n);
  if (weights.empty()) weights.assign(n, 1.0);
  if (weights.size() != static_cast<std::size_t>(n))
    refuse("{} weights for {} choices; give one weight per choice", weights.size(), n);
  double total = 0;
  for (double& w : weights) {
    if (!std::isfinite(w) || w < 0) refuse("weight {} is not a finite number >= 0", w);
    w = total += w;
  }
  if (!std::isfinite(total))
    refuse("the weights sum to more than {:.3g}, the largest double; only their ratios count: make all of them smaller",
           kLargest);
  if (!(total > 0)) refuse("the weights sum to {}; at least one must be > 0", total);
  for (double& w : weights) w /= total;
  Distribution d;
  d.kind_ = Kind::choice;
  d.a_ = n;
  d.table_ = std::move(weights);
  return d;
}

Distribution Distribution::discrete(const std::vector<double>& values, const std::vector<double>& weights) {
  for (const double v : values) require_finite("value", v);
  if (!weights.empty() && weights.size() != values.size())
    refuse("{} weights for {} values; give one weight per value", weights.size(), values.size());
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> sorted, sorted_weights;
  for (const std::size_t i : order) {
    sorted.push_back(values[i]);
    sorted_weights.push_back(weights.empty() ? 1.0 : weights[i]);
  }
  Distribution d = choice(static_cast<int>(sorted.size()), std::move(sorted_weights));
  d.values_ = std::move(sorted);
  return d;
}

Distribution Distribution::empirical(std::vector<double> values) {
  if (values.empty()) refuse("no values; an empirical distribution needs at least one");
  for (const double v : values) require_finite("value", v);
  std::sort(values.begin(), values.end());
  Distribution d;
  d.kind_ = Kind::empirical;
  d.table_ = std::move(values);
  return d;
}

double Distribution::quantile(double u) const {
  assert(u > 0 && u < 1);
  switch (kind_) {
    case Kind::constant:
      return a_;
    case Kind::normal:
      return a_ + b_ * normal_quantile(u);
    case Kind::truncated_normal:
      return truncated_quantile(u);
    case Kind::uniform:
      return std::min(a_ + u * (b_ - a_), b_);
    case Kind::log_normal:
      return pinned::exp(a_ + b_ * normal_quantile(u));
    case Kind::log_uniform:
      return std::clamp(pinned::exp(low_ + u * span_), a_, b_);
    case Kind::triangular: {
      const double width = c_ - a_;
      if (u * width < b_ - a_) return a_ + std::sqrt(u * width * (b_ - a_));
      return c_ - std::sqrt((1.0 - u) * width * (c_ - b_));
    }
    case Kind::choice: {
      const auto i = static_cast<std::size_t>(std::lower_bound(table_.begin(), table_.end(), u) - table_.begin());
      return values_.empty() ? static_cast<double>(i) : values_[i];
    }
    case Kind::empirical:
      return empirical_quantile(u);
  }
  assert(false);
  return 0;
}

double Distribution::truncated_quantile(double u) const {
  if (b_ == 0) return a_;
  if (far_ > 0) return std::min(c_ + b_ * tail_quantile(low_, high_ + (1.0 - u) * span_), d_);
  if (far_ < 0) return std::max(d_ - b_ * tail_quantile(low_, high_ + u * span_), c_);
  // From whichever end is nearer, so that a small tail probability keeps all its digits.
  const double p = low_ + u * span_;
  const double z = p <= 0.5 ? normal_quantile(p) : -normal_quantile(high_ + (1.0 - u) * span_);
  return std::clamp(a_ + b_ * z, c_, d_);
}

double Distribution::empirical_quantile(double u) const {
  const double n = static_cast<double>(table_.size());
  const double h = std::clamp(u * n - 0.5, 0.0, n - 1.0);
  const auto i = static_cast<std::size_t>(h);
  if (i + 1 == table_.size()) return table_[i];
  return std::lerp(table_[i], table_[i + 1], h - static_cast<double>(i));
}

double Distribution::lowest() const { return quantile(kSmallestUniform); }
double Distribution::highest() const { return quantile(kLargestUniform); }
bool Distribution::is_constant() const { return lowest() == highest(); }
double Distribution::mean() const { return moments().first; }
double Distribution::std() const { return std::sqrt(moments().second); }

std::string Distribution::describe() const {
  switch (kind_) {
    case Kind::constant:
      return fmt::format("constant({})", a_);
    case Kind::normal:
      return fmt::format("normal(mean={}, std={})", a_, b_);
    case Kind::truncated_normal:
      return fmt::format("truncated_normal(mean={}, std={}, min={}, max={})", a_, b_, c_, d_);
    case Kind::uniform:
      return fmt::format("uniform(min={}, max={})", a_, b_);
    case Kind::log_normal:
      return fmt::format("log_normal(log_mean={}, log_std={})", a_, b_);
    case Kind::log_uniform:
      return fmt::format("log_uniform(min={}, max={})", a_, b_);
    case Kind::triangular:
      return fmt::format("triangular(min={}, mode={}, max={})", a_, b_, c_);
    case Kind::choice: {
      std::string p;
      for (std::size_t i = 0; i < table_.size(); ++i)
        p += fmt::format("{}{:.6g}", i ? ", " : "", table_[i] - (i ? table_[i - 1] : 0.0));
      if (!values_.empty()) return fmt::format("discrete(values=[{}], p=[{}])", fmt::join(values_, ", "), p);
      return fmt::format("choice(n={}, p=[{}])", table_.size(), p);
    }
    case Kind::empirical:
      return fmt::format("empirical(n={}, min={}, max={})", table_.size(), table_.front(), table_.back());
  }
  assert(false);
  return {};
}

}  // namespace graze
