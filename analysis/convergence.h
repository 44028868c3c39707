#pragma once
// How well contact was solved in the traces of a policy: nothing that did not converge is counted in silence.

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "archive/outcomes.h"
#include "simulation/change_counts.h"

namespace graze {

/// Sums over the traces of a policy, invalid ones among them, whose back end tells of its solver.
struct Convergence {
  std::uint64_t traces = 0, steps = 0;
  std::uint64_t unconverged_steps = 0, unconverged_traces = 0;  // the latter have at least one such step
  double largest_change = 0;                                    // the largest last change of a step, m/s or rad/s
  /// Of the steps that did not converge: median of the traces' medians, each as often as it has such steps. NaN: there
  /// are none, or the archive does not know.
  double median_change = 0;
  std::uint64_t braked_steps = 0, braked_traces = 0;
  double most_braked = 0;                      // the largest change that the brake has made, m/s or rad/s
  std::array<std::uint64_t, 4> flagged = {};   // traces, by Outcome
  std::optional<std::uint32_t> first_flagged;  // the lowest particle among them

  /// Of a class, of all valid traces, of all.
  std::uint64_t flagged_in(Outcome outcome) const { return flagged[static_cast<std::size_t>(outcome)]; }
  std::uint64_t flagged_valid() const;
  std::uint64_t flagged_all() const { return flagged_valid() + flagged_in(Outcome::invalid); }
};

/// Adds up traces, in any order, each once.
class ConvergenceSum {
 public:
  void add(std::uint32_t particle, Outcome outcome, const SolverLog& log, bool flagged);
  void add(const TraceOutcome& trace) { add(trace.particle, trace.outcome, trace.solver, trace.flagged); }
  Convergence total() const;

 private:
  Convergence sum_;
  ChangeCounts medians_;
};

/// "0.46 %"
std::string percent(double share);

/// "12 of 3000 steps (0.4 %)"; `all` is not 0.
std::string steps_text(std::uint64_t some, std::uint64_t all);

/// What a line of the table is about: a policy, or one of one of two campaigns.
struct NamedConvergence {
  std::string name;
  Convergence convergence;
};

/// "more than 5 % of them": what makes a trace flagged.
std::string flag_rule(double limit);

/// A line for each that has such steps, with a head that tells the rule; empty if there are none.
std::string convergence_table(std::span<const NamedConvergence> rows, const std::string& rule);

/// The same of one policy in a sentence, without a point; empty if all its steps converged and none was braked.
std::string convergence_sentence(const Convergence& convergence, double limit);

/// null: no trace's back end tells of its solver.
nlohmann::ordered_json convergence_json(const Convergence& convergence);

/// The same of one trace, JSON by the same names: "" if all its steps converged and none was braked.
std::string solver_lines(const SolverLog& log, double limit);
nlohmann::ordered_json solver_json(const SolverLog& log, double limit);

}  // namespace graze
