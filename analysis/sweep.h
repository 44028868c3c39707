#pragma once
// A sweep: one scenario as several campaigns that differ in one value or two, on the same particles, and what became
// of each. docs/sweep.md tells what the numbers promise.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "analysis/plots_figure.h"
#include "analysis/proportions.h"
#include "analysis/score.h"
#include "analysis/survival.h"

namespace graze {

/// One value of the scenario that a sweep goes over.
struct SweepAxis {
  std::string path;                // as for --set: "contact.friction"
  std::string unit;                // in which `values` are; empty: they have none
  bool numeric = true;             // all values are numbers of one quantity; else `values` are 0, 1, 2 …
  std::vector<std::string> texts;  // as the scenario gets them: "2.5 cm"
  std::vector<double> values;
};

/// How an adaptive sweep hands out its particles. A value goes on while the interval of some policy is wider than
/// `width` and either holds `level`, or a neighbour's allows the rate to change by more than kSteepWidths widths.
struct SweepRule {
  double width = 0.1;        // full width of an interval that is narrow enough
  double level = 0.5;        // rate that an interval shall lie on one side of
  std::uint64_t least = 64;  // particles that every value gets; twice as many at each turn
};
inline constexpr double kSteepWidths = 2;

/// What became of one policy at one value.
struct SweepCount {
  std::uint64_t success = 0, known = 0, unknown = 0, invalid = 0;
  std::uint64_t valid() const { return success + known + unknown; }
};

/// In place of an outcome: the trace is not there (yet).
inline constexpr std::int8_t kNoTrace = -1;

struct SweepPoint {
  std::vector<std::size_t> at;                           // [axis], index of its value
  std::string campaign;                                  // folder in that of the sweep: "003.graze"
  std::vector<std::vector<std::int8_t>> traces;          // [policy][particle]: an Outcome, or kNoTrace
  std::uint64_t particles = 0;                           // that count
  std::vector<std::vector<std::uint64_t>> digests = {};  // [policy][particle], of its states; 0 where there is no trace
  std::vector<std::vector<Lifetime>> lifetimes = {};  // [policy], of the valid traces until a requirement was violated
  std::string scenario = {};                          // SHA-256 of its scenario
};

struct Sweep {
  std::string scenario;  // its name
  std::vector<SweepAxis> axes;
  std::vector<std::string> policies;
  std::vector<SweepPoint> points;  // the first axis changes fastest
  bool adaptive = false;
  SweepRule rule;  // of an adaptive one
  bool complete = true;

  /// Of the first `particles` of a point; 0: of all that count.
  SweepCount count(std::size_t point, std::size_t policy, std::uint64_t particles = 0) const;
  /// 95 %, of the success rate: Clopper-Pearson, or of an adaptive sweep the confidence sequence.
  Interval interval(const SweepCount& count) const;
  /// How long the valid traces lasted until a requirement was violated.
  Survival survival(std::size_t point, std::size_t policy) const;
  /// Whether a requirement was violated anywhere.
  bool has_violations() const;
  /// Points that differ from this one by one value along one axis.
  std::vector<std::size_t> neighbours(std::size_t point) const;
};

/// Points at which an adaptive sweep goes on, after `particles` at each. A function of these outcomes alone.
std::vector<std::size_t> unsettled(const Sweep& sweep, const std::vector<std::uint64_t>& particles);
/// The next turn of an adaptive sweep: doubles the `particles` of unsettled points, up to `most`. False: there is none.
bool next_turn(const Sweep& sweep, std::uint64_t most, std::vector<std::uint64_t>& particles);

/// What changes from one value of the first axis to the next, on the particles that are valid at both.
struct SweepChange {
  std::size_t from = 0, to = 0, policy = 0;  // points
  PairedTable pairs;                         // only_a broke, only_b was mended
  Interval interval;                         // of the difference, 95 %, Newcombe for paired proportions
  double p_value = 1, corrected = 1;         // McNemar, exact; by Holm over all changes of the sweep
};
/// Empty for an adaptive sweep, whose numbers of particles follow its outcomes.
std::vector<SweepChange> sweep_changes(const Sweep& sweep);
/// The axes (their indices) along which no trace that two values share differs, in any bit or in its outcome: what is
/// swept matters to nothing. None while there is nothing to compare.
std::vector<std::size_t> axes_without_effect(const Sweep& sweep);

/// For a terminal; as JSON; as CSV, a line for each value and policy.
std::string format_sweep(const Sweep& sweep);
std::string sweep_json(const Sweep& sweep);
std::string sweep_csv(const Sweep& sweep);
/// Success against the value with intervals: a curve for each policy, or a panel, with a curve for each second value.
Figure sweep_figure(const Sweep& sweep);
/// The same of the mean time until a requirement was violated.
Figure sweep_times_figure(const Sweep& sweep);

}  // namespace graze
