#pragma once
// How large a step a scenario bears: the same particles at several physics steps, held against a run at a tiny one
// (dissertation, §8.5, Tables 15 and 16).

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// `timing` at another physics step, s: the control period stays if it is a whole multiple of `step`, else it is the
/// next larger one; the end is the nearest whole number of steps, one control period at least.
Timing timing_at(const Timing& timing, double step);

/// Memory that study_steps() takes for each particle, bytes.
double study_bytes(const Scenario& scenario, const std::vector<double>& steps);

/// What came of some particles at one physics step.
struct StepRow {
  Timing timing;
  int traces = 0, valid = 0;
  int same = 0;                   // valid, and with the outcome and the violated requirement of the reference
  std::array<int, 4> outcomes{};  // by Outcome
  double joint_error = 0;         // mean |q - q of the reference|, rad (m where joints slide); NaN: nothing to compare
  double link_error = 0;          // mean distance of the link from where it is in the reference, m; NaN: likewise
  double tracking = 0;            // mean |q - q wanted|, rad or m; NaN: the policy wants no joint positions
  double cost = 0;                // processor time per simulated time of one trace
  std::string reason;             // of the first invalid trace

  /// Every trace is valid and ends as it does in the reference, and some could be compared on its way.
  bool stable() const { return same == traces && !std::isnan(link_error); }
};

struct StepQuestion {
  std::string policy, link;  // link: whose place is compared
  std::uint32_t particles = 8;
  std::vector<double> steps;  // s, ascending
  double reference = 0;       // s, the step of the run that the others are compared with
};

struct StepStudy {
  StepRow reference;
  std::vector<StepRow> rows;  // as the question's steps

  /// The largest step that is stable as all smaller ones are; nullptr: the smallest is not.
  const StepRow* largest_stable() const;
};

/// The scenario with another timing.
using LoadAt = std::function<Scenario(const Timing&)>;

/// Simulates particles 0 … of the scenario, without jitter (whose draws belong to control steps), on this thread.
/// Throws InputError: no such policy or link.
StepStudy study_steps(const LoadAt& load, const Timing& timing, const StepQuestion& question);

}  // namespace graze
