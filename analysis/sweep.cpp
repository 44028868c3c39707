#include "analysis/sweep.h"

#include <algorithm>

#include "analysis/sequential.h"
#include "analysis/significance.h"

namespace graze {

SweepCount Sweep::count(std::size_t point, std::size_t policy, std::uint64_t particles) const {
  SweepCount out;
  const std::vector<std::int8_t>& traces = points.at(point).traces.at(policy);
  const std::uint64_t end = particles > 0 ? particles : points[point].particles;
  std::uint64_t* const counts[] = {&out.success, &out.known, &out.unknown, &out.invalid};  // by Outcome
  for (std::size_t i = 0; i < std::min<std::size_t>(end, traces.size()); ++i) {
    if (traces[i] != kNoTrace) ++*counts[traces[i]];
  }
  return out;
}

Interval Sweep::interval(const SweepCount& count) const {
  if (!adaptive) return clopper_pearson(count.success, count.valid());
  Question question;
  question.bound = rule.width;
  return confidence_sequence(count.success, count.valid(), 0.95, mixture_mass({question}));
}

Survival Sweep::survival(std::size_t point, std::size_t policy) const {
  const auto& lifetimes = points.at(point).lifetimes;
  return survival_of(policy < lifetimes.size() ? lifetimes[policy] : std::vector<Lifetime>{});
}

bool Sweep::has_violations() const {
  for (const SweepPoint& point : points) {
    for (const std::vector<Lifetime>& lifetimes : point.lifetimes) {
      if (std::any_of(lifetimes.begin(), lifetimes.end(), [](const Lifetime& life) { return life.failed; }))
        return true;
    }
  }
  return false;
}

std::vector<std::size_t> Sweep::neighbours(std::size_t point) const {
  std::vector<std::size_t> out;
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const std::size_t at = points[point].at[axis], values = axes[axis].texts.size();
    if (at > 0) out.push_back(point - stride);
    if (at + 1 < values) out.push_back(point + stride);
    stride *= values;
  }
  return out;
}

std::vector<std::size_t> unsettled(const Sweep& sweep, const std::vector<std::uint64_t>& particles) {
  const SweepRule& rule = sweep.rule;
  std::vector<std::vector<Interval>> intervals(sweep.points.size());
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
      intervals[i].push_back(sweep.interval(sweep.count(i, policy, particles[i])));
    }
  }
  const auto goes_on = [&](std::size_t i, std::size_t policy) {
    const Interval& own = intervals[i][policy];
    if (own.high - own.low <= rule.width) return false;
    if (own.low < rule.level && rule.level < own.high) return true;
    const std::vector<std::size_t> beside = sweep.neighbours(i);
    return std::any_of(beside.begin(), beside.end(), [&](std::size_t j) {
      const Interval& other = intervals[j][policy];
      return std::max(own.high - other.low, other.high - own.low) > kSteepWidths * rule.width;
    });
  };
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    bool some = false;
    for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) some = some || goes_on(i, policy);
    if (some) out.push_back(i);
  }
  return out;
}

bool next_turn(const Sweep& sweep, std::uint64_t most, std::vector<std::uint64_t>& particles) {
  bool some = false;
  for (const std::size_t i : unsettled(sweep, particles)) {
    some = some || particles[i] < most;
    particles[i] = std::min(2 * particles[i], most);
  }
  return some;
}

namespace {

PairedTable pairs_of(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b, std::uint64_t particles) {
  const auto valid = [](std::int8_t trace) { return trace != kNoTrace && trace != static_cast<int>(Outcome::invalid); };
  const auto success = [](std::int8_t trace) { return trace == static_cast<int>(Outcome::success); };
  PairedTable out;
  for (std::size_t i = 0; i < std::min({a.size(), b.size(), static_cast<std::size_t>(particles)}); ++i) {
    if (!valid(a[i]) || !valid(b[i])) continue;
    const bool in_a = success(a[i]), in_b = success(b[i]);
    ++(in_a ? (in_b ? out.both : out.only_a) : (in_b ? out.only_b : out.neither));
  }
  return out;
}

}  // namespace

std::vector<SweepChange> sweep_changes(const Sweep& sweep) {
  std::vector<SweepChange> out;
  if (sweep.adaptive) return out;
  std::vector<double> p_values;
  for (std::size_t policy = 0; policy < sweep.policies.size(); ++policy) {
    for (std::size_t to = 0; to < sweep.points.size(); ++to) {
      if (sweep.points[to].at[0] == 0) continue;
      const std::size_t from = to - 1;
      const std::uint64_t particles = std::min(sweep.points[from].particles, sweep.points[to].particles);
      SweepChange& one = out.emplace_back();
      one.from = from, one.to = to, one.policy = policy;
      one.pairs = pairs_of(sweep.points[from].traces[policy], sweep.points[to].traces[policy], particles);
      one.interval = newcombe_paired(one.pairs);
      one.p_value = mcnemar_exact(one.pairs.only_a, one.pairs.only_b);
      p_values.push_back(one.p_value);
    }
  }
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < out.size(); ++i) out[i].corrected = corrected[i];
  return out;
}

namespace {

/// Whether traces that both points have are the same; `compared` becomes true if there are any.
bool same_traces(const SweepPoint& a, const SweepPoint& b, bool& compared) {
  for (std::size_t policy = 0; policy < std::min(a.digests.size(), b.digests.size()); ++policy) {
    const auto &of_a = a.traces[policy], &of_b = b.traces[policy];
    for (std::size_t i = 0; i < std::min(of_a.size(), of_b.size()); ++i) {
      if (of_a[i] == kNoTrace || of_b[i] == kNoTrace) continue;
      if (of_a[i] != of_b[i] || a.digests[policy][i] != b.digests[policy][i]) return false;
      compared = true;
    }
  }
  return true;
}

bool same_but_along(std::size_t axis, const SweepPoint& a, const SweepPoint& b) {
  for (std::size_t other = 0; other < a.at.size(); ++other) {
    if (other != axis && a.at[other] != b.at[other]) return false;
  }
  return a.at[axis] != b.at[axis];
}

}  // namespace

std::vector<std::size_t> axes_without_effect(const Sweep& sweep) {
  std::vector<std::size_t> out;
  for (std::size_t axis = 0; axis < sweep.axes.size(); ++axis) {
    bool same = true, compared = false;
    for (std::size_t i = 0; same && i < sweep.points.size(); ++i) {
      for (std::size_t j = i + 1; same && j < sweep.points.size(); ++j) {
        if (!same_but_along(axis, sweep.points[i], sweep.points[j])) continue;
        same = same_traces(sweep.points[i], sweep.points[j], compared);
      }
    }
    if (same && compared) out.push_back(axis);
  }
  return out;
}

}  // namespace graze
