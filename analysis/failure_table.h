#pragma once
// The failures of a policy: what there is to say of each in a line.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/failures.h"
#include "archive/archive.h"

namespace graze {

/// Failed traces of one policy (known, unknown and invalid), or flagged ones, in order of particle id.
struct FailureTable {
  struct Row {
    std::uint32_t particle = 0;
    Outcome outcome = Outcome::invalid;
    int violated = -1;         // requirement index, known failures only
    std::uint32_t reason = 0;  // index into `reasons`, invalid traces only
    double time = 0;           // s: of the violation, else of the end
    double margin = 0;         // of the violated requirement, else of the objective
    Culprit culprit = {};      // at the first violation, else of the objective
    double unconverged = 0;    // share of its steps; NaN: not known
  };
  std::vector<Row> rows;
  std::vector<std::string> reasons;
};

/// Of all particles or of those `wanted`. Memory: a row for each failure. Throws as Archive::scan().
FailureTable failures_of(const Archive& archive, const std::string& policy,
                         const std::function<bool(std::uint32_t)>& wanted = {});

/// The same of flagged traces, whatever became of them: more of their steps did not converge than the scenario lets
/// pass.
FailureTable flagged_traces_of(const Archive& archive, const std::string& policy,
                               const std::function<bool(std::uint32_t)>& wanted = {});

/// A row of the table in words; `policy`: the one that the table is of.
Failure describe_failure(const FailureTable& table, const FailureTable::Row& row, const std::string& policy,
                         const CampaignInfo& info);

}  // namespace graze
