#pragma once
// Which parts failed: of requirements over several joints, links or pairs, and of objectives, how many traces each part
// is to blame for.

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "archive/outcomes.h"

namespace graze {

/// Failed traces of one policy by the culprit: the part that was below 0 first, or that missed the objective.
class Culprits {
 public:
  struct Count {
    std::string what;     // the requirement, or "objective"
    std::string culprit;  // as culprit_text()
    std::uint64_t traces;
  };

  void add(const TraceOutcome& trace);
  /// Requirements in their order, then the objective; of each the part with the most traces first. Nothing for traces
  /// of which there is nothing to tell.
  std::vector<Count> counts(const CampaignInfo& info) const;

 private:
  struct Key {
    int violated;
    Culprit culprit;
    bool operator<(const Key& other) const {
      return std::tie(violated, culprit.leaf, culprit.part) <
             std::tie(other.violated, other.culprit.leaf, other.culprit.part);
    }
  };
  std::map<Key, std::uint64_t> traces_;
};

}  // namespace graze
