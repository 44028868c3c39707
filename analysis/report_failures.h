#pragma once
// How the traces of a campaign failed, way by way, and which traces a report shows from beginning to end.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/report_sample.h"
#include "archive/archive.h"

namespace graze {

/// Traces of one policy that failed alike: by the same requirement (or the objective, or the same reason of being
/// invalid) and the same culprit.
struct FailureWay {
  std::string policy;
  Outcome outcome = Outcome::invalid;
  std::string what, culprit, unit;  // as Failure
  std::uint64_t traces = 0;
  double earliest = 0;  // s, of the violation, else of the end; NaN: not known
  double worst = 0;     // margin
  std::uint32_t earliest_particle = 0, worst_particle = 0;
  std::uint32_t typical_particle = 0;  // whose margin is the median
};

/// By policy, the most frequent first; equally frequent ones by outcome and requirement.
std::vector<FailureWay> failure_ways(const Archive& archive, const std::vector<std::string>& policies);

/// A trace that a report shows from beginning to end.
struct ChosenTrace {
  std::string policy;
  std::uint32_t particle = 0;
  std::string why;  // "success nearest to the nominal robot"
};

/// Of each policy in turn: the success nearest to the nominal robot, the typical trace of each way to fail, the
/// earliest violation; then others in the order of their particles. `most` in all, the most telling first. Depends on
/// the archive alone.
std::vector<ChosenTrace> choose_traces(const std::vector<FailureWay>& ways, const ReportSample& sample,
                                       const CampaignInfo& info, std::size_t most);

}  // namespace graze
