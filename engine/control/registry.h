#pragma once
// Policies and trackers by name, filled by the registrations at the end of each file of this folder.

#include <map>

#include "engine/control/policy.h"

namespace graze {

struct PolicyEntry {
  Description text;
  PolicyFactory make;
};

struct TrackerEntry {
  Description text;
  TargetKind kind;
  TrackerFactory make;
};

/// Sorted by name, so that lists in messages do not depend on link order. Filled before main, constant afterwards.
const std::map<std::string, PolicyEntry>& policy_registry();
const std::map<std::string, TrackerEntry>& tracker_registry();

}  // namespace graze
