#pragma once
// graze improve --verdict: other particles of the first robot and the improved one, compared in pairs.

#include <cstdint>
#include <filesystem>
#include <string>

#include "analysis/compare.h"
#include "jobs/campaign/improvement_file.h"

namespace graze {

struct VerdictRequest {
  const ImproveQuestion& question;
  std::uint64_t particles = 0;
  int threads = 0;
  bool force = false;  // replaces campaigns of its names that are none of its own
};

/// Campaigns of both scenario files in the folder of a session, beside them. Throws InputError, MachineError.
void simulate_verdict(const std::filesystem::path& folder, const VerdictRequest& request);
/// What they say, for the terminal.
std::string verdict_text(const PolicyComparison& pair, std::uint64_t asked, const std::filesystem::path& folder);

}  // namespace graze
