#pragma once
// A session of `graze improve` as a page for a browser: of `improve --report` and of `report DIR`.

#include <filesystem>
#include <optional>

#include "jobs/campaign/improvement_words.h"

namespace graze {

inline constexpr const char* kImprovedRobot = "improved.urdf";     // what a session leaves in its folder
inline constexpr const char* kImprovedScenario = "improved.yaml";  //
inline constexpr const char* kBeforeScenario = "before.yaml";      // the first robot in the same task

/// Both robots, simulated from their scenarios in the folder. Throws InputError.
DesignPair trace_pair(const std::filesystem::path& folder, const ImproveQuestion& question);

/// Success of both robots in the campaigns of the folder.
PolicyComparison session_verdict(const std::filesystem::path& folder);
/// The same; none: there are none that are whole and of these very robots.
std::optional<PolicyComparison> kept_verdict(const std::filesystem::path& folder);

/// Whether a folder is a session of graze improve.
bool is_session(const std::filesystem::path& folder);
/// The session in a folder: both robots are simulated again. Throws InputError: it has not come to an end yet, or its
/// scenario is another one now.
Redesign read_redesign(const std::filesystem::path& folder);

}  // namespace graze
