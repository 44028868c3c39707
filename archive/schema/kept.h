#pragma once
// What the margin of a measure says. A trace that a violation ends before the measure's window is over has not shown
// that it would have kept it.

#include "archive/schema/campaign_info.h"
#include "simulation/trace.h"

namespace graze {

/// Whether a trace with this outcome and end, s, ended before its time. Only violations end traces early, but for
/// invalid ones, which count nowhere.
bool cut_short(Outcome outcome, double end_time, const CampaignInfo& info);

enum class Kept { no, yes, undecided };
const char* kept_name(Kept kept);  // "no", "yes", "undecided"

/// Of a valid trace: no if the measure was ever below 0; yes if it was looked at throughout its window, as far as
/// traces go, and never was; else undecided.
Kept kept_by(const CampaignInfo::RequirementRow& measure, double margin, Outcome outcome, double end_time,
             const CampaignInfo& info);

}  // namespace graze
