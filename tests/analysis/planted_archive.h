#pragma once
// Archives in which a test has planted what shall be found: traces of which nothing but that is known.

#include <filesystem>
#include <utility>
#include <vector>

#include "tests/archive/synthetic.h"

namespace graze::planted {

/// A trace that says no more than its outcome: no contacts, no culprits, nothing violated.
inline TraceRecord plain_trace(const CampaignInfo& info, int policy, std::uint32_t particle,
                               Outcome outcome = Outcome::success) {
  TraceRecord out = synthetic::trace(info, policy, particle);
  out.outcome = outcome;
  out.violated = -1;
  out.invalid_reason = outcome == Outcome::invalid ? "planted" : "";
  out.events.clear();
  out.phases.clear();
  out.margin_parts.assign(info.requirements.size(), kNoPart);
  out.violation_parts.assign(info.requirements.size(), kNoPart);
  out.objective_culprit = {};
  return out;
}

/// Writes a campaign of info.particles particles, of which traces of the first policy are there: `trace_of(particle)`,
/// asked in the order of particles. `shift` is added to the first parameter of each.
template <class TraceOf>
void write(const std::filesystem::path& path, const CampaignInfo& info, const TraceOf& trace_of, double shift = 0) {
  CampaignWriter writer(path, info, false);
  std::vector<TraceRecord> records;
  std::vector<double> values;
  for (std::uint32_t i = 0; i < info.particles; ++i) {
    records.push_back(trace_of(i));
    std::vector<double> row = synthetic::values(info, i);
    row[0] += shift;
    values.insert(values.end(), row.begin(), row.end());
  }
  writer.append(0, std::move(records), std::move(values));
  writer.finish();
}

}  // namespace graze::planted
