#pragma once
// Everything that a part holds, read once: what `graze verify` does.

#include "archive/schema/part.h"

namespace graze {

/// Throws InputError, which names the file, unless all groups and datasets are where an archive has them (hard links
/// only, each object once, no more stored than the file has), every dataset of the part can be read, columns of a table
/// are equally long, outcomes follow from their margins, and ids, times, last states, indices and offsets are possible.
/// Needs the library's lock.
void check_part(OpenPart& part, const CampaignInfo& info);

/// Throws InputError unless what scores and listings of one part are made of can be read: ids in their order, outcomes,
/// failures and last states of all policies. Cheaper than the above: events, telemetry and parameter values are left
/// out. Needs the library's lock.
void check_outcomes(Parts& part, const CampaignInfo& info);

}  // namespace graze
