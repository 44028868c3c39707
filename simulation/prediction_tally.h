#pragma once
// What a prediction keeps of its traces: sums, block by block, which are added in the order of the blocks.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "simulation/predictor.h"

namespace graze {

/// Where to look in a trace.
struct PredictionLayout {
  std::size_t requirements = 0;
  int base = -1;            // of a floating base's place in q; -1: it is fixed
  std::vector<int> joints;  // in q, the driven ones
  double step = 0;          // s, of the physics
};
PredictionLayout prediction_layout(const Scenario& scenario);

/// Of some particles under one candidate.
class PredictionTally {
 public:
  explicit PredictionTally(const PredictionLayout& layout);
  /// A trace that began at `begin` and lasts to `end` if nothing ends it, s.
  void add(const PredictionLayout& layout, const TraceRecord& trace, double begin, double end);
  /// Particles that cannot be made, and why the first cannot: they are invalid.
  void add_unfabricated(std::uint64_t count, const std::string& reason);
  void add(const PredictionTally& other);
  CandidatePrediction told(const PredictionLayout& layout, const std::string& policy) const;

 private:
  CandidatePrediction sums_;            // but for what told() computes
  std::array<NumberSummary, 3> place_;  // of the base, at the end
  std::vector<NumberSummary> joints_;   // likewise
};

}  // namespace graze
