#pragma once
// Sections of the report's page about what happened in traces (docs/report.md tells what sections are made of).

#include <nlohmann/json.hpp>

#include "analysis/events.h"
#include "analysis/unknown_failures.h"

namespace graze {

/// Where behaviour divides, and what is new.
nlohmann::ordered_json events_section(const CampaignEvents& events);
/// Kinds of unknown failures; null if there are none.
nlohmann::ordered_json unknown_section(const std::vector<UnknownFailures>& all, const std::string& archive);

}  // namespace graze
