#pragma once
// The section of the report's page about why traces end as they do (docs/report.md tells what sections are made of).

#include "analysis/explanation.h"
#include "analysis/report_numbers.h"

namespace graze {

/// What graze explain finds: of each policy and question the parameters that matter, with effect, p and direction, the
/// decision tree, or that no parameter explains it; whether final states scatter or bifurcate. `archive`: as commands
/// shall name it.
Json causes_section(const Explanation& explanation, const std::string& archive);

}  // namespace graze
