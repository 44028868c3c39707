#pragma once
// Outcomes of a campaign of any size: part after part, piece after piece.

#include <functional>
#include <span>
#include <string>

#include "archive/schema/part.h"
#include "archive/schema/tables.h"

namespace graze {

/// Gives the outcomes of all traces of a policy, each particle once, in order of the parts. Memory: a piece, and a bit
/// per particle. Needs the library's lock. Throws InputError: a particle that stands in two parts with different
/// digests, or values that only a damaged or forged file has.
void scan_outcomes(Parts& parts, const std::string& policy, const CampaignInfo& info,
                   const std::function<void(std::span<const TraceOutcome>)>& take);

}  // namespace graze
