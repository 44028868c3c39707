#pragma once
// Designs, simulated: what margins each leaves. In: designs, and which particles meet which task. Out: margins of the
// limits, how far each comes before the first violation, and how many succeed.

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "jobs/campaign/design_robots.h"

namespace graze {

struct Beginning;

struct TrialQuestion {
  std::string policy;
  std::size_t level = 0;                 // of the task
  std::vector<std::uint32_t> particles;  // whose draws all designs share; empty: the nominal robot, without jitter
  double from = 0, to = std::numeric_limits<double>::infinity();  // s: the window; traces end at `to`
  int threads = 1;
  /// Of nominal robots: where their traces begin; null: at the start.
  std::shared_ptr<const Beginning> begin = {};
};

/// Traces of a design that are invalid: their margins are known up to their ends at most.
struct LostTraces {
  std::size_t count = 0, of = 0;
  std::string why;  // of the first: "particle 3: …", of the nominal robot without its name
};

/// What came of one design. Limits: DesignBlock::limits and, if it is one, the objective (last). Over particles:
/// quantiles of margins.
struct DesignMargins {
  std::string problem;  // it cannot be made, or its trace is invalid: why; then margins may lack
  LostTraces lost;
  bool made = false;            // there are traces
  std::vector<double> margins;  // per limit: least value within the window; NaN: not looked at
  std::vector<double> so_far;   // per limit: least value up to the window's end
  double first_violation = std::numeric_limits<double>::quiet_NaN();  // s, of a limit, of the first particle; NaN: none
  double progress = 0;         // mean share of the trace before a limit is violated
  double success = 0;          // share of the particles that succeed; of traces that were cut short 0
  std::uint64_t contacts = 0;  // equal numbers: equal contact sequences
};

/// One for each design, in their order: bits that depend neither on threads nor on the other designs.
std::vector<DesignMargins> try_designs(const DesignRobots& robots, const std::vector<DesignValues>& designs,
                                       const TrialQuestion& question);

/// The same of designs a small step beside one, `centre`, for differences. Those that differ in their robot alone are
/// made of the centre's robot and share blocks, eight lanes with a controller each; their margins are those of
/// try_designs() up to the rounding with which a robot's file is written.
std::vector<DesignMargins> try_beside(const DesignRobots& robots, const DesignValues& centre,
                                      const std::vector<DesignValues>& designs, const TrialQuestion& question);

/// State and controller's memory of a nominal robot at the control step before `question.from`; null: that is the
/// start. Throws InputError if the robot cannot be made or its policy cannot be saved.
std::shared_ptr<const Beginning> recorded_beginning(const DesignRobots& robots, const DesignValues& design,
                                                    const TrialQuestion& question);

/// Names of the limits, in the order of their margins.
std::vector<std::string> limit_names(const Scenario& scenario);
std::vector<std::string> limit_units(const Scenario& scenario);

}  // namespace graze
