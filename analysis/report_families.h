#pragma once
// Policies that differ in a parameter: those that a scenario expanded from one by `over`.

#include <string>
#include <vector>

#include "archive/archive.h"

namespace graze {

struct PolicyFamily {
  std::string name;  // "step"
  struct Axis {
    std::string key, unit;  // "gait.step_height", "cm"
    bool numeric = true;    // all its values are numbers in one unit
  };
  std::vector<Axis> axes;
  struct Member {
    std::string policy;               // "step/1cm"
    std::vector<std::string> labels;  // [axis]: "1cm"
    std::vector<double> values;       // [axis], in the axis's unit; of one that is not numeric 0, 1, 2 … by its label
  };
  std::vector<Member> members;
};

/// Those with two members or more among `policies`, from the archive's scenario text. None if that does not read.
std::vector<PolicyFamily> policy_families(const CampaignInfo& info, const std::vector<std::string>& policies);

}  // namespace graze
