#pragma once
// The failures of a campaign: what there is to say of each in a line.

#include <functional>

#include "archive/schema/part.h"
#include "archive/schema/tables.h"

namespace graze {

/// As Archive::failures(). Needs the library's lock. Throws InputError.
FailureTable scan_failures(Parts& parts, const std::string& policy, const CampaignInfo& info,
                           const std::function<bool(std::uint32_t)>& wanted);

}  // namespace graze
