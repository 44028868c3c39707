#pragma once

#include <cstdint>
#include <string>

#include "archive/archive.h"
#include "scenarios/scenario.h"

namespace graze {

/// What an archive says about its scenario and the program that simulates it; started now.
CampaignInfo describe_campaign(const Scenario& scenario, std::uint64_t particles, const std::string& command_line);

}  // namespace graze
