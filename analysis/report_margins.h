#pragma once
// How margins are distributed: of each requirement, measure and the objective, under each policy, by outcome.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/report_sample.h"
#include "archive/archive.h"

namespace graze {

/// Counts of all traces of a campaign, of which the sample gives the range of the bins. The first bin holds what lies
/// below its range, too, and the last what lies above.
struct MarginHistogram {
  std::string name, unit;  // of the requirement; "objective"
  bool measure = false;
  std::vector<double> edges;  // rising, one more than bins; 0 is one of them if margins have both signs
  struct Counts {
    std::string policy;
    std::vector<std::array<std::uint64_t, 3>> bins;  // [bin]: S, K, U
    std::uint64_t unjudged = 0;                      // valid traces without a margin: their window held no step
  };
  std::vector<Counts> policies;
};

/// Requirements in their order, then the objective.
std::vector<MarginHistogram> margin_histograms(const Archive& archive, const ReportSample& sample);

}  // namespace graze
