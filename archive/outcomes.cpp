#include "archive/outcomes.h"

#include <algorithm>
#include <vector>

#include "archive/schema/kept.h"

namespace graze {
namespace {

/// `margins`: of all requirements and measures.
void judge_measures(std::span<const double> margins, double end_time, const CampaignInfo& info, TraceOutcome& out) {
  const std::size_t deciding = info.deciding(), measures = std::min(margins.size() - deciding, kMostMeasures);
  for (std::size_t k = 0; k < measures; ++k) {
    const std::size_t i = deciding + k;
    const Kept kept = kept_by(info.requirements[i], margins[i], out.outcome, end_time, info);
    out.kept |= std::uint64_t{kept == Kept::yes} << k;
    out.undecided |= std::uint64_t{kept == Kept::undecided} << k;
  }
}

}  // namespace

void visit_outcomes(const Archive& archive, const std::string& policy,
                    const std::function<void(std::span<const TraceOutcome>)>& take) {
  const CampaignInfo& info = archive.info();
  const bool measures = info.deciding() < info.requirements.size();
  const unsigned columns = kEndTime | kObjectiveMargin | kCulprits | kSolver | (measures ? kMargins : 0u);
  std::vector<TraceOutcome> out;
  archive.scan(policy, columns, [&](const TraceRows& rows) {
    out.clear();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      TraceOutcome& trace = out.emplace_back();
      trace = {rows.particle(i), rows.outcome(i), rows.violated(i), rows.objective_margin(i)};
      trace.cut = cut_short(trace.outcome, rows.end_time(i), info);
      trace.culprit = rows.culprit(i);
      if (rows.has_solver()) trace.solver = rows.solver(i);
      trace.flagged = trace.solver.flagged(info.unconverged);
      if (measures) judge_measures(rows.margins(i), rows.end_time(i), info, trace);
    }
    take(out);
  });
}

std::uint64_t count_traces(const Archive& archive, const std::string& policy) {
  std::uint64_t traces = 0;
  archive.scan(policy, 0, [&](const TraceRows& rows) { traces += rows.size(); });
  return traces;
}

}  // namespace graze
