#pragma once
// What `graze predict` prints.

#include <optional>
#include <string>
#include <vector>

#include "simulation/predictor.h"

namespace graze {

/// What was asked for, and what was told, of every call.
struct PredictionStory {
  std::string scenario, under;
  std::vector<std::string> requirements;  // without measures
  std::string objective_unit;
  double at = 0;          // s
  bool remembers = true;  // candidates went on with what the controller remembered
  double deadline = 0;    // s; infinite: none
  int threads = 0;        // that simulated
  std::vector<Prediction> calls;
  // --follow: what became of the robot, which went on under the best candidate; empty: not asked for, or no verdict.
  struct Followed {
    double verdict = 0;   // s, when it was there
    std::string ends;     // "success", …; empty: the trace had ended before
    double end_time = 0;  // s
  };
  std::optional<Followed> followed = {};
};

/// Tables of the first call, and sums of all.
std::string prediction_text(const PredictionStory& story);
/// In SI units.
std::string prediction_json(const PredictionStory& story);

}  // namespace graze
