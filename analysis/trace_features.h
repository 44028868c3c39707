#pragma once
// A trace as a row of numbers, for what tells traces apart by what they did.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "archive/archive.h"

namespace graze {

struct TraceFeature {
  enum class Kind { position, angle, joint, margin, contact };
  Kind kind;
  std::string name, unit;
  int a = -1, b = -1;           // parts of a contact, rows of CampaignInfo::colliders
  std::size_t requirement = 0;  // of a margin
};

/// Features of the traces of a policy: final position and attitude of the base, final joint positions, margins that all
/// have, and the largest impulse of a contact of each two parts that touch in some trace (N s; 0: they did not).
struct TraceFeatures {
  std::vector<TraceFeature> columns;
  std::vector<std::uint32_t> particle;        // [row], rising
  std::vector<bool> success;                  // [row]; else an unknown failure
  std::vector<double> values;                 // [row][column]
  std::uint64_t failures = 0, successes = 0;  // in the archive
  double operator()(std::size_t row, std::size_t column) const { return values[row * columns.size() + column]; }
  std::size_t rows() const { return particle.size(); }
};

/// Of successes and unknown failures; no more than `most` of each, those of the lowest particles.
TraceFeatures trace_features(const Archive& archive, const std::string& policy, std::size_t most);

}  // namespace graze
