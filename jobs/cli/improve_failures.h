#pragma once
// graze improve --from: a session that begins at what failed most in a campaign.

#include <cstdint>
#include <string>

#include "jobs/campaign/improvement_file.h"

namespace graze {

/// Says, on standard error, what the session begins at, and takes its particles, seed and design from the archive.
/// `particles`: the most; 0: as many as usual. Throws InputError: a campaign of another scenario or robot, without that
/// policy, without failures.
void begin_at_failures(const std::string& archive, std::uint64_t particles, const Scenario& scenario,
                       ImproveQuestion& question);

}  // namespace graze
