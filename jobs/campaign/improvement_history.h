#pragma once
// What a session of redesign came through, as HDF5: for NumPy and pandas, beside improve.json, which the session itself
// goes on from.

#include <filesystem>

#include "jobs/campaign/improvement.h"

namespace graze {

inline constexpr const char* kHistoryFile = "history.h5";

/// Writes FOLDER/history.h5 in the place of what was there: `variables/` (names, units, initial, lower, upper),
/// `limits/` (names, units, scales) and `steps/`, a row per design step (docs/improve.md). Throws MachineError.
void write_history(const std::filesystem::path& folder, const Scenario& scenario, const ImproveState& state);

}  // namespace graze
