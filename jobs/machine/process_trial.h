#pragma once
// Whether processes can be started as verbs need them: children that read archives under limits, and workers that run
// controllers of others.

#include <vector>

#include "jobs/machine/finding.h"

namespace graze {

/// Starts one of each, and a worker with a scenario of its own. To be called before there are threads.
std::vector<Finding> process_findings();

}  // namespace graze
