#pragma once
// What a report plots trace by trace: the first particles of a campaign under each policy, as many as a page holds.
// Particles are drawn alike, so that the first ones stand for all.

#include <cstdint>
#include <string>
#include <vector>

#include "archive/archive.h"

namespace graze {

/// Traces of one policy, by particle from ReportSample::first on.
struct SampledTraces {
  std::string policy;
  std::string outcome;                       // [particle]: S, K, U, I (invalid), or '.': there is none
  std::vector<int> violated;                 // [particle]: requirement; -1: none
  std::vector<double> end, objective;        // [particle]: s; margin. NaN: there is none
  std::vector<std::vector<double>> margins;  // [requirement][particle]
};

struct ReportSample {
  std::uint32_t first = 0, count = 0;       // particles
  std::vector<SampledTraces> policies;      // as asked for
  std::vector<std::vector<double>> values;  // [parameter][particle]; empty: the archive does not keep them
};

/// Traces of a whole page: 10,000 open in well under two seconds.
inline constexpr std::uint64_t kPlottedTraces = 10'000;

/// Traces that are asked for causes: for 1000 explain() takes as long as all else that is read for a page.
inline constexpr std::uint64_t kExplainedTraces = 1000;

/// Of so many policies the particles that make `most` traces, but at least 100.
std::uint64_t particles_of_traces(std::uint64_t most, std::size_t policies);

/// Throws as Archive::scan().
ReportSample sample_traces(const Archive& archive, const std::vector<std::string>& policies,
                           std::uint64_t most = kPlottedTraces);

/// Of the particles that succeeded under a policy the one that is nearest to the nominal robot: the least sum of
/// squares of (value - nominal) / standard deviation within the sample, over all parameters but choices. Without
/// values: the first. -1: none succeeded.
std::int64_t nominal_success(const ReportSample& sample, const SampledTraces& traces, const CampaignInfo& info);

}  // namespace graze
