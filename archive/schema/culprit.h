#pragma once
// The culprit of a margin, in words: the part that a witness over several parts names.

#include <string>

#include "archive/schema/campaign_info.h"
#include "simulation/trace.h"

namespace graze {

/// "links", "joints", "pairs"; empty for PartKind::none. What CampaignInfo says of its witnesses' parts.
std::string part_kind_name(PartKind kind);

/// How many parts a witness that says `parts` of itself can name; 0: none.
std::uint64_t part_count(const std::string& parts, const CampaignInfo& info);

/// "LF_Y_3", "LF_FOOT and curb"; empty: kNoPart, or one that the campaign does not have.
std::string part_name(const std::string& parts, int part, const CampaignInfo& info);

/// Of a violated requirement (`violated` >= 0) its part; else of the objective its part, behind the leaf's description
/// where the objective has several. Empty: nothing to tell.
std::string culprit_text(int violated, Culprit culprit, const CampaignInfo& info);

}  // namespace graze
