#include "engine/library/outside_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/control/joint_values.h"
#include "engine/control/rows.h"

namespace graze {

OutsidePolicy::OutsidePolicy(const ControlContext& context, LibraryUse use)
    : use_(std::move(use)),
      names_(actuated_names(context.nominal)),
      initial_(actuated_positions(context.nominal, context.initial)),
      draws_(context.draws) {}

void OutsidePolicy::refuse() const {
  const bool untrusted = libraries_allowed() == LibraryLoading::refused;
  throw LibraryRefused(fmt::format(
      "{}: {} {}", use_.place.key_place(), use_.file,
      untrusted
          ? "is code that would run with your rights, and runs only if you say so: --trust (in Python: trust=True)"
          : "runs in a process of its own, which this command has none of; with isolation: none it runs in "
            "the program"));
}

std::uint64_t OutsidePolicy::seed(int lane) const {
  if (!draws_) return 0;
  constexpr double kHalf = 4294967296.0;  // 2^32
  const auto high = static_cast<std::uint64_t>(std::floor(draws_->uniform_of_trace(lane, 0) * kHalf));
  const auto low = static_cast<std::uint64_t>(std::floor(draws_->uniform_of_trace(lane, 1) * kHalf));
  return high << 32 | low;
}

double OutsidePolicy::time_of(const Observation& observation, LaneMask active) {
  int first = 0;
  while (first + 1 < kLanes && !active[first]) ++first;
  return observation.time[static_cast<std::size_t>(first)];
}

void OutsidePolicy::preset(double* q, double* v, double* tau) const {
  for (const double position : initial_) q = std::fill_n(q, kLanes, position);
  const auto values = static_cast<std::ptrdiff_t>(initial_.size() * kLanes);
  std::fill_n(v, values, 0.0);
  std::fill_n(tau, values, 0.0);
}

std::string OutsidePolicy::take(const Targets& wanted, LaneMask active, Targets& targets) const {
  std::array<double, kLanes> poison{};  // becomes NaN, and stays 0 where all is finite
  const auto move = [&](const BlockArray& from, BlockArray& to) {
    for (int k = 0; k < joints(); ++k) {
      const double* const row = from.row(k);
      for (int lane = 0; lane < kLanes; ++lane) poison[static_cast<std::size_t>(lane)] += row[lane] - row[lane];
      copy_lanes(to.row(k), row, active);
    }
  };
  move(wanted.q, targets.q);
  move(wanted.v, targets.v);
  move(wanted.tau, targets.tau);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane] && std::isnan(poison[static_cast<std::size_t>(lane)])) return not_finite(wanted, lane);
  }
  return "";
}

std::string OutsidePolicy::not_finite(const Targets& wanted, int lane) const {
  const std::array<std::pair<const BlockArray*, const char*>, 3> arrays = {
      {{&wanted.q, "position"}, {&wanted.v, "velocity"}, {&wanted.tau, "torque"}}};
  for (const auto& [array, what] : arrays) {
    for (int k = 0; k < joints(); ++k) {
      if (std::isfinite((*array)(k, lane))) continue;
      return fmt::format("asks joint {} for a {} of {}, which is no finite number", names_[static_cast<std::size_t>(k)],
                         what, (*array)(k, lane));
    }
  }
  return "asks for what is no finite number";
}

}  // namespace graze
