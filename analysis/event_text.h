#pragma once
// Events in words.

#include <string>

#include "archive/archive.h"

namespace graze {

/// "LF_FOOT touches curb (side)", "LF_FOOT begins to slip on ground", "LF_SHIN reaches its upper joint limit".
std::string event_text(const Event& event, const CampaignInfo& info);

}  // namespace graze
