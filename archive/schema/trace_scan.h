#pragma once
// The traces of one policy in a campaign of any size, part after part, piece after piece: what every question about
// many traces is answered by.

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "archive/schema/part.h"
#include "archive/schema/trace_rows.h"

namespace graze {

/// Passes the traces of a policy to `take`, some at a time, each particle once, in order of the parts; only those
/// `wanted`, if that is given: where none of a piece is, its other columns are not read. Memory: a piece (64 Ki traces,
/// or fewer that have 256 Ki events together), and a bit per particle. Needs the library's lock. Throws InputError: a
/// particle that stands in two parts with different digests, or values that only a damaged or forged file has.
void scan_traces(Parts& parts, const std::string& policy, const CampaignInfo& info, unsigned columns,
                 const std::function<void(const TraceRows&)>& take, const TraceFilter& wanted = {});

/// How many traces of a policy there are, each particle once. Needs and throws the same.
std::uint64_t count_traces(Parts& parts, const std::string& policy, const CampaignInfo& info);

/// Passes each particle's persistent values [parameter], each particle once, in order of the parts; nothing if they
/// were not stored. Memory and errors as above.
void scan_values(Parts& parts, const CampaignInfo& info,
                 const std::function<void(std::uint32_t, std::span<const double>)>& take);

}  // namespace graze
