#pragma once
// What a session of redesign came through, as HDF5: for NumPy and pandas, beside improve.json, which the session itself
// goes on from.

#include <filesystem>

#include "jobs/campaign/design_trace.h"
#include "jobs/campaign/improvement.h"

namespace graze {

inline constexpr const char* kHistoryFile = "history.h5";

/// Writes FOLDER/history.h5 in the place of what was there: `variables/` (names, units, initial, lower, upper),
/// `limits/` (names, units, scales), `steps/`, a row per design step, `refused/`, a row per proposal that was rolled
/// back, and `traces/`, what the drives of the first and of the improved robot did (docs/improve.md). Throws
/// MachineError.
void write_history(const std::filesystem::path& folder, const Scenario& scenario, const ImproveState& state,
                   const DesignPair& traces);

}  // namespace graze
