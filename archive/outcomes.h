#pragma once
// What scores and counts take into account of each trace.

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "archive/archive.h"

namespace graze {

/// What is taken into account of one trace.
struct TraceOutcome {
  std::uint32_t particle;
  Outcome outcome;
  int violated;  // requirement index; -1: none
  double objective_margin;
  bool cut = false;             // it ended before its time, by a violation
  std::uint64_t kept = 0;       // bit k: the k-th measure was kept (kept_by)
  std::uint64_t undecided = 0;  // bit k: whether it was, nobody knows
  Culprit culprit = {};         // of a failure: at the first violation, else of the objective
  SolverLog solver = {};        // does not tell: nor does the archive, which is older than that
  bool flagged = false;         // more of its steps did not converge than the scenario lets pass
};

/// Of all traces of a policy, some at a time, each particle once, in no particular order (Archive::scan).
void visit_outcomes(const Archive& archive, const std::string& policy,
                    const std::function<void(std::span<const TraceOutcome>)>& take);

/// Traces of a policy, each particle once.
std::uint64_t count_traces(const Archive& archive, const std::string& policy);

}  // namespace graze
