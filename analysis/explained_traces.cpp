#include "analysis/explained_traces.h"

#include <algorithm>
#include <cmath>

#include "archive/schema/kept.h"

namespace graze {
namespace {

/// A margin is infinite where its window was never reached: that says nothing about how near a violation was. Nor does
/// one that was kept until another violation cut the trace short: who falls early strikes little.
double judged(double margin) { return std::isfinite(margin) ? margin : std::nan(""); }

}  // namespace

std::vector<ExplainedTrace> explained_traces(const Archive& archive, const std::string& policy,
                                             const Freedoms& freedoms, std::uint64_t end) {
  constexpr unsigned kColumns = kEndTime | kObjectiveMargin | kMargins | kFirstViolations | kFinalState;
  std::vector<ExplainedTrace> out;
  const auto take = [&](const TraceRows& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      ExplainedTrace& one = out.emplace_back();
      one.particle = rows.particle(i);
      one.outcome = rows.outcome(i);
      one.violated = rows.violated(i);
      one.end_time = std::isfinite(rows.end_time(i)) ? rows.end_time(i) : 0;  // a forged one
      one.cut = cut_short(one.outcome, one.end_time, archive.info());
      one.objective_margin = one.cut ? std::nan("") : judged(rows.objective_margin(i));
      for (const double margin : rows.margins(i)) {
        one.margins.push_back(one.cut && margin >= 0 ? std::nan("") : judged(margin));
      }
      one.first_violations.assign(rows.first_violations(i).begin(), rows.first_violations(i).end());
      one.freedoms.resize(freedoms.names().size());
      freedoms.read(rows.final_q(i), one.freedoms);
    }
  };
  archive.scan(policy, kColumns, take, [&](std::uint32_t particle, Outcome) { return particle < end; });
  std::sort(out.begin(), out.end(),
            [](const ExplainedTrace& a, const ExplainedTrace& b) { return a.particle < b.particle; });
  return out;
}

Lifetime lifetime_of(const ExplainedTrace& trace, int requirement, std::size_t deciding) {
  if (requirement == static_cast<int>(deciding)) return {trace.end_time, trace.outcome == Outcome::unknown_failure};
  double first = trace.end_time;
  bool failed = requirement < 0 && trace.outcome == Outcome::known_failure;
  for (std::size_t r = 0; r < deciding; ++r) {
    const double time = trace.first_violations[r];
    if (!std::isfinite(time) || (requirement >= 0 && static_cast<int>(r) != requirement)) continue;
    first = std::min(first, time);
    failed = true;
  }
  return {first, failed};
}

std::vector<Survival> survivals(const CampaignInfo& info, const std::vector<ExplainedTrace>& traces) {
  const auto deciding = static_cast<int>(info.deciding());
  std::vector<Survival> out;
  for (int r = -1; r <= deciding; ++r) {
    std::vector<Lifetime> lifetimes;
    for (const ExplainedTrace& trace : traces) {
      if (trace.valid()) lifetimes.push_back(lifetime_of(trace, r, info.deciding()));
    }
    Survival& one = out.emplace_back(survival_of(std::move(lifetimes)));
    one.what = r < 0          ? "any requirement"
               : r < deciding ? info.requirements[static_cast<std::size_t>(r)].name
                              : "objective";
  }
  return out;
}

}  // namespace graze
