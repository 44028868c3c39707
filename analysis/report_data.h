#pragma once
// The data of a report (docs/report.md): what its page shows and `graze report --json` prints, but for what is
// simulated anew.

#include <string>
#include <vector>

#include "analysis/report_failures.h"
#include "analysis/report_numbers.h"
#include "analysis/report_sample.h"
#include "analysis/score.h"

namespace graze {

/// What of an archive a report is made from.
struct ReportInput {
  Score score;
  std::vector<FailureWay> ways;
  ReportSample sample;
};

/// Reads it. `name`: the archive as replay commands shall name it; `policies`: those that it is about. Throws as
/// Archive::scan().
ReportInput read_report(const Archive& archive, const std::string& name, const std::vector<std::string>& policies);

/// Facts of the campaign that head a page.
Json campaign_json(const CampaignInfo& info, const std::string& archive);

/// The data of the page as one object: "campaign", "score" (as score_json()), "ways", "families", "margins", "traces",
/// "parameters"; "channels", "trajectories" and "sections" are there for others to fill.
Json report_data(const Archive& archive, const ReportInput& input, NumberForm form);

/// The data as text for a script element of a page: JSON in which nothing can end a script element or begin a comment.
std::string script_json(const Json& data);

}  // namespace graze
