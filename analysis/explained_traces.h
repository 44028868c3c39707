#pragma once
// The traces of one policy in memory, as far as explanations look at them.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/freedoms.h"
#include "analysis/survival.h"
#include "archive/archive.h"

namespace graze {

struct ExplainedTrace {
  std::uint32_t particle = 0;
  Outcome outcome = Outcome::invalid;
  int violated = -1;
  bool cut = false;             // a violation ended it before its time
  double end_time = 0;          // s
  double objective_margin = 0;  // NaN: not judged, the trace was cut short
  std::vector<double> margins;  // [requirement]; NaN: not judged: kept until another violation cut the trace short, or
                                // its window was never reached
  std::vector<double> first_violations;  // [requirement], s; NaN: none
  std::vector<double> freedoms;          // final state, as Freedoms::read()
  bool valid() const { return outcome != Outcome::invalid; }
};

/// By particle, of those below `end`.
std::vector<ExplainedTrace> explained_traces(const Archive& archive, const std::string& policy,
                                             const Freedoms& freedoms, std::uint64_t end);

/// Until a requirement (-1: any that decides; their number: the objective, which fails at the end) was violated; seen
/// without that until the end.
Lifetime lifetime_of(const ExplainedTrace& trace, int requirement, std::size_t deciding);

/// How long the traces lasted until any requirement that decides was violated ("any requirement"), then each of these,
/// last the objective, which fails at the end.
std::vector<Survival> survivals(const CampaignInfo& info, const std::vector<ExplainedTrace>& traces);

}  // namespace graze
