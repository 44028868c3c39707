#include "simulation/prediction_tally.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace graze {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// Wilson's score interval (1927) for the rate of k among n, 95 %.
std::pair<double, double> wilson_95(std::uint64_t k, std::uint64_t n) {
  if (n == 0) return {0.0, 1.0};
  const double z = normal_quantile(0.975), size = static_cast<double>(n), p = static_cast<double>(k) / size;
  const double middle = p + z * z / (2 * size), scale = 1 + z * z / size;
  const double half = z * std::sqrt(p * (1 - p) / size + z * z / (4 * size * size));
  return {k == 0 ? 0.0 : (middle - half) / scale, k == n ? 1.0 : (middle + half) / scale};
}

void add_finite(double x, NumberSummary& to) {
  if (std::isfinite(x)) to.add(x);
}

/// Whatever is not known is the worst.
double or_least(double x) { return std::isnan(x) ? -std::numeric_limits<double>::infinity() : x; }

}  // namespace

void NumberSummary::add(double x) {
  NumberSummary one;
  one.count_ = 1, one.mean_ = x, one.least_ = x;
  add(one);
}

// Chan, Golub and LeVeque, The American Statistician 37 (1983) 242-247.
void NumberSummary::add(const NumberSummary& other) {
  if (other.count_ == 0) return;
  const auto a = static_cast<double>(count_), b = static_cast<double>(other.count_), n = a + b;
  const double apart = other.mean_ - mean_;
  mean_ += apart * b / n;
  squares_ += other.squares_ + apart * apart * a * b / n;
  least_ = std::min(least_, other.least_);
  count_ += other.count_;
}

double NumberSummary::mean() const { return count_ > 0 ? mean_ : kNotKnown; }
double NumberSummary::std() const {
  return count_ > 1 ? std::sqrt(squares_ / static_cast<double>(count_ - 1)) : kNotKnown;
}
double NumberSummary::least() const { return count_ > 0 ? least_ : kNotKnown; }

PredictionLayout prediction_layout(const Scenario& scenario) {
  const Model& model = scenario.model;
  PredictionLayout out;
  for (const Requirement& one : scenario.task.requirements) out.requirements += one.measure ? 0 : 1;
  if (model.floating_base) out.base = model.bodies.front().q + 4;
  for (const int body : model.actuated) out.joints.push_back(model.bodies[static_cast<std::size_t>(body)].q);
  out.step = scenario.timing.step;
  return out;
}

PredictionTally::PredictionTally(const PredictionLayout& layout) : joints_(layout.joints.size()) {
  sums_.violated.resize(layout.requirements);
  sums_.margins.resize(layout.requirements);
}

void PredictionTally::add(const PredictionLayout& layout, const TraceRecord& trace, double begin, double end) {
  ++sums_.outcomes[static_cast<std::size_t>(trace.outcome)];
  sums_.by_particle.push_back(trace.outcome);
  if (trace.outcome == Outcome::invalid) {
    if (sums_.invalid_reason.empty()) sums_.invalid_reason = trace.invalid_reason;
    return;
  }
  if (trace.outcome == Outcome::known_failure) ++sums_.violated.at(static_cast<std::size_t>(trace.violated));
  for (std::size_t i = 0; i < layout.requirements; ++i) add_finite(trace.margins[i], sums_.margins[i]);
  add_finite(trace.objective_margin, sums_.objective);
  sums_.lasted.add(trace.end_time - begin);
  if (trace.end_time < end - 0.5 * layout.step) return;
  for (std::size_t k = 0; k < 3 && layout.base >= 0; ++k)
    place_[k].add(trace.q[static_cast<std::size_t>(layout.base) + k]);
  for (std::size_t k = 0; k < joints_.size(); ++k) joints_[k].add(trace.q[static_cast<std::size_t>(layout.joints[k])]);
}

void PredictionTally::add_unfabricated(std::uint64_t count, const std::string& reason) {
  if (count > 0 && sums_.invalid_reason.empty()) sums_.invalid_reason = reason;
  sums_.outcomes[static_cast<std::size_t>(Outcome::invalid)] += count;
  sums_.by_particle.insert(sums_.by_particle.end(), count, Outcome::invalid);
}

void PredictionTally::add(const PredictionTally& other) {
  const CandidatePrediction& more = other.sums_;
  if (sums_.invalid_reason.empty()) sums_.invalid_reason = more.invalid_reason;
  for (std::size_t i = 0; i < sums_.outcomes.size(); ++i) sums_.outcomes[i] += more.outcomes[i];
  for (std::size_t i = 0; i < sums_.violated.size(); ++i) {
    sums_.violated[i] += more.violated[i];
    sums_.margins[i].add(more.margins[i]);
  }
  sums_.objective.add(more.objective);
  sums_.lasted.add(more.lasted);
  sums_.by_particle.insert(sums_.by_particle.end(), more.by_particle.begin(), more.by_particle.end());
  for (std::size_t k = 0; k < 3; ++k) place_[k].add(other.place_[k]);
  for (std::size_t k = 0; k < joints_.size(); ++k) joints_[k].add(other.joints_[k]);
}

CandidatePrediction PredictionTally::told(const PredictionLayout& layout, const std::string& policy) const {
  const auto square = [](const NumberSummary& of) { return of.std() * of.std(); };
  CandidatePrediction out = sums_;
  out.policy = policy;
  const std::uint64_t valid = out.valid();
  out.rate = valid > 0 ? static_cast<double>(out.outcomes[0]) / static_cast<double>(valid) : kNotKnown;
  std::tie(out.low, out.high) = wilson_95(out.outcomes[0], valid);
  out.place = layout.base < 0 ? kNotKnown : std::sqrt(square(place_[0]) + square(place_[1]) + square(place_[2]));
  double joints = 0;
  for (const NumberSummary& one : joints_) joints += square(one);
  out.joints = joints_.empty() ? kNotKnown : std::sqrt(joints / static_cast<double>(joints_.size()));
  return out;
}

int best_of(const std::vector<CandidatePrediction>& candidates) {
  const auto worth = [](const CandidatePrediction& one) {
    return std::tuple(one.rate, or_least(one.lasted.mean()), or_least(one.objective.mean()));
  };
  int best = -1;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].valid() == 0) continue;
    if (best < 0 || worth(candidates[i]) > worth(candidates[static_cast<std::size_t>(best)]))
      best = static_cast<int>(i);
  }
  return best;
}

}  // namespace graze
